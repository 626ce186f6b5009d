#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "philox.glsl"
#include "functions.glsl"
#include "tiles.glsl"
#include "one_subgroup.glsl"
#if ONE_SUBGROUP
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_KHR_shader_subgroup_vote : require
#endif

// Composes the splats near to far, a tile a workgroup, a row of pixels an invocation (docs/model.md
// §11 "tiles").

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
// Surfaces hide what lies behind them; 2: their depth has 24 bits.
#ifndef BEHIND
#define BEHIND 0
#endif

// A splat ends where its optical depth falls under a threshold.
#ifndef THRESHOLD
#define THRESHOLD 0
#endif
// Splats have textures.
#ifndef TEXTURED
#define TEXTURED 0
#endif
#if TEXTURED
layout(binding = 9) uniform usamplerBuffer pool;
#define SHEET_PIXELS
#include "texture.glsl"
#endif

// Some splats are ellipsoids.
#ifndef ELLIPSOIDS
#define ELLIPSOIDS 0
#endif
#if ELLIPSOIDS
layout(binding = 10) uniform usamplerBuffer conics;
#endif

// 0: the round is the only one, and no state is kept.
#ifndef ROUNDS
#define ROUNDS 0
#endif
layout(local_size_x = INVOCATIONS) in;

// Pixels of an invocation's row.
const uint RUN = 8;
const uint TILE_WIDTH = RUN * (INVOCATIONS / ROWS);

layout(push_constant) uniform Push { vec2 tangents; vec2 pixel; uint width; uint height; uint n_bins_x; uint i_round; float cut; float saturated; float inv_threshold; float y_right; float y_up; float y_forward; } push;
layout(binding = 0) uniform usamplerBuffer splats;
layout(std430, binding = 1) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 2) readonly buffer Rounds { Round rounds[]; };
layout(std430, binding = 3) readonly buffer Ranges { uvec4 ranges[]; };
// Colour and opacity of what earlier rounds drew.
layout(std430, binding = 4) buffer State { vec4 state[]; };
#define PICTURE 5
#include "pixels.glsl"
#if BEHIND
// The surfaces, as they lie in their target, and their near/z.
layout(std430, binding = 6) readonly buffer Under { uint under[]; };
layout(std430, binding = 7) readonly buffer Depths { uint depths[]; };
#endif

#if TEXTURED
layout(binding = 8) uniform usamplerBuffer sheets;
#endif

// Splats that reach the tile, gathered before they are composed.
const uint MOST = 8 * INVOCATIONS;
shared uint found[MOST];

#if ONE_SUBGROUP
// Of what this invocation found, appends it in the order of invocations; the new number of found
// ones.
uint append(uint n, bool hit, uint r) {
    uvec4 hits = subgroupBallot(hit);
    if (hit) {
        found[n + subgroupBallotExclusiveBitCount(hits)] = r;
    }
    return n + subgroupBallotBitCount(hits);
}

bool all_agree(bool b) { return subgroupAll(b); }
#else
shared uint said[INVOCATIONS];
// As words: what is no float stays what it is.
shared uvec4 given[2 + 3 * TEXTURED + ELLIPSOIDS][INVOCATIONS];

uint append(uint n, bool hit, uint r) {
    uint t = gl_LocalInvocationID.x;
    said[t] = uint(hit);
    barrier();
    uint before = 0, all_of = 0;
    for (uint k = 0; k < INVOCATIONS; ++k) {
        before += k < t ? said[k] : 0u;
        all_of += said[k];
    }
    if (hit) {
        found[n + before] = r;
    }
    barrier();
    return n + all_of;
}

bool all_agree(bool b) {
    said[gl_LocalInvocationID.x] = uint(b);
    barrier();
    uint n = 0;
    for (uint k = 0; k < INVOCATIONS; ++k) {
        n += said[k];
    }
    barrier();
    return n == INVOCATIONS;
}
#endif

#if THIN
// 1 - e^-t for t in [0, 1/8]: t times the cubic through (1 - e^-t)/t at Chebyshev's points, within
// 1.6e-8 of it.
float opacity(float t) { return t * ((0.999999984752 - t * 0.499996093888) + t * t * (0.166509869621 - t * 0.039641773912)); }
#else
float opacity(float t) { return one_minus_exp(t); }
#endif

// The row of pixels that an invocation owns, while it is composed.
float x_of[RUN];
#if ELLIPSOIDS
// |ray|^2 across the scene's y, and along it.
float across[RUN];
float along[RUN];
#else
float inv_norm[RUN];
#endif
// -cut, and what lets less through is full: push constants would be fetched anew for every splat.
float least;
float full;
#if THRESHOLD
float inv_threshold;
#endif
vec3 color[RUN];
// What is composed hides so much: what passes, 1 - that, would lose thin layers in its rounding.
float opaque[RUN];
#if BEHIND
float depth_of[RUN];
#endif

// A splat as it lies in the buffers.
struct Loaded {
    // Centre's slopes, scale, tau.
    vec4 place;
    // Radiance, near/z.
    vec4 light;
#if TEXTURED
    vec4 turn;
    // Gain; first texel.
    uvec4 gain;
    // Log2 of its level's side.
    uint side;
#endif
#if ELLIPSOIDS
    vec4 conic;
#endif
};

