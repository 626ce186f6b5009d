#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "sort.glsl"
#include "one_subgroup.glsl"

// Counts the digits of each tile's keys (passes.md "sort"). In: entries (key,
// value). Out: table[digit][tile]. Exact: integers.

layout(local_size_x = TILE_INVOCATIONS) in;

READS(1, uvec2, entries)
WRITES(2, uint, table)

shared uint counts[N_DIGITS];

void main() {
    uint n = n_entries(), n_tiles = n_tiles();
    uint t = gl_LocalInvocationID.x;
    for (uint tile = gl_WorkGroupID.x; tile < n_tiles; tile += gl_NumWorkGroups.x) {
        for (uint d = t; d < N_DIGITS; d += TILE_INVOCATIONS) {
            counts[d] = 0;
        }
        wait_for_all();
        for (uint j = 0; j < RUN; ++j) {
            uint i = tile * TILE + j * TILE_INVOCATIONS + t;
            if (i < n) {
                atomicAdd(counts[digit_of(entries[i].x)], 1u);
            }
        }
        wait_for_all();
        for (uint d = t; d < N_DIGITS; d += TILE_INVOCATIONS) {
            table[d * n_tiles + tile] = counts[d];
        }
        wait_for_all();
    }
}
