#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "each.glsl"
#include "upsample.glsl"

// Puts the blobs' smaller picture over the full one, a run of 4 N pixels of a row an invocation (docs/model.md §11
// "upsample").

layout(local_size_x = 64) in;

// Pixels of a run, and columns of small pixels that it has taps in.
const uint ACROSS = 4 * N;
const uint COLUMNS = 10;
// Pixels of the first texel that come before them.
const uint AHEAD = SHIFT % TEXEL_PIXELS;

#if BEHIND
// Texels of depth that hold the taps of a row.
const uint DEPTH_TEXELS = (SHIFT + COLUMNS + 3) / 4;

// Whether all taps of the run and all of its pixels are of one surface, as far as can be told at once.
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
    // Those beside the run's may come with it.
    [[unroll]] for (uint k = 0; k <= ACROSS; k += 4) {
        vec4 d = depths_of(texelFetch(depths, int(min(p + k, last) / 4)));
        low = min(low, d);
        high = max(high, d);
    }
    float least = min(min(low.x, low.y), min(low.z, low.w)), most = max(max(high.x, high.y), max(high.z, high.w));
    return most - least <= ALIKE * most;
}
#endif

void draw_run(uvec2 at) {
    // The first tap of the run's first pixel.
    uvec2 q = uvec2(push.offset_x, push.offset_y) + 2u * at;
    uvec2 first = q / (2u * N) - 2u;
    float t = float(q.y % (2u * N)) / float(2u * N);
    vec4 sums[COLUMNS];
    [[unroll]] for (uint c = 0; c < COLUMNS; ++c) {
        sums[c] = vec4(0.0);
    }
    [[dont_unroll]] for (uint r = 0; r < 6; ++r) {
        float w = weight(r, t);
        uint texel = ((first.y + r) * push.small_width + first.x) / TEXEL_PIXELS;
        [[unroll]] for (uint k = 0; k < AHEAD + COLUMNS; k += TEXEL_PIXELS) {
            uvec4 words = texelFetch(small, int(min(texel + k / TEXEL_PIXELS, push.last_texel)));
            [[unroll]] for (uint m = 0; m < TEXEL_PIXELS; ++m) {
                if (k + m >= AHEAD && k + m < AHEAD + COLUMNS) {
                    sums[k + m - AHEAD] += w * pixel_of(words, m);
                }
            }
        }
    }
    uint p = at.y * push.width + at.x;
    [[unroll]] for (uint i = 0; i < ACROSS; i += TOGETHER) {
        vec4 seen[TOGETHER];
        [[unroll]] for (uint m = 0; m < TOGETHER; ++m) {
            uint step = OFFSET_X + 2 * (i + m);
            seen[m] = vec4(0.0);
            [[unroll]] for (uint k = 0; k < 6; ++k) {
                seen[m] += weight(k, float(step % (2 * N)) / float(2 * N)) * sums[step / (2 * N) + k];
            }
        }
        if (at.x + i < push.width) {
            store_all(p + i, seen);
        }
    }
#if BEHIND
    // A loop, which devices that go through both sides of a branch leave at once.
    uint end = min(at.x + ACROSS, push.width);
    [[dont_unroll]] for (uint x = is_plain(first, at) ? end : at.x; x < end; ++x) {
        p = at.y * push.width + x;
        store(p, over(beside_edges(uvec2(x, at.y), p), p));
    }
#endif
}

void main() {
    FOR_EACH(run, push.n_runs * push.height) {
        draw_run(uvec2(ACROSS * (run % push.n_runs), run / push.n_runs));
    }
}
