// The push constants of the kernels that make sort keys of particles, and the key of a particle.
// Needs records.glsl.

#include "key.glsl"

layout(push_constant) uniform Push {
    vec3 forward;
    uint n_particles;
    float depth_high;
    float steps_per_depth;
    uint n_bits;
} push;
READS(0, Placed, placed)

uint key_at(uint i) {
    return key_of(
        dot(push.forward, placed[i].position), push.n_bits, push.depth_high, push.steps_per_depth
    );
}
