#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "tiles.glsl"

// Where each bin's pairs lie among the sorted ones, and which bins have any. The order of those decides nothing: no two
// share a pixel.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { uint n_bins; uint i_round; uint max_groups; uint unused; } push;
layout(std430, binding = 0) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 1) buffer Rounds { Round rounds[]; };
// (first pair, end, bin)
layout(std430, binding = 2) writeonly buffer Ranges { uvec4 ranges[]; };

// The first of n pairs whose bin is not below `bin`.
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
    if (first < end) {
        uint before = atomicAdd(rounds[push.i_round].tiles.w, TILES);
        ranges[before / TILES] = uvec4(first, end, bin, 0);
        uvec2 groups = uvec2(min(before + TILES, push.max_groups), (before + TILES + push.max_groups - 1u) / push.max_groups);
        if (push.i_round == 0 && rounds[0].bins.w == 0) {
            atomicAdd(rounds[0].alone.w, TILES);
            atomicMax(rounds[0].alone.x, groups.x);
            atomicMax(rounds[0].alone.y, groups.y);
        } else {
            atomicMax(rounds[push.i_round].tiles.x, groups.x);
            atomicMax(rounds[push.i_round].tiles.y, groups.y);
        }
    }
}