void compose(Loaded splat, float y) {
    vec4 place = splat.place, light = splat.light;
    vec2 s = place.xy;
    float dy = y - s.y;
#if ELLIPSOIDS
    vec4 conic = splat.conic;
    float a = -conic.x, b = -conic.y * dy, c = -conic.z * dy * dy;
    float lowest = least;
#else
    // -scale (dx^2 + dy^2 + (s.x dy - s.y dx)^2) as a polynomial of dx.
    float a = -place.z * (1.0 + s.y * s.y), b = 2.0 * place.z * s.x * s.y * dy, c = -place.z * (1.0 + s.x * s.x) * dy * dy;
#if THRESHOLD
    float lowest = max(least, -log2(place.w * inv_threshold));
#else
    float lowest = least;
#endif
#endif
    // Step by step for all pixels, so that what waits for a result stands apart from it.
    float dx[RUN], e[RUN], deep[RUN], tau[RUN], passed[RUN];
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        dx[j] = x_of[j] - s.x;
#if ELLIPSOIDS
        float inv_white = 1.0 / (across[j] + conic.w * along[j]);
        e[j] = ((a * dx[j] + b) * dx[j] + c) * inv_white;
        // What a ray through the centre meets.
        deep[j] = place.w * sqrt((across[j] + along[j]) * inv_white);
#else
        e[j] = ((a * dx[j] + b) * dx[j] + c) * inv_norm[j];
        deep[j] = place.w;
#endif
    }
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        // What is left out is a pixel's own affair: it must not depend on who else is drawn.
        passed[j] = 1.0 - opaque[j];
        bool is_seen = e[j] >= lowest && !(passed[j] < full);
#if ELLIPSOIDS && THRESHOLD
        is_seen = is_seen && e[j] >= -log2(deep[j] * inv_threshold);
#endif
#if BEHIND
        is_seen = is_seen && light.w >= depth_of[j];
#endif
#if TEXTURED
        e[j] += 1.44269504089 * sheet_exponent(vec2(dx[j], dy), splat.turn, uvec2(splat.gain.w, splat.side), uintBitsToFloat(splat.gain.xyz));
        e[j] = clamp(e[j], -125.0, 125.0);
#endif
        // By its bits: llvmpipe takes twice as long to choose between two floats.
        tau[j] = uintBitsToFloat(floatBitsToUint(deep[j] * power_of_two(e[j])) & (is_seen ? ~0u : 0u));
    }
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        tau[j] = opacity(tau[j]);
    }
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        float here = passed[j] * tau[j];
        opaque[j] += here;
        color[j] += here * light.xyz;
    }
}

Loaded load_splat(int r) {
    Loaded splat;
    splat.place = uintBitsToFloat(texelFetch(splats, 2 * r));
    splat.light = uintBitsToFloat(texelFetch(splats, 2 * r + 1));
#if TEXTURED
    splat.turn = uintBitsToFloat(texelFetch(sheets, 3 * r));
    splat.gain = texelFetch(sheets, 3 * r + 1);
    splat.side = texelFetch(sheets, 3 * r + 2).x;
#endif
#if ELLIPSOIDS
    splat.conic = uintBitsToFloat(texelFetch(conics, r));
#endif
    return splat;
}

#if ONE_SUBGROUP
// What invocation m has loaded.
Loaded of_invocation(Loaded splat, uint m) {
    splat.place = subgroupShuffle(splat.place, m);
    splat.light = subgroupShuffle(splat.light, m);
#if TEXTURED
    splat.turn = subgroupShuffle(splat.turn, m);
    splat.gain = subgroupShuffle(splat.gain, m);
    splat.side = subgroupShuffle(splat.side, m);
#endif
#if ELLIPSOIDS
    splat.conic = subgroupShuffle(splat.conic, m);
#endif
    return splat;
}
#else
void give(Loaded splat, uint t) {
    given[0][t] = floatBitsToUint(splat.place);
    given[1][t] = floatBitsToUint(splat.light);
#if TEXTURED
    given[2][t] = floatBitsToUint(splat.turn);
    given[3][t] = splat.gain;
    given[4][t] = uvec4(splat.side);
#endif
#if ELLIPSOIDS
    given[2 + 3 * TEXTURED][t] = floatBitsToUint(splat.conic);
#endif
    barrier();
}

Loaded of_invocation(uint m) {
    Loaded splat;
    splat.place = uintBitsToFloat(given[0][m]);
    splat.light = uintBitsToFloat(given[1][m]);
#if TEXTURED
    splat.turn = uintBitsToFloat(given[2][m]);
    splat.gain = given[3][m];
    splat.side = given[4][m].x;
#endif
#if ELLIPSOIDS
    splat.conic = uintBitsToFloat(given[2 + 3 * TEXTURED][m]);
#endif
    return splat;
}
#endif

