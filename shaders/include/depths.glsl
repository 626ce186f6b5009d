// The push constants of the kernels that make sort keys of particles, and the key of a particle.
// Needs records.glsl.

#include "key.glsl"
#include "particles.glsl"

layout(push_constant) uniform Push {
    // The camera's forward axis, or the eye.
    vec3 from;
    uint n_particles;
    float depth_high;
    float steps_per_depth;
    uint n_bits;
    // Distance of the eye from the lighting origin; negative where depths are view depths.
    float eye_distance;
} push;
TEXELS(0, placed)

uint key_at(uint i) {
    vec3 p = PLACED_AT(i).position;
    float z = dot(push.from, p);
    if (push.eye_distance >= 0.0) {
        // |p - e| - |e|, but small differences of great distances keep their accuracy.
        float sum = length(p - push.from) + push.eye_distance;
        z = dot(p, p - 2.0 * push.from) / max(sum, 1e-30);
    }
    return key_of(z, push.n_bits, push.depth_high, push.steps_per_depth);
}
