// A full pixel's value from the blobs' smaller picture (passes.md "upsample").

// Full pixels along a side of a small one.
#ifndef N
#define N 2
#endif
// The remainders of the offset across by 2 N, and of the first tap's column by 4: the same for
// every run.
#ifndef OFFSET_X
#define OFFSET_X 1
#endif
#ifndef SHIFT
#define SHIFT 0
#endif

#include "buffers.glsl"
#define PICTURE 1
#include "pixels.glsl"

layout(push_constant) uniform Push {
    uint width;
    uint height;
    uint small_width;
    uint small_height;
    uint offset_x;
    uint offset_y;
    uint n_runs;
    uint n_pairs;
    uint last_texel;
} push;
TEXELS(0, small)

// Depths that differ by no more than this share of the nearer one belong to one surface.
const float ALIKE = 0.0625;

// Returns Lagrange's polynomial of degree five of tap k, at 2 + t of the taps 0 ... 5.
float weight(uint k, float t) {
    float w = 1.0;
    [[unroll]] for (int m = 0; m < 6; ++m) {
        w *= m == int(k) ? 1.0 : (2.0 + t - float(m)) / float(int(k) - m + int(m == int(k)));
    }
    return w;
}

#if BEHIND
// The surfaces' picture; near/z of the small pixels and of the full ones.
TEXELS(2, under)
TEXELS(3, small_depths)
TEXELS(4, depths)

vec4 small_depths_at(uint texel) {
    return depths_of(
        TEXEL(small_depths, int(min(texel, push.small_width * push.small_height / 4 - 1u)))
    );
}

// Stores pixel p alone.
void store(uint p, vec4 value) {
    uvec4 words = packed(value);
    [[unroll]] for (uint k = 0; k < PIXEL_WORDS; ++k) {
        uint i = PIXEL_WORDS * p + k;
#if FOURS
        picture[i / 4][i % 4] = words[k];
#else
        picture[i] = words[k];
#endif
    }
}

float depth_at(uint p) { return depths_of(TEXEL(depths, int(p / 4)))[p % 4]; }
#endif

// Composes the blobs' value `sum` over `behind`.
vec4 over_this(vec4 sum, vec4 behind) {
    vec4 blobs = vec4(max(sum.xyz, 0.0), clamp(sum.w, 0.0, 1.0));
    return blobs + (1.0 - blobs.w) * behind;
}

// The same for pixel p.
vec4 over(vec4 sum, uint p) {
#if BEHIND
    return over_this(sum, pixel_of(TEXEL(under, int(p / TEXEL_PIXELS)), p % TEXEL_PIXELS));
#else
    return over_this(sum, vec4(0.0));
#endif
}

// Composes and stores pixels p and on, TOGETHER of them.
void store_all(uint p, vec4 sums[TOGETHER]) {
#if BEHIND && FOURS
    uvec4 behind = TEXEL(under, int(p / TEXEL_PIXELS));
    [[unroll]] for (uint m = 0; m < TOGETHER; ++m) {
        sums[m] = over_this(sums[m], pixel_of(behind, m));
    }
#else
    [[unroll]] for (uint m = 0; m < TOGETHER; ++m) { sums[m] = over(sums[m], p + m); }
#endif
    store_together(p, sums);
}

#if BEHIND
// Returns the share by which two depths differ; 0 for depths of one surface.
float apart(float a, float b) {
    float nearer = max(a, b), by = abs(a - b);
    return by <= ALIKE * nearer ? 0.0 : by / nearer;
}

// Returns the taps' weights along an axis: of six, of the inner four, or of the inner two.
void weights(out float w[6], uint order, float t) {
    [[unroll]] for (uint k = 0; k < 6; ++k) { w[k] = weight(k, t); }
    if (order < 6) {
        w[0] = 0.0;
        w[5] = 0.0;
        bool four = order == 4;
        w[1] = four ? t * (t - 1.0) * (t - 2.0) * (-1.0 / 6.0) : 0.0;
        w[2] = four ? (t + 1.0) * (t - 1.0) * (t - 2.0) * 0.5 : 1.0 - t;
        w[3] = four ? (t + 1.0) * t * (t - 2.0) * -0.5 : t;
        w[4] = four ? (t + 1.0) * t * (t - 1.0) * (1.0 / 6.0) : 0.0;
    }
}

// Returns the blobs' value at a pixel some of whose taps may belong to other surfaces.
vec4 beside_edges(uvec2 pixel, uint p) {
    uvec2 q = uvec2(push.offset_x, push.offset_y) + 2u * pixel;
    uvec2 first = q / (2u * N) - 2u, rest = q % (2u * N);
    float depth = depth_at(p);
    bool six = true, four = true;
    float least = 2.0;
    int closest = 0;
    uint i_best = 0;
    [[dont_unroll]] for (uint k = 0; k < 36; ++k) {
        uvec2 tap = uvec2(k % 6, k / 6);
        uint i = (first.y + tap.y) * push.small_width + first.x + tap.x;
        float by = apart(small_depths_at(i / 4)[i % 4], depth);
        bool inner = all(greaterThanEqual(tap, uvec2(1))) && all(lessThanEqual(tap, uvec2(4)));
        six = six && by == 0.0;
        four = four && (by == 0.0 || !inner);
        ivec2 direction = int(2u * N) * (ivec2(tap) - 2) - ivec2(rest);
        int far = direction.x * direction.x + direction.y * direction.y;
        bool better = by < least || (by == least && far < closest);
        least = better ? by : least;
        closest = better ? far : closest;
        i_best = better ? i : i_best;
    }
    uint order = six ? 6 : (four ? 4 : 2);
    float wx[6], wy[6];
    weights(wx, order, float(rest.x) / float(2u * N));
    weights(wy, order, float(rest.y) / float(2u * N));
    vec4 sum = vec4(0.0);
    float total = 0.0;
    [[dont_unroll]] for (uint k = 0; k < 36; ++k) {
        uvec2 tap = uvec2(k % 6, k / 6);
        uint i = (first.y + tap.y) * push.small_width + first.x + tap.x;
        bool alike = order > 2 || apart(small_depths_at(i / 4)[i % 4], depth) == 0.0;
        float w = alike ? wx[tap.x] * wy[tap.y] : 0.0;
        total += w;
        sum += w * pixel_of(TEXEL(small, int(i / TEXEL_PIXELS)), i % TEXEL_PIXELS);
    }
    if (order > 2) {
        return sum;
    }
    vec4 nearest = pixel_of(TEXEL(small, int(i_best / TEXEL_PIXELS)), i_best % TEXEL_PIXELS);
    return total > 0.0 ? sum / total : nearest;
}
#endif
