#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "tiles.glsl"

// Deals the blocks of splats, near to far, to rounds of as many blocks as the pairs' buffer has
// room for (passes.md "tiles"). One invocation: there are a few hundred blocks.
// In: pairs of each block. Out: the rounds with their dispatch sizes. Exact: integers.

layout(local_size_x = 1) in;

layout(push_constant) uniform Push {
    uint n_rounds;
    uint capacity;
    uint most_blocks;
    uint sort_tile;
    uint bin_groups;
} push;
// In: pairs of each block. Out: pairs of the blocks before it in its round.
UPDATES(0, uint, n_pairs)
WRITES(1, Round, rounds)
READS(2, Kept, kept)

void close(uint k, uint first, uint end, uint n, bool is_last) {
    rounds[k].extent = uvec4((n + push.sort_tile - 1u) / push.sort_tile, 1, 1, n);
    rounds[k].blocks = uvec4(end - first, 1, 1, first);
    rounds[k].bins = uvec4(n > 0u ? push.bin_groups : 0u, 1, 1, uint(!is_last));
    rounds[k].tiles = uvec4(0, 0, 1, 0);
    rounds[k].alone = uvec4(0, 0, 1, 0);
}

void main() {
    uint n_blocks = (kept[0].sort.w + BLOCK - 1u) / BLOCK;
    uint k = 0, first = 0, n = 0;
    for (uint i = 0; i < n_blocks; ++i) {
        uint of_block = n_pairs[i];
        if (n + of_block > push.capacity || i - first == push.most_blocks) {
            close(k, first, i, n, false);
            ++k;
            first = i;
            n = 0;
        }
        n_pairs[i] = n;
        n += of_block;
    }
    close(k, first, n_blocks, n, true);
    for (++k; k < push.n_rounds; ++k) {
        close(k, 0, 0, 0, true);
    }
}
