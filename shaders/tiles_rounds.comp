#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "tiles.glsl"
#include "one_subgroup.glsl"

#ifndef INVOCATIONS
#define INVOCATIONS 8
#endif
#if ONE_SUBGROUP
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require
#else
#define SCANNED INVOCATIONS
#include "scan.glsl"
#endif

// Deals the blocks of splats, near to far, to rounds of as many blocks as the pairs' buffer has
// room for (passes.md "tiles"). One workgroup takes window after window of blocks, an invocation
// several consecutive ones.
// In: pairs of each block. Out: the rounds with their dispatch sizes. Exact: integers. Sums of
// pairs may wrap, but not up to the first block that has no room: a round's capacity and one block
// are less than 2^32 together. Only that block is looked for.

layout(local_size_x = INVOCATIONS) in;

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

// Consecutive blocks of an invocation.
const uint EACH = 16;
const uint WINDOW = EACH * INVOCATIONS;
const uint NONE = 0xffffffffu;

void close(uint k, uint first, uint end, uint n, bool is_last) {
    rounds[k].extent = uvec4((n + push.sort_tile - 1u) / push.sort_tile, 1, 1, n);
    rounds[k].blocks = uvec4(end - first, 1, 1, first);
    rounds[k].bins = uvec4(n > 0u ? push.bin_groups : 0u, 1, 1, uint(!is_last));
    rounds[k].tiles = uvec4(0, 0, 1, 0);
    rounds[k].alone = uvec4(0, 0, 1, 0);
}

// Returns the sum of the totals of the invocations before this one, and of all.
uvec2 sums_of(uint total) {
#if ONE_SUBGROUP
    uint t = lane(), sum = total;
    [[unroll]] for (uint reach = 1; reach < INVOCATIONS; reach *= 2) {
        uint left = subgroupShuffle(sum, max(t, reach) - reach);
        sum += t >= reach ? left : 0u;
    }
    return uvec2(sum - total, subgroupShuffle(sum, INVOCATIONS - 1u));
#else
    uint before = sum_before(total);
    uvec2 found = uvec2(before, sums[INVOCATIONS - 1u]);
    barrier();
    return found;
#endif
}

#if !ONE_SUBGROUP
shared uint least;
shared uint n_of_least;
#endif

// Returns the least of the invocations' blocks, or NONE, and its number of pairs. Blocks ascend
// with invocations.
uvec2 least_of(uint block, uint n) {
#if ONE_SUBGROUP
    uvec4 having = subgroupBallot(block != NONE);
    if (having == uvec4(0)) {
        return uvec2(NONE, 0);
    }
    uint at = subgroupBallotFindLSB(having);
    return uvec2(subgroupShuffle(block, at), subgroupShuffle(n, at));
#else
    if (lane() == 0u) {
        least = NONE;
    }
    barrier();
    atomicMin(least, block);
    barrier();
    if (block == least) {
        n_of_least = n;
    }
    barrier();
    uvec2 found = uvec2(least, n_of_least);
    barrier();
    return found;
#endif
}

void main() {
    uint t = lane();
    uint n_blocks = (kept[0].sort.w + BLOCK - 1u) / BLOCK;
    // The round, its first block, and its pairs so far.
    uint k = 0, first = 0, n = 0;
    for (uint window = 0; window < n_blocks; window += WINDOW) {
        uint i = window + EACH * t;
        uint of_block[EACH], before[EACH];
        uint total = 0;
        [[unroll]] for (uint j = 0; j < EACH; ++j) {
            // No load waits for a branch, so that all are under way at once.
            uint loaded = n_pairs[min(i + j, n_blocks - 1u)];
            of_block[j] = i + j < n_blocks ? loaded : 0u;
            total += of_block[j];
        }
        uvec2 found = sums_of(total);
        uint sum = n + found.x;
        [[unroll]] for (uint j = 0; j < EACH; ++j) {
            before[j] = sum;
            sum += of_block[j];
        }
        n += found.y;
        uvec2 end;
        // Every turn but the last ends a round. A round has one block at least.
        do {
            uint block = NONE, n_before = 0;
            [[unroll]] for (uint j = EACH; j-- > 0;) {
                bool is_full = before[j] + of_block[j] > push.capacity
                               || i + j - first >= push.most_blocks;
                if (is_full && i + j > first && i + j < n_blocks) {
                    block = i + j;
                    n_before = before[j];
                }
            }
            end = least_of(block, n_before);
            if (end.x != NONE) {
                if (t == 0u) {
                    close(k, first, end.x, end.y, false);
                }
                [[unroll]] for (uint j = 0; j < EACH; ++j) {
                    before[j] -= i + j >= end.x ? end.y : 0u;
                }
                ++k;
                first = end.x;
                n -= end.y;
            }
        } while (end.x != NONE);
        [[unroll]] for (uint j = 0; j < EACH; ++j) {
            if (i + j < n_blocks) {
                n_pairs[i + j] = before[j];
            }
        }
    }
    if (t == 0u) {
        close(k, first, n_blocks, n, true);
    }
    for (k += 1u + t; k < push.n_rounds; k += INVOCATIONS) {
        close(k, 0, 0, 0, true);
    }
}
