#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "sort.glsl"
#include "sort_blocks.glsl"

// Scans each block of the table to an exclusive prefix sum that begins at the block's base
// (passes.md "sort"). Exact: integers.

UPDATES(1, uint, table)
READS(2, uint, bases)

void main() {
    uint n = n_counts(), n_blocks = n_blocks();
    for (uint block = gl_WorkGroupID.x; block < n_blocks; block += gl_NumWorkGroups.x) {
        uint first = first_of(block), total = 0;
        uint counts[COUNTS_EACH];
        for (uint j = 0; j < COUNTS_EACH; ++j) {
            counts[j] = first + j < n ? table[first + j] : 0u;
            total += counts[j];
        }
        uint before = bases[block] + sum_before(total);
        for (uint j = 0; j < COUNTS_EACH; ++j) {
            if (first + j < n) {
                table[first + j] = before;
            }
            before += counts[j];
        }
        barrier();
    }
}
