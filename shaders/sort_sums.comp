#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "sort.glsl"
#include "sort_blocks.glsl"

// Sums each block of the table (passes.md "sort"). In: table[digit][tile]. Out: a sum a block.
// Exact: integers.

READS(1, uint, table)
WRITES(2, uint, block_sums)

void main() {
    uint n = n_counts(), n_blocks = n_blocks();
    for (uint block = gl_WorkGroupID.x; block < n_blocks; block += gl_NumWorkGroups.x) {
        uint first = first_of(block), total = 0;
        for (uint j = 0; j < COUNTS_EACH; ++j) {
            total += first + j < n ? table[first + j] : 0u;
        }
        uint before = sum_before(total);
        if (gl_LocalInvocationID.x == INVOCATIONS - 1) {
            block_sums[block] = before + total;
        }
        barrier();
    }
}
