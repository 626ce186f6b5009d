#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "sort.glsl"
#define SCANNED N_DIGITS
#include "scan.glsl"

// Scans table[digit][tile] to an exclusive prefix sum in one workgroup, an invocation a digit
// (passes.md "sort"). Exact: integers.

layout(local_size_x = 1 << DIGIT_BITS) in;

UPDATES(1, uint, table)

void main() {
    uint n_tiles = n_tiles();
    uint d = gl_LocalInvocationID.x;
    uint row = d * n_tiles;
    uint total = 0;
    for (uint tile = 0; tile < n_tiles; ++tile) {
        total += table[row + tile];
    }
    uint before = sum_before(total);
    for (uint tile = 0; tile < n_tiles; ++tile) {
        uint count = table[row + tile];
        table[row + tile] = before;
        before += count;
    }
}
