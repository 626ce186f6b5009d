#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "philox.glsl"
#include "functions.glsl"
#include "texture.glsl"

// Transforms waves to the pool's fields: an inverse DFT along rows, then along columns
// (passes.md "texture").
// In: Philox numbers by wave. Out: fields, of which 2t and 2t + 1 are the real and the imaginary
// part of one transform. A workgroup transforms one row or column of one level.

// The host asks for one subgroup, where barriers are cheap.
#ifndef WORKGROUP
#define WORKGROUP 32
#endif
layout(local_size_x = WORKGROUP) in;

layout(push_constant) uniform Push {
    uint seed;
    uint along_columns;
} push;
UPDATES(0, vec2, work)

const uint N_PAIRS = 4;
// Rows of all levels.
const uint N_ROWS = 504;
// |F| = AMPLITUDE |k|^-1.7: over all waves from |k| = 2 to 64 the sum of squares is 1.
const float AMPLITUDE = 0.6982250102949674;
const float HALF_SLOPE = 0.85;

shared vec2 values[2][TEXTURE_SIDE];
// e^{2 pi i j/N}, j < N/2.
shared vec2 roots[TEXTURE_SIDE / 2];

vec2 times(vec2 a, vec2 b) { return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x); }

// Returns F of field 2t at k, plus i times that of field 2t + 1.
vec2 wave(ivec2 k, uint pair, int most) {
    int square = k.x * k.x + k.y * k.y;
    if (square < 4 || square > most * most) {
        return vec2(0.0);
    }
    // F(-k) is the conjugate of F(k): one of the two is drawn.
    bool drawn = k.x > 0 || (k.x == 0 && k.y > 0);
    ivec2 of = drawn ? k : -k;
    uvec4 words = philox4x32_10(uvec2(push.seed, TEXTURE_STREAM), uvec4(of, pair, TEXTURE_STREAM));
    vec4 u = uniforms(words);
    float side = drawn ? 1.0 : -1.0;
    vec2 even = unit_at(u.x - 0.5) * vec2(1.0, side), odd = unit_at(u.y - 0.5) * vec2(1.0, side);
    return AMPLITUDE * exp2(-HALF_SLOPE * log2(float(square))) * (even + vec2(-odd.y, odd.x));
}

void main() {
    for (uint group = gl_WorkGroupID.x; group < N_PAIRS * N_ROWS; group += gl_NumWorkGroups.x) {
        uint pair = group / N_ROWS, i = group % N_ROWS;
        // Rows 512 - 2^(9 - l) and on belong to level l.
        uint level = 8u - uint(findMSB(511u - i));
        uint row = i - (512u - (512u >> level)), n = TEXTURE_SIDE >> level, half_n = n / 2u;
        uint first = pair * FIELD_TEXELS + level_offset(level);
        uint start = push.along_columns != 0u ? first + row : first + row * n;
        uint stride = push.along_columns != 0u ? n : 1u;
        barrier();
        for (uint x = gl_LocalInvocationID.x; x < n; x += gl_WorkGroupSize.x) {
            // Waves from n/2 on are the negative ones.
            ivec2 k = ivec2(x, row);
            k -= ivec2(greaterThanEqual(k, ivec2(half_n))) * int(n);
            values[0][x] =
                push.along_columns != 0u ? work[start + x * stride] : wave(k, pair, int(n / 4u));
        }
        for (uint j = gl_LocalInvocationID.x; j < half_n; j += gl_WorkGroupSize.x) {
            roots[j] = unit_at(float(j << level) * (1.0 / float(TEXTURE_SIDE)));
        }
        barrier();
        // Stockham's form: after the stage with m the transforms of length 2m lie m apart; at the
        // end they are in order.
        uint from = 0u;
        // Half of the rows have no wave: zeros stay zeros.
        bool empty = push.along_columns == 0u && min(row, n - row) > n / 4u;
        for (uint m = empty ? n : 1u; m < n; m *= 2u) {
            for (uint b = gl_LocalInvocationID.x; b < half_n; b += gl_WorkGroupSize.x) {
                uint k = b & (m - 1u), jm = b - k;
                vec2 p = values[from][b], q = values[from][b + half_n];
                values[1u - from][k + 2u * jm] = p + q;
                values[1u - from][k + 2u * jm + m] = times(roots[jm], p - q);
            }
            barrier();
            from = 1u - from;
        }
        for (uint x = gl_LocalInvocationID.x; x < n; x += gl_WorkGroupSize.x) {
            work[start + x * stride] = values[from][x];
        }
    }
}
