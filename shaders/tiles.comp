#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "philox.glsl"
#include "functions.glsl"
#include "seen.glsl"
#include "tiles.glsl"
#include "one_subgroup.glsl"
#if ONE_SUBGROUP
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_KHR_shader_subgroup_vote : require
#endif

// Composes splats near to far, a tile a workgroup, a run of pixels an invocation
// (passes.md "tiles"). In: splats, sorted pairs (bin, splat), the ranges of the
// bins. Out: the picture, premultiplied, over the surfaces where there are any. Law: as sprites,
// but near to far (tile_thin.glsl), or by slices (tile_slices.glsl). A pixel that lets less through
// than push.saturated ends. Bound: (1 - A) of the radiance behind a saturated pixel; the errors of
// the power of two and of the opacity.

#ifndef INVOCATIONS
#define INVOCATIONS 8
#endif
// Rows of a tile.
#ifndef ROWS
#define ROWS 8
#endif
// 1: no blob's optical depth is above 1/8.
#ifndef THIN
#define THIN 0
#endif
// 1: a splat ends where its optical depth falls under a threshold.
#ifndef THRESHOLD
#define THRESHOLD 0
#endif
// Above 1: splats that overlap are composed by slices, and lie near to far by their centres'
// distances. A splat is dealt among so many. 0: one after the other.
#ifndef SLICES
#define SLICES 0
#endif
// 1: splats have textures.
#ifndef TEXTURED
#define TEXTURED 0
#endif
#if TEXTURED
TEXELS(9, pool)
#define SAMPLES_TEXTURE
#include "texture.glsl"
#endif

// 1: some splats are ellipsoids.
#ifndef ELLIPSOIDS
#define ELLIPSOIDS 0
#endif
#if ELLIPSOIDS
TEXELS(10, conics)
#endif
// 1: the light changes linearly across a splat.
#ifndef SHADED
#define SHADED 0
#endif
#if SHADED
TEXELS(11, shades)
#endif
// 1: slices have the light of the cells where they are, and splats only its colour.
#ifndef CELLS
#define CELLS 0
#endif
#if CELLS
// Radiance toward the eye by cell.
TEXELS(12, seen_cells)
#include "field.glsl"
#endif
// 1: every splat has its own exponent at which it ends, the same for all its pixels. It is computed
// where the splat is loaded: once, and not once for every row.
#define OWN_EDGE (THRESHOLD && !ELLIPSOIDS)

// 1: found splats wait in registers. Needs ONE_SUBGROUP.
#ifndef QUEUE
#define QUEUE 0
#endif
// 0: there is one round, and no state is kept.
#ifndef ROUNDS
#define ROUNDS 0
#endif
layout(local_size_x = INVOCATIONS) in;

// Pixels of an invocation's row.
const uint RUN = 8;
const uint TILE_WIDTH = RUN * (INVOCATIONS / ROWS);

layout(push_constant) uniform Push {
    vec2 tangents;
    vec2 pixel;
    uint width;
    uint height;
    uint n_bins_x;
    uint i_round;
    float cut;
    float saturated;
    float inv_threshold;
    float least_cut;
    float y_right;
    float y_up;
    float y_forward;
    // The near plane's distance over the thickness of a slice.
    float near_in_slices;
    // Where the cells lie, by slices from the eye.
    vec3 eye_in_cells;
    uint n_x;
    vec3 right_in_cells;
    uint n_y;
    vec3 up_in_cells;
    uint n_z;
    vec3 forward_in_cells;
} push;
TEXELS(0, splats)
READS(1, uvec2, pairs)
READS(2, Round, rounds)
READS(3, uvec4, ranges)
// Colour and opacity after the earlier rounds; with slices, what is in the open ones, too.
UPDATES(4, vec4, state)
#define PICTURE 5
#include "pixels.glsl"
#if BEHIND
// The surfaces' picture, as their target has it, and their near/z.
READS(6, uint, under)
READS(7, uint, depths)
#endif

#if TEXTURED
TEXELS(8, splat_textures)
#endif

// The picture has 16 bits a channel or fewer, and its functions of a splat are less exact.
const bool HALVES = PIXEL_WORDS < 4 && SLICES == 0;

#include "tile_splats.glsl"

// The invocation's row of pixels while it is composed.
float x_of[RUN];
#if ELLIPSOIDS == 1
// |ray|^2 across the scene's y, and along it.
float across[RUN];
float along[RUN];
#if SLICES
// The ray along the scene's y.
float upward[RUN];
#endif
#else
float inv_norm[RUN];
#endif
// -cut, and the transmittance of a saturated pixel: push constants would be fetched again for every
// splat.
float min_exponent;
float saturated;
#if THRESHOLD
float inv_threshold;
#endif
vec3 color[RUN];
// Opacity of the splats composed so far. The transmittance 1 - alpha would lose thin layers in its
// rounding.
float alpha[RUN];
#if BEHIND
// near/z of the surfaces.
float depth_of[RUN];
#endif

