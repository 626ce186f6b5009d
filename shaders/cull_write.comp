#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "key.glsl"
#include "cull.glsl"
#include "each.glsl"

// The kept particles' sort keys, in their order, without gaps.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { vec3 forward; uint n_particles; float depth_high; float steps_per_depth; uint n_bits; } push;
layout(std430, binding = 0) readonly buffer PlacedParticles { Placed placed[]; };
layout(std430, binding = 1) readonly buffer Masks { uvec2 masks[]; };
// Kept ones of the tiles before.
layout(std430, binding = 2) readonly buffer Totals { uint n_before[]; };
// (key, particle)
layout(std430, binding = 3) writeonly buffer Entries { uvec2 entries[]; };

void main() {
    FOR_EACH(i, push.n_particles) {
        uvec2 mask = masks[i / 32u];
        uint bit = 1u << (i % 32u);
        if ((mask.x & bit) != 0u) {
            uint at = n_before[i / TILE] + mask.y + bitCount(mask.x & (bit - 1u));
            uint key = key_of(dot(push.forward, placed[i].position), push.n_bits, push.depth_high, push.steps_per_depth);
            entries[at] = uvec2(key, i);
        }
    }
}
