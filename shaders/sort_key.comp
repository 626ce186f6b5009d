#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "key.glsl"
#include "each.glsl"

// Sort keys of the drawn particles from view depth relative to the lighting origin; far to near is
// ascending (docs/model.md §11). They are the first of each group, and keep their order.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { vec3 forward; uint n_particles; float depth_high; float steps_per_depth; uint n_bits; } push;
layout(std430, binding = 0) readonly buffer PlacedParticles { Placed placed[]; };
layout(std430, binding = 1) readonly buffer GroupOf { uint i_group[]; };
layout(std430, binding = 2) readonly buffer DrawnGroups { Drawn drawn[]; };
// (key, particle)
layout(std430, binding = 3) writeonly buffer Entries { uvec2 entries[]; };

void main() {
    FOR_EACH(i, push.n_particles) {
        uint key = key_of(dot(push.forward, placed[i].position), push.n_bits, push.depth_high, push.steps_per_depth);
        Drawn group = drawn[i_group[i]];
        if (i < group.end) {
            entries[i + group.shift] = uvec2(key, i);
        }
    }
}
