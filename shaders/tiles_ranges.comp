#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "tiles.glsl"

// Finds each bin's range of sorted pairs and deals its tiles to workgroups
// (passes.md "tiles"). The order of the ranges does not matter: no two share a
// pixel. In: sorted pairs. Out: ranges (first pair, end, bin, tile bits), and the dispatch sizes of
// tiles.comp. Exact: integers.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    uint n_bins;
    uint i_round;
    uint max_groups;
    uint most_tiles;
} push;
// Pairs that a workgroup goes through, once for each of its tiles, 0.8 iterations of its loops a
// pair: llvmpipe ends loops after 65 535 iterations.
const uint MOST_PAIRS = 16384;

READS(0, uvec2, pairs)
UPDATES(1, Round, rounds)
// (first pair, end, bin, a bit for each tile of it)
WRITES(2, uvec4, ranges)

// Returns the first of n pairs whose bin is not below `bin`.
uint lower_bound(uint n, uint bin) {
    uint low = 0, high = n;
    while (low < high) {
        uint middle = (low + high) / 2;
        if ((pairs[middle].x & ((1u << BIN_BITS) - 1u)) < bin) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

void main() {
    const uint TILES = TILES_ACROSS * TILES_ACROSS;
    uint bin = gl_GlobalInvocationID.x;
    if (bin >= push.n_bins) {
        return;
    }
    uint n = rounds[push.i_round].extent.w;
    uint first = lower_bound(n, bin), end = lower_bound(n, bin + 1u);
    uint reached = 0;
    // By eights: llvmpipe ends all loops of an invocation after 65 535 iterations, and a bin may
    // have as many pairs.
    for (uint i = first; i < end; i += 8) {
        [[unroll]] for (uint k = 0; k < 8; ++k) {
            reached |= pairs[min(i + k, end - 1u)].x >> BIN_BITS;
        }
    }
    if (reached == 0) {
        return;
    }
    // As many tiles a workgroup as it has iterations for.
    uint most = clamp(MOST_PAIRS / (end - first), 1u, push.most_tiles);
    uint n_ranges = (bitCount(reached) + most - 1u) / most;
    uint before = atomicAdd(rounds[push.i_round].tiles.w, n_ranges);
    uint n_before = before;
    uint tiles = 0;
    [[unroll]] for (uint i = 0; i < TILES; ++i) {
        tiles |= reached & 1u << i;
        if (tiles != 0 && (bitCount(tiles) == most || i == TILES - 1u)) {
            ranges[n_before++] = uvec4(first, end, bin, tiles);
            tiles = 0;
        }
    }
    uvec2 groups =
        uvec2(min(n_before, push.max_groups), (n_before + push.max_groups - 1u) / push.max_groups);
    if (push.i_round == 0 && rounds[0].bins.w == 0) {
        atomicAdd(rounds[0].alone.w, n_ranges);
        atomicMax(rounds[0].alone.x, groups.x);
        atomicMax(rounds[0].alone.y, groups.y);
    } else {
        atomicMax(rounds[push.i_round].tiles.x, groups.x);
        atomicMax(rounds[push.i_round].tiles.y, groups.y);
    }
}
