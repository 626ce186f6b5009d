#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "each.glsl"
#include "upsample.glsl"

// Puts the blobs' smaller picture over the full one (passes.md "upsample").
// In: the small picture; with surfaces their picture and both depths. Out: the full picture. An
// invocation draws a run of 4 N pixels of two rows, which have their taps in the same six rows of
// small pixels.
// Law: Lagrange polynomials of degree five; lower degrees beside edges of depth.

// Pixels of a run, and columns of small pixels that it has taps in.
const uint ACROSS = 4 * N;
const uint COLUMNS = 10;
const uint ROWS = 2;
// Pixels of the first texel that come before the first tap.
const uint AHEAD = SHIFT % TEXEL_PIXELS;

#if BEHIND
// Texels of depth that hold the taps of a row.
const uint DEPTH_TEXELS = (SHIFT + COLUMNS + 3) / 4;

// Whether all taps and all pixels of the run belong to one surface, by a test that may say no too
// often.
bool is_plain(uvec2 first, uvec2 at) {
    vec4 low = vec4(1.0), high = vec4(0.0);
    [[dont_unroll]] for (uint r = 0; r < 6; ++r) {
        uint texel = ((first.y + r) * push.small_width + first.x) / 4;
        [[unroll]] for (uint k = 0; k < DEPTH_TEXELS; ++k) {
            vec4 d = small_depths_at(texel + k);
            low = min(low, d);
            high = max(high, d);
        }
    }
    uint p = at.y * push.width + at.x, last = push.width * push.height - 1u;
    // Pixels beside the run may share its texels.
    [[unroll]] for (uint k = 0; k <= ACROSS; k += 4) {
        vec4 d = depths_of(TEXEL(depths, int(min(p + k, last) / 4)));
        low = min(low, d);
        high = max(high, d);
    }
    float least = min(min(low.x, low.y), min(low.z, low.w)),
          most = max(max(high.x, high.y), max(high.z, high.w));
    return most - least <= ALIKE * most;
}
#endif

// Draws pixels (x, y) and on from the small columns' `sums`.
void draw_run(uint x, uint y, vec4 sums[COLUMNS]) {
    uint p = y * push.width + x;
    [[unroll]] for (uint i = 0; i < ACROSS; i += TOGETHER) {
        vec4 seen[TOGETHER];
        [[unroll]] for (uint m = 0; m < TOGETHER; ++m) {
            uint step = OFFSET_X + 2 * (i + m);
            seen[m] = vec4(0.0);
            [[unroll]] for (uint k = 0; k < 6; ++k) {
                seen[m] +=
                    weight(k, float(step % (2 * N)) / float(2 * N)) * sums[step / (2 * N) + k];
            }
        }
        if (x + i < push.width && y < push.height) {
            store_all(p + i, seen);
        }
    }
}

#if BEHIND
// Draws those pixels of the run again that may lie beside an edge of depth.
void draw_edges(uint x, uint y, uvec2 first) {
    // A loop in place of a condition: devices that run both sides of a condition leave it at once.
    uint end = y < push.height && !is_plain(first, uvec2(x, y)) ? min(x + ACROSS, push.width) : x;
    [[dont_unroll]] for (uint at = x; at < end; ++at) {
        uint p = y * push.width + at;
        store(p, over(beside_edges(uvec2(at, y), p), p));
    }
}
#endif

// Draws two rows that lie between the same small ones: o + 2 y is 4 i, or one more, and that plus
// two.
void draw_pair(uint x, uint i) {
    uint q = 4u * i + (push.offset_y & 1u);
    uvec2 first = uvec2(push.offset_x + 2u * x, q) / (2u * N) - 2u;
    vec4 sums[ROWS][COLUMNS];
    float t[ROWS];
    [[unroll]] for (uint j = 0; j < ROWS; ++j) {
        t[j] = float((q + 2u * j) % (2u * N)) / float(2u * N);
        [[unroll]] for (uint c = 0; c < COLUMNS; ++c) { sums[j][c] = vec4(0.0); }
    }
    [[unroll]] for (uint r = 0; r < 6; ++r) {
        float w[ROWS];
        [[unroll]] for (uint j = 0; j < ROWS; ++j) { w[j] = weight(r, t[j]); }
        uint texel = ((first.y + r) * push.small_width + first.x) / TEXEL_PIXELS;
        [[unroll]] for (uint k = 0; k < AHEAD + COLUMNS; k += TEXEL_PIXELS) {
            uvec4 words = TEXEL(small, int(min(texel + k / TEXEL_PIXELS, push.last_texel)));
            [[unroll]] for (uint m = 0; m < TEXEL_PIXELS; ++m) {
                if (k + m >= AHEAD && k + m < AHEAD + COLUMNS) {
                    vec4 value = pixel_of(words, m);
                    [[unroll]] for (uint j = 0; j < ROWS; ++j) {
                        sums[j][k + m - AHEAD] += w[j] * value;
                    }
                }
            }
        }
    }
    // The pair may reach above the first row or below the last: y is then huge, or the height.
    uint y = 2u * i - push.offset_y / 2u;
    [[unroll]] for (uint j = 0; j < ROWS; ++j) { draw_run(x, y + j, sums[j]); }
#if BEHIND
    uint j = 0;
    [[dont_unroll]] do { draw_edges(x, y + j, first); } while (++j < ROWS);
#endif
}

void main() {
    FOR_EACH(run, push.n_runs * push.n_pairs) {
        draw_pair(ACROSS * (run % push.n_runs), push.offset_y / 4u + run / push.n_runs);
    }
}
