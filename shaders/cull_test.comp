#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "blob.glsl"
#include "cull.glsl"
#include "one_subgroup.glsl"

// Tests which drawn particles can show in any pixel (passes.md "cull").
// In: placed particles, their groups, the camera. Out: one bit a particle, and the number of kept
// particles of each tile of 256.
// Law: depth >= near, tau > 0, sigma >= the smallest size, and the silhouette's rectangle holds a
// pixel's centre.
// Bound: conservative; the silhouette is widened by more than its rounding, so a particle that
// draws is never dropped.

#ifndef TILE_INVOCATIONS
#define TILE_INVOCATIONS 32
#endif

layout(local_size_x = TILE_INVOCATIONS) in;

// smallest: the least sigma over view depth, in slopes.
layout(push_constant) uniform Push {
    Camera camera;
    vec2 pixel;
    float cutoff;
    float inv_threshold;
    float least_cut;
    float smallest;
    uint n_particles;
    uint width;
    uint height;
} push;
TEXELS(0, placed)
TEXELS(1, particles)
READS(2, uint, i_group)
READS(3, Drawn, drawn)
// Bits of 32 particles, and the number of kept particles before them in their tile.
WRITES(4, uvec2, masks)
// Kept particles of each tile.
WRITES(5, uint, n_kept)

shared uint bits[WORDS];

bool is_kept(uint i) {
    Drawn group = drawn[i_group[i]];
    Placed blob = PLACED_AT(i);
    Particle particle = PARTICLE_AT(i);
    vec3 v = along_camera(push.camera, blob.position - push.camera.eye);
    float sigma = blob.sigma;
    float tau = SQRT_TAU * particle.kappa * sigma;
    if (WEIGHTED != 0) {
        tau *= weight_of(group, i);
    }
    Shape shape = upright_shape(push.camera, 1.0);
    if (ELLIPSOIDS != 0) {
        shape = shape_of(push.camera, particle.aspect, particle.aspect_z, particle.turn);
        tau *= shape.wider;
    }
    float reach = push.cutoff;
    bool is_dense = tau > 0.0;
    if (THRESHOLD != 0) {
        float cut = max(log(tau * push.inv_threshold), push.least_cut);
        cut = min(0.5 * push.cutoff * push.cutoff, cut);
        is_dense = is_dense && cut > 0.0;
        reach = sqrt(2.0 * max(cut, 0.0));
    }
    uvec2 size = uvec2(push.width, push.height);
    uvec4 pixels =
        silhouette(shape, push.camera, push.pixel, v, GROWTH * reach * sigma, size);
    float widest = ELLIPSOIDS != 0 ? sigma * shape.wider : sigma;
    bool is_in = pixels.x < pixels.y && pixels.z < pixels.w;
    return i < group.end && v.z >= push.camera.near && is_dense && widest >= push.smallest * v.z
           && is_in;
}

void main() {
    uint t = gl_LocalInvocationID.x;
    uint n_tiles = (push.n_particles + TILE - 1u) / TILE;
    for (uint tile = gl_WorkGroupID.x; tile < n_tiles; tile += gl_NumWorkGroups.x) {
        for (uint w = t; w < WORDS; w += TILE_INVOCATIONS) {
            bits[w] = 0;
        }
        wait_for_all();
        for (uint k = t; k < TILE; k += TILE_INVOCATIONS) {
            uint i = tile * TILE + k;
            if (i < push.n_particles && is_kept(i)) {
                // The bits do not depend on the order of the atomics.
                atomicOr(bits[k / 32], 1u << (k % 32));
            }
        }
        wait_for_all();
        for (uint w = t; w < WORDS; w += TILE_INVOCATIONS) {
            uint before = 0;
            for (uint k = 0; k < w; ++k) {
                before += bitCount(bits[k]);
            }
            masks[tile * WORDS + w] = uvec2(bits[w], before);
            if (w == WORDS - 1u) {
                n_kept[tile] = before + bitCount(bits[w]);
            }
        }
        wait_for_all();
    }
}
