#version 460
#extension GL_GOOGLE_include_directive : require
#include "sort.glsl"

// Digits of each tile: table[digit][tile].

layout(local_size_x = TILE_INVOCATIONS) in;

layout(std430, binding = 0) readonly buffer Entries { uvec2 entries[]; };
layout(std430, binding = 1) writeonly buffer Table { uint table[]; };

shared uint counts[N_DIGITS];

void main() {
    uint t = gl_LocalInvocationID.x;
    for (uint tile = gl_WorkGroupID.x; tile < push.n_tiles; tile += gl_NumWorkGroups.x) {
        for (uint d = t; d < N_DIGITS; d += TILE_INVOCATIONS) {
            counts[d] = 0;
        }
        barrier();
        for (uint j = 0; j < RUN; ++j) {
            uint i = tile * TILE + j * TILE_INVOCATIONS + t;
            if (i < push.n_entries) {
                atomicAdd(counts[digit_of(entries[i].x)], 1u);
            }
        }
        barrier();
        for (uint d = t; d < N_DIGITS; d += TILE_INVOCATIONS) {
            table[d * push.n_tiles + tile] = counts[d];
        }
        barrier();
    }
}
