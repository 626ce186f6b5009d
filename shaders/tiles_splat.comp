#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "particles.glsl"
#include "blob.glsl"
#include "philox.glsl"
#include "functions.glsl"
#include "shade.glsl"
#include "texture.glsl"
#include "tiles.glsl"
#include "one_subgroup.glsl"
#if ONE_SUBGROUP
#extension GL_KHR_shader_subgroup_shuffle : require
#endif

// Projects each blob to a splat, near to far, a block a workgroup (passes.md
// "tiles"). In: sorted entries, placed particles, radiance. Out: splats (the conic of the optical
// depth on the screen), and the bins that each can reach. Bound: rectangles are widened as in
// blob.glsl.

#ifndef INVOCATIONS
#define INVOCATIONS 8
#endif
// 1: slices have the light of the cells where they are, and splats only its colour.
#ifndef CELLS
#define CELLS 0
#endif

layout(local_size_x = INVOCATIONS) in;

layout(push_constant) uniform Push {
    Camera camera;
    vec2 pixel;
    float cutoff;
    uint i_first_facet;
    uint width;
    uint height;
    uint tile_width;
    uint tile_height;
    float inv_threshold;
    float least_cut;
} push;
READS(0, uvec2, entries)
// A Lit is four texels.
TEXELS(1, placed)
TEXELS(2, particles)
TEXELS(3, lit)
READS(4, uint, i_facet)
READS(5, uint, i_group)
READS(6, Drawn, drawn)
READS(7, Textured, textured)
// A Splat is two texels.
TEXEL_STORES(8, splats)
// Tiles that the splat can reach: (first, end) of columns and of rows, 16 bits each; 0 for none.
WRITES(9, uvec2, reach)
// Pairs of the splats before it in its block, and of each block.
WRITES(10, uint, n_before)
WRITES(11, uint, n_pairs)
// The SplatTexture of each splat, three texels; only with textures.
TEXEL_STORES(12, sheets)
READS(13, Kept, kept)
// Ellipsoids' conics, in powers of two, and 1/a^2. Where they are turned: that and a Lean, the
// number |M s|^2 first.
TEXEL_STORES(14, conics)
// Slopes of the light by facet, and the changes of the splats' light; only where blobs are shaded.
READS(15, Slope, slopes)
TEXEL_STORES(16, shades)

#if !ONE_SUBGROUP
shared uint sums[INVOCATIONS];
#endif

const float LOG2_E = 1.44269504089;

