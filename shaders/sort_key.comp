#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "key.glsl"
#include "each.glsl"

// Computes the sort keys of the drawn particles from their view depth relative to the lighting
// origin; ascending keys run far to near (docs/explanation/passes.md "sort").
// In: placed particles; the first ones of each group are drawn. Out: entries (key, particle) in
// ascending index. Error: one dot product.

layout(push_constant) uniform Push {
    vec3 forward;
    uint n_particles;
    float depth_high;
    float steps_per_depth;
    uint n_bits;
} push;
READS(0, Placed, placed)
READS(1, uint, i_group)
READS(2, Drawn, drawn)
// (key, particle)
WRITES(3, uvec2, entries)

void main() {
    FOR_EACH(i, push.n_particles) {
        uint key = key_of(
            dot(push.forward, placed[i].position), push.n_bits, push.depth_high,
            push.steps_per_depth
        );
        Drawn group = drawn[i_group[i]];
        if (i < group.end) {
            entries[i + group.shift] = uvec2(key, i);
        }
    }
}