// Of the n found ones those from k on, one an invocation, each for all of them. Invocations without
// one have `spare`, any splat, without depth and light.
void compose_some(uint k, uint n, uint spare, float y) {
    uint t = gl_LocalInvocationID.x;
    Loaded splat = load_splat(int(k + t < n ? found[k + t] : spare));
    splat.place.w = k + t < n ? splat.place.w : 0.0;
    splat.light.xyz = k + t < n ? splat.light.xyz : vec3(0.0);
    uint end = min(n - k, INVOCATIONS);
#if ONE_SUBGROUP
    // By twos: what a loop carries is written anew at each turn.
    uint m = 0;
    do {
        compose(of_invocation(splat, m), y);
        compose(of_invocation(splat, m + 1), y);
        m += 2;
    } while (m < end);
#else
    give(splat, t);
    uint m = 0;
    do {
        compose(of_invocation(m), y);
        ++m;
    } while (m < end);
    barrier();
#endif
}

vec4 load(uint p) {
#if !BEHIND
    return vec4(0.0);
#elif PIXEL_WORDS == 1
    return unpackUnorm4x8(under[p]);
#elif PIXEL_WORDS == 2
    return vec4(unpackHalf2x16(under[2 * p]), unpackHalf2x16(under[2 * p + 1]));
#else
    return uintBitsToFloat(uvec4(under[4 * p], under[4 * p + 1], under[4 * p + 2], under[4 * p + 3]));
#endif
}

#if BEHIND == 2
float depth_at(uint p) { return float(depths[p] & 0xffffffu) / 16777215.0; }
#elif BEHIND
float depth_at(uint p) { return uintBitsToFloat(depths[p]); }
#endif

// Pixel j of the row over what stands behind it.
vec4 seen(uint j, uint p) { return vec4(color[j], opaque[j]) + (1.0 - opaque[j]) * load(p); }

// Tile i_tile of the bin whose pairs are those of the range.
void draw_tile(uvec4 range, uint i_tile) {
    uint t = gl_LocalInvocationID.x;
    uvec2 tile = TILES_ACROSS * uvec2(range.z % push.n_bins_x, range.z / push.n_bins_x)
               + uvec2(i_tile % TILES_ACROSS, i_tile / TILES_ACROSS);
    uvec2 at = tile * uvec2(TILE_WIDTH, ROWS) + uvec2(RUN * (t / ROWS), t % ROWS);
    // Pixels beyond the picture's edge are composed as its last ones are, and not kept.
    uint row = min(at.y, push.height - 1u) * push.width;
    least = -push.cut;
    full = push.saturated;
#if THRESHOLD
    inv_threshold = push.inv_threshold;
#endif
    float y = push.tangents.y - (float(at.y) + 0.5) * push.pixel.y;
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        float x = (float(at.x + j) + 0.5) * push.pixel.x - push.tangents.x;
        uint p = row + min(at.x + j, push.width - 1u);
        x_of[j] = x;
#if ELLIPSOIDS
        vec3 ray = vec3(x, y, 1.0), upward = vec3(push.y_right, push.y_up, push.y_forward);
        float up = dot(upward, ray);
        vec3 rest = ray - up * upward;
        across[j] = dot(rest, rest);
        along[j] = up * up;
#else
        inv_norm[j] = 1.0 / (1.0 + x * x + y * y);
#endif
#if ROUNDS
        vec4 before = state[p];
        color[j] = before.xyz;
        opaque[j] = before.w;
#else
        color[j] = vec3(0.0);
        opaque[j] = 0.0;
#endif
#if BEHIND
        depth_of[j] = depth_at(p);
#endif
    }
    // These loops test at their ends, as do those within: llvmpipe goes through a loop once more,
    // with nothing to do, where the test comes first. Each has something to do at its first turn.
    uint first = range.x;
    bool is_done;
    do {
        uint n = 0;
        uvec2 pair;
        do {
            uint i = first + t;
            pair = pairs[min(i, range.y - 1u)];
            n = append(n, i < range.y && (pair.x >> (BIN_BITS + i_tile) & 1u) != 0, pair.y);
            first += INVOCATIONS;
        } while (first < range.y && n + INVOCATIONS <= MOST);
        wait_for_all();
        uint k = 0;
        do {
            compose_some(k, n, pair.y, y);
            k += INVOCATIONS;
        } while (k < n);
        wait_for_all();
        float most = 0.0;
        [[unroll]] for (uint j = 0; j < RUN; ++j) {
            most = max(most, 1.0 - opaque[j]);
        }
        is_done = all_agree(most < push.saturated) || first >= range.y;
    } while (!is_done);
#if ROUNDS
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        if (at.x + j < push.width && at.y < push.height) {
            state[row + at.x + j] = vec4(color[j], opaque[j]);
        }
    }
#endif
    [[unroll]] for (uint j = 0; j < RUN; j += TOGETHER) {
        if (at.x + j < push.width && at.y < push.height) {
            uint p = row + at.x + j;
            vec4 values[TOGETHER];
            [[unroll]] for (uint m = 0; m < TOGETHER; ++m) {
                values[m] = seen(j + m, p + m);
            }
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