float length_of_ray(uint j) {
#if ELLIPSOIDS == 1
    return sqrt(across[j] + along[j]);
#else
    return inversesqrt(inv_norm[j]);
#endif
}

// Finds the row's optical depths of a splat; 0 in the pixels where it has ended or does not show.
void find_depths(Loaded splat, float y, bool shows[RUN], out float tau[RUN]) {
    // Centre's slopes, scale, tau.
    vec4 place = uintBitsToFloat(splat.fours[0]);
    vec2 s = place.xy;
    float dy = y - s.y;
#if ELLIPSOIDS
    vec4 conic = uintBitsToFloat(splat.fours[N_FOURS - ELLIPSOIDS]);
#if ELLIPSOIDS == 2
    vec2 lean = uintBitsToFloat(splat.fours[N_FOURS - 1].xy);
    float along_row = 1.0 + lean.y * dy, inv_scale = 1.0 / (place.z * conic.w);
#endif
    float a = -conic.x, b = -conic.y * dy, c = -conic.z * dy * dy;
    float lowest = min_exponent;
#else
    // -scale (dx^2 + dy^2 + (s.x dy - s.y dx)^2) as a polynomial of dx.
    float a = -place.z * (1.0 + s.y * s.y), b = 2.0 * place.z * s.x * s.y * dy,
          c = -place.z * (1.0 + s.x * s.x) * dy * dy;
#if OWN_EDGE
    float lowest = splat.lowest;
#else
    float lowest = min_exponent;
#endif
#endif
    // Step by step for all pixels, so that independent operations stand between a result and its
    // use.
    float dx[RUN], e[RUN], deep[RUN];
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        dx[j] = x_of[j] - s.x;
#if ELLIPSOIDS == 2
        float along = along_row + lean.x * dx[j], across = (a * dx[j] + b) * dx[j] + c;
        float inv_white = 1.0 / (conic.w * along * along - across * inv_scale);
        e[j] = across * inv_white;
        deep[j] = place.w * sqrt(inv_white / inv_norm[j]);
#elif ELLIPSOIDS
        float inv_white = 1.0 / (across[j] + conic.w * along[j]);
        e[j] = ((a * dx[j] + b) * dx[j] + c) * inv_white;
        // Optical depth of a ray through the centre.
        deep[j] = place.w * sqrt((across[j] + along[j]) * inv_white);
#else
        e[j] = ((a * dx[j] + b) * dx[j] + c) * inv_norm[j];
        deep[j] = place.w;
#endif
    }
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        bool is_seen = e[j] >= lowest && shows[j];
#if ELLIPSOIDS && THRESHOLD
        is_seen = is_seen && e[j] >= -max(log2(deep[j] * inv_threshold), push.least_cut);
#endif
#if TEXTURED
        e[j] += 1.44269504089
                * texture_exponent(
                    vec2(dx[j], dy), uintBitsToFloat(splat.fours[2]),
                    uvec2(splat.fours[3].w, splat.fours[4].x), uintBitsToFloat(splat.fours[3].xyz)
                );
        e[j] = clamp(e[j], -125.0, 125.0);
#endif
        float factor = HALVES ? power_of_two_16(e[j]) : power_of_two(e[j]);
        // By bits: llvmpipe takes twice as long to choose between two floats.
        tau[j] = uintBitsToFloat(floatBitsToUint(deep[j] * factor) & (is_seen ? ~0u : 0u));
    }
}

#if SLICES
#include "tile_slices.glsl"
#else
#include "tile_thin.glsl"
// Fours of a pixel's state.
const uint STATE_FOURS = 1;
#endif

// Composes n found splats, of which each of the first invocations has one. The others load any
// splat, without depth and light.
void compose_some(uint r, uint n, float y) {
    uint t = lane();
    Loaded splat = load_splat(int(r));
    splat.fours[0].w = t < n ? splat.fours[0].w : 0u;
    splat.fours[1].xyz = t < n ? splat.fours[1].xyz : uvec3(0);
#if OWN_EDGE
    float cut = max(log2(uintBitsToFloat(splat.fours[0].w) * inv_threshold), push.least_cut);
    splat.lowest = max(min_exponent, -cut);
#endif
#if SLICES
    find_shares(splat, t, t < n);
#endif
#if !ONE_SUBGROUP
    share_splat(splat, t);
#endif
    compose_loaded(splat, n, y);
#if !ONE_SUBGROUP
    barrier();
#endif
}