// Projects particle i to splat r and returns the number of bins that it can reach; where that is 0
// only its rectangle is set.
uint project(uint i, uint r) {
    reach[r] = uvec2(0);
    if (i == NO_PARTICLE) {
        return 0u;
    }
    Placed blob = PLACED_AT(i);
    Particle particle = PARTICLE_AT(i);
    vec3 v = along_camera(push.camera, blob.position - push.camera.eye);
    float sigma = blob.sigma;
    float tau = SQRT_TAU * particle.kappa * sigma;
    if (WEIGHTED != 0) {
        tau *= weight_of(drawn[i_group[i]], i);
    }
    if (!(v.z >= push.camera.near) || !(tau > 0.0)) {
        return 0u;
    }
    float deepest = tau;
    Shape shape;
    if (ELLIPSOIDS != 0) {
        shape = shape_of(push.camera, particle.aspect, particle.aspect_z, particle.turn);
        deepest *= shape.wider;
    }
    float reach_in_sigma = push.cutoff;
    if (THRESHOLD != 0) {
        float cut = max(log(deepest * push.inv_threshold), push.least_cut);
        cut = min(0.5 * push.cutoff * push.cutoff, cut);
        if (!(cut > 0.0)) {
            return 0u;
        }
        reach_in_sigma = sqrt(2.0 * cut);
    }
    vec2 s = v.xy / v.z;
    uvec2 size = uvec2(push.width, push.height);
    uvec4 pixels =
        silhouette(shape, push.camera, push.pixel, v, GROWTH * reach_in_sigma * sigma, size);
    uvec2 columns = pixels.xy, rows = pixels.zw;
    if (columns.x == columns.y || rows.x == rows.y) {
        return 0u;
    }
    // b^2/(2 sigma^2) = scale (d.x^2 + d.y^2 + (s.x d.y - s.y d.x)^2) / (1 + |ray|^2), d = ray - s;
    // in powers of two.
    float scale = 0.5 * LOG2_E * (v.z / sigma) * (v.z / sigma);
    vec3 radiance = particle.color;
    if (LIT != 0) {
        int facet = int(GROUPED != 0 ? i_facet[i] : push.i_first_facet + i);
#if CELLS
        radiance = uintBitsToFloat(TEXEL(lit, 4 * facet + 1).xyz);
#else
        radiance = uintBitsToFloat(TEXEL(lit, 4 * facet + 2).xyz)
                   + uintBitsToFloat(TEXEL(lit, 4 * facet + 3).xyz);
#endif
        if (SHADED != 0) {
            Shade shade = shade_of(push.camera, slopes[facet], shape, blob.position, v, sigma);
            radiance *= shade.base;
            STORE_TEXEL(shades, int(r), floatBitsToUint(vec4(shade.seen, 0.0)));
        }
    }
    STORE_TEXEL(splats, int(2 * r), floatBitsToUint(vec4(s, scale, tau)));
    vec4 seen = vec4(radiance, push.camera.near / v.z);
    STORE_TEXEL(splats, int(2 * r + 1), floatBitsToUint(seen));
    if (ELLIPSOIDS != 0) {
        vec4 conic = vec4(conic_of(shape, s, scale), shape.inverse);
        if (ELLIPSOIDS == 2) {
            Lean lean = lean_of(shape, s);
            conic.w = lean.white;
            bool is_ball = shape.square == 1.0 && shape.square_z == 1.0;
            vec4 further = vec4(lean.lean, is_ball ? 1.0 : 0.0, 0.0);
            STORE_TEXEL(conics, int(2 * r + 1), floatBitsToUint(further));
        }
        STORE_TEXEL(conics, int(ELLIPSOIDS * r), floatBitsToUint(conic));
    }
    uvec2 tile = uvec2(push.tile_width, push.tile_height);
    if (TEXTURED != 0) {
        TextureSample texture_sample =
            texture_sample_of(textured[i_group[i]], i, v.z / sigma, push.pixel.y);
        STORE_TEXEL(sheets, int(3 * r), floatBitsToUint(texture_sample.turn));
        uvec3 gain = floatBitsToUint(texture_sample.gain);
        STORE_TEXEL(sheets, int(3 * r + 1), uvec4(gain, texture_sample.place.x));
        STORE_TEXEL(sheets, int(3 * r + 2), uvec4(texture_sample.place.y, 0u, 0u, 0u));
    }
    // In tiles: a rectangle of them, ends included.
    uvec2 first = uvec2(columns.x, rows.x) / tile, last = (uvec2(columns.y, rows.y) - 1u) / tile;
    reach[r] = first | (last + 1u) << 16;
    first /= TILES_ACROSS;
    last /= TILES_ACROSS;
    uvec2 n = last - first + 1u;
    return n.x * n.y;
}

// Returns (sum of n over the invocations up to this one, sum over all).
uvec2 sums_of(uint n) {
    uint t = lane();
#if ONE_SUBGROUP
    uint sum = n;
    [[unroll]] for (uint apart = 1; apart < INVOCATIONS; apart *= 2) {
        uint left = subgroupShuffle(sum, max(t, apart) - apart);
        sum += t >= apart ? left : 0u;
    }
    return uvec2(sum, subgroupShuffle(sum, INVOCATIONS - 1));
#else
    sums[t] = n;
    barrier();
    uvec2 found = uvec2(0);
    for (uint k = 0; k < INVOCATIONS; ++k) {
        found += sums[k] * uvec2(uint(k <= t), 1u);
    }
    barrier();
    return found;
#endif
}

void main() {
    uint t = lane();
    uint n_splats = kept[0].sort.w;
    uint before = 0;
    for (uint k = 0; k < BLOCK; k += INVOCATIONS) {
        uint r = gl_WorkGroupID.x * BLOCK + k + t;
        uint n = 0;
        if (r < n_splats) {
            // Entries are sorted far to near.
            n = project(entries[n_splats - 1u - r].y, r);
        }
        uvec2 here = sums_of(n);
        if (r < n_splats) {
            n_before[r] = before + here.x - n;
        }
        before += here.y;
    }
    if (t == 0) {
        n_pairs[gl_WorkGroupID.x] = before;
    }
}
