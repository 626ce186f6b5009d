#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "philox.glsl"
#include "functions.glsl"

// P (1)-(11), Fig. 1 (docs/model.md §1): particles of boxes by bounded rejection.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { uint n_particles; uint max_attempts; } push;
layout(std430, binding = 0) readonly buffer Boxes { Box boxes[]; };
layout(std430, binding = 1) readonly buffer GroupOf { uint i_group[]; };
layout(std430, binding = 2) writeonly buffer Particles { Particle particles[]; };
// Attempts made; bit 31 set where the particle was folded back.
layout(std430, binding = 3) writeonly buffer Status { uint status[]; };

// P (1)-(7): offset from the box's centre.
vec3 offset_of(vec3 u, Box b) {
    vec3 x = (b.form == FORM_PRINTED ? u : 2.0 * u - 1.0) * b.extent;
    float px = 0.5 * PI * sine(0.5 * x.y);
    float py = 0.5 * PI * sine(0.5 * x.x);
    float pz = 0.5 * PI * sine(0.5 * x.z);
    px += PI * sine(px * x.z * 0.5);
    py += PI * sine(px * x.z * 0.5);
    x += vec3(px, py, pz);
    return 0.5 * (b.form == FORM_PRINTED ? x.xzz : x);
}

// Mirrors v at +-h until it lies inside.
vec3 fold(vec3 v, vec3 h) {
    vec3 period = max(4.0 * h, vec3(1e-37));
    vec3 w = v + h;
    w -= period * floor(w / period);
    vec3 folded = mix(3.0 * h - w, w - h, lessThanEqual(w, 2.0 * h));
    // The quotient's rounding can leave w an ulp outside [0, 4h).
    return clamp(folded, -h, h);
}

void main() {
    uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    uint i = gl_GlobalInvocationID.x;
    uint attempt = 0;
    Box b;
    // One attempt a turn, of whichever particle this invocation is at: an invocation that is lucky goes on to its next
    // particle instead of waiting for its neighbours.
    while (i < push.n_particles) {
        if (attempt == 0) {
            b = boxes[i_group[i]];
            if (b.form == FORM_GIVEN) {
                i += stride;
                continue;
            }
        }
        vec4 u = uniforms(philox4x32_10(uvec2(b.seed, b.i_box), uvec4(i - b.i_first, attempt, 0, 0)));
        vec3 v = offset_of(u.xyz, b);
        vec3 h = 0.5 * b.extent;
        bool inside = all(lessThanEqual(abs(v), h));
        ++attempt;
        if (!inside && attempt < push.max_attempts) {
            continue;
        }
        float r = u.w * b.radius_max;
        float radius = r + 0.5 * PI * sine(r);
        vec3 position = inside ? v : fold(v, h);
        particles[i] = Particle(position, b.sigma_factor * radius, vec3(1.0), b.kappa);
        status[i] = attempt | (inside ? 0u : 0x80000000u);
        attempt = 0;
        i += stride;
    }
}