vec4 load(uint p) {
#if BEHIND
    uvec4 words = uvec4(0);
    [[unroll]] for (uint k = 0; k < PIXEL_WORDS; ++k) { words[k] = under[PIXEL_WORDS * p + k]; }
    return pixel_of(words, 0);
#else
    return vec4(0.0);
#endif
}

// Returns pixel j of the row over what stands behind it.
vec4 seen(uint j, uint p) { return vec4(color[j], alpha[j]) + (1.0 - alpha[j]) * load(p); }

// Draws tile i_tile of the bin that the range belongs to.
void draw_tile(uvec4 range, uint i_tile) {
    uint t = lane();
    uvec2 tile = TILES_ACROSS * uvec2(range.z % push.n_bins_x, range.z / push.n_bins_x)
                 + uvec2(i_tile % TILES_ACROSS, i_tile / TILES_ACROSS);
    uvec2 at = tile * uvec2(TILE_WIDTH, ROWS) + uvec2(RUN * (t / ROWS), t % ROWS);
    // Pixels beyond the picture's edge are composed as its last ones are, and not stored.
    uint row = min(at.y, push.height - 1u) * push.width;
    min_exponent = -push.cut;
    saturated = push.saturated;
#if THRESHOLD
    inv_threshold = push.inv_threshold;
#endif
    float y = push.tangents.y - (float(at.y) + 0.5) * push.pixel.y;
#if CELLS
    along_row = push.forward_in_cells + y * push.up_in_cells;
#endif
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        float x = (float(at.x + j) + 0.5) * push.pixel.x - push.tangents.x;
        uint p = row + min(at.x + j, push.width - 1u);
        x_of[j] = x;
#if ELLIPSOIDS == 1
        vec3 ray = vec3(x, y, 1.0), vertical = vec3(push.y_right, push.y_up, push.y_forward);
        float up = dot(vertical, ray);
        vec3 rest = ray - up * vertical;
        across[j] = dot(rest, rest);
        along[j] = up * up;
#if SLICES
        upward[j] = up;
#endif
#else
        inv_norm[j] = 1.0 / (1.0 + x * x + y * y);
#endif
#if ROUNDS
        vec4 before = state[STATE_FOURS * p];
        color[j] = before.xyz;
        alpha[j] = before.w;
#else
        color[j] = vec3(0.0);
        alpha[j] = 0.0;
#endif
#if BEHIND
        depth_of[j] = depths_of(uvec4(depths[p])).x;
#endif
#if SLICES
        start_slices(j, p);
#endif
    }
    // These loops test at their ends, as do those within: llvmpipe runs one more empty iteration
    // where the test comes first. Each loop has work in its first iteration.
    uint first = range.x;
    bool is_done;
    uint n = 0;
    do {
        uvec2 pair;
        do {
            uint i = first + t;
            pair = pairs[min(i, range.y - 1u)];
            bool hit = i < range.y && (pair.x >> (BIN_BITS + i_tile) & 1u) != 0;
            n = append(n, hit, pair.y);
            first += INVOCATIONS;
        } while (first < range.y && n < ENOUGH);
#if QUEUE
        compose_some(t < n ? waiting : pair.y, min(n, INVOCATIONS), y);
        waiting = left_over;
        n -= min(n, INVOCATIONS);
#else
        wait_for_all();
        uint k = 0;
        do {
            compose_some(k + t < n ? found[k + t] : pair.y, min(n - k, INVOCATIONS), y);
            k += INVOCATIONS;
        } while (k < n);
        n = 0;
        wait_for_all();
#endif
        float most = 0.0;
        [[unroll]] for (uint j = 0; j < RUN; ++j) { most = max(most, 1.0 - alpha[j]); }
        is_done = all_agree(most < push.saturated) || (first >= range.y && n == 0);
    } while (!is_done);
#if ROUNDS
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        if (at.x + j < push.width && at.y < push.height) {
            state[STATE_FOURS * (row + at.x + j)] = vec4(color[j], alpha[j]);
#if SLICES
            keep_slices(j, row + at.x + j);
#endif
        }
    }
#endif
#if SLICES
    close_all();
#endif
    [[unroll]] for (uint j = 0; j < RUN; j += TOGETHER) {
        if (at.x + j < push.width && at.y < push.height) {
            uint p = row + at.x + j;
            vec4 values[TOGETHER];
            [[unroll]] for (uint m = 0; m < TOGETHER; ++m) { values[m] = seen(j + m, p + m); }
            store_together(p, values);
        }
    }
}

void main() {
    uint w = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (w >= (ROUNDS != 0 ? rounds[push.i_round].tiles.w : rounds[push.i_round].alone.w)) {
        return;
    }
    uvec4 range = ranges[w];
    uint left = range.w;
    do {
        draw_tile(range, uint(findLSB(left)));
        left &= left - 1u;
    } while (left != 0);
}
