#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "variants.glsl"
#include "tiles.glsl"

// Writes a pair for every bin that a splat of this round can reach (passes.md
// "tiles"). In: splats and their rectangles of tiles. Out: pairs: the bin and, above its number, a
// bit for each of its tiles that the splat can reach; and the splat. In the order of splats. Bound:
// conservative; distances are widened by 2^-10.

layout(local_size_x = 256) in;

layout(push_constant) uniform Push {
    vec2 tangents;
    vec2 tile;
    uint n_bins_x;
    uint i_round;
    float cut;
    float inv_threshold;
    float least_cut;
} push;
READS(0, uvec2, reach)
READS(1, uint, n_before)
READS(2, uint, n_pairs)
READS(3, Round, rounds)
// A Splat is two texels.
TEXELS(5, splats)
WRITES(4, uvec2, pairs)
READS(6, Kept, kept)

// Returns a bit for each of a bin's four tiles along one axis that lies in [low, high).
uint within(uint low, uint high, uint bin) {
    int first = int(bin * TILES_ACROSS);
    uint from = uint(clamp(int(low) - first, 0, 4)), to = uint(clamp(int(high) - first, 0, 4));
    return (1u << to) - (1u << from);
}

// Returns the squared distances of c from four intervals of the given width, the first from `low`.
vec4 apart(float c, float low, float width) {
    vec4 at = low + width * vec4(0.0, 1.0, 2.0, 3.0);
    vec4 d = max(max(at - c, c - (at + width)), 0.0);
    return d * d;
}

// Returns a bit for each tile of the bin at `low` (slopes, y upward from the bin's last row) that
// is near enough to the splat. On the screen b^2/(2 sigma^2) is at least scale d^2/(1 + |ray|^2), d
// the distance in slopes.
uint near(vec2 center, float scale, float cut, vec2 low) {
    vec2 high = low + 4.0 * push.tile;
    vec2 far = max(abs(low), abs(high));
    // 2^-10 is far more than the rounding.
    float most = cut * (1.0 + 1.0 / 1024.0) * (1.0 + dot(far, far)) / scale;
    vec4 x = apart(center.x, low.x, push.tile.x), y = apart(center.y, low.y, push.tile.y);
    uint bits = 0;
    [[unroll]] for (uint j = 0; j < 4; ++j) {
        bvec4 is = lessThanEqual(x + y[3 - j], vec4(most));
        bits |= (uint(is.x) | uint(is.y) << 1 | uint(is.z) << 2 | uint(is.w) << 3) << (4 * j);
    }
    return bits;
}

void main() {
    uint block = rounds[push.i_round].blocks.w + gl_WorkGroupID.x;
    uint r = block * BLOCK + gl_LocalInvocationID.x;
    if (r >= kept[0].sort.w) {
        return;
    }
    uint at = n_pairs[block] + n_before[r];
    uvec2 low = reach[r] & 0xffffu, high = reach[r] >> 16;
    if (low.x == high.x) {
        return;
    }
    // center, scale and tau
    vec4 splat = uintBitsToFloat(TEXEL(splats, int(2 * r)));
    float cut = push.cut;
    if (THRESHOLD != 0) {
        cut = min(cut, max(log2(splat.w * push.inv_threshold), push.least_cut));
    }
    uvec2 first = low / TILES_ACROSS, last = (high - 1u) / TILES_ACROSS;
    uint n_x = last.x - first.x + 1u;
    uint n = n_x * (last.y - first.y + 1u);
    uvec2 bin = first;
    // At least one iteration, tested at the end as in tiles.comp.
    uint k = 0;
    do {
        uint columns = within(low.x, high.x, bin.x), rows = within(low.y, high.y, bin.y);
        // A bit for each of four rows, spread to the first bits of four groups of four.
        uint spread = (rows & 1u) | (rows & 2u) << 3 | (rows & 4u) << 6 | (rows & 8u) << 9;
        vec2 corner = vec2(
            float(4 * bin.x) * push.tile.x - push.tangents.x,
            push.tangents.y - float(4 * bin.y + 4) * push.tile.y
        );
        uint tiles = spread * columns;
        if (ELLIPSOIDS == 0) {
            // For ellipsoids the rectangle alone decides.
            tiles &= near(splat.xy, splat.z, cut, corner);
        }
        pairs[at + k] = uvec2(bin.y * push.n_bins_x + bin.x | tiles << BIN_BITS, r);
        bool wraps = bin.x == last.x;
        bin = wraps ? uvec2(first.x, bin.y + 1u) : uvec2(bin.x + 1u, bin.y);
    } while (++k < n);
}
