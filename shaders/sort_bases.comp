#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "sort.glsl"
#include "sort_blocks.glsl"

// Scans the sums of blocks to an exclusive prefix sum in one workgroup (passes.md "sort"). There
// are 32 sums an invocation where 64 million entries are sorted. Exact: integers.

UPDATES(1, uint, block_sums)

void main() {
    uint n_blocks = n_blocks();
    uint n_each = (n_blocks + INVOCATIONS - 1) / INVOCATIONS;
    uint first = gl_LocalInvocationID.x * n_each, end = min(first + n_each, n_blocks);
    uint total = 0;
    for (uint i = first; i < end; ++i) {
        total += block_sums[i];
    }
    uint before = sum_before(total);
    for (uint i = first; i < end; ++i) {
        uint sum = block_sums[i];
        block_sums[i] = before;
        before += sum;
    }
}
