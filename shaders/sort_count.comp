#version 460
#extension GL_GOOGLE_include_directive : require
#include "sort.glsl"
#include "one_subgroup.glsl"

// Digits of each tile: table[digit][tile].

layout(local_size_x = TILE_INVOCATIONS) in;

layout(std430, binding = 1) readonly buffer Entries { uvec2 entries[]; };
layout(std430, binding = 2) writeonly buffer Table { uint table[]; };

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
