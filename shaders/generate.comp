#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "philox.glsl"
#include "functions.glsl"

// P (1)-(11), Fig. 1 (docs/model.md §1): particles of boxes by bounded rejection.

layout(local_size_x = 64) in;

// Particles an invocation makes; src/passes/generate.rs says why that many.
const uint PER_INVOCATION = 16;

layout(push_constant) uniform Push { uint i_first; uint n_particles; uint max_attempts; } push;
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

// u1 to u4 of one attempt of particle i.
vec4 draw(Box b, uint i, uint attempt) {
    return uniforms(philox4x32_10(uvec2(b.seed, b.i_box), uvec4(i - b.i_first, attempt, 0, 0)));
}

// Attempts of the particles found so far, a byte each with the last one lowest: 16 fit.
const uint BYTE_OUTSIDE = 0x80u;

// The particles begin, begin + hop, ... below end, all of box b. First the search, one attempt a
// turn of whichever particle this invocation is at: a lucky one goes on to its next particle
// instead of waiting for its neighbours. Then the particles, from the attempts that were kept:
// computed twice, but stored without neighbours waiting.
void make(Box b, uint begin, uint end, uint hop) {
    vec3 h = 0.5 * b.extent;
    uvec4 found = uvec4(0);
    uint i = begin;
    uint attempt = 0;
    while (i < end) {
        vec3 v = offset_of(draw(b, i, attempt).xyz, b);
        bool inside = all(lessThanEqual(abs(v), h));
        ++attempt;
        bool done = inside || attempt >= push.max_attempts;
        uvec4 longer = found << 8 | uvec4(attempt | (inside ? 0u : BYTE_OUTSIDE), found.xyz >> 24);
        found = done ? longer : found;
        i += done ? hop : 0u;
        attempt = done ? 0u : attempt;
    }
    while (i > begin) {
        i -= hop;
        uint n_attempts = found.x & (BYTE_OUTSIDE - 1u);
        bool inside = (found.x & BYTE_OUTSIDE) == 0;
        found = found >> 8 | uvec4(found.yzw << 24, 0);
        vec4 u = draw(b, i, n_attempts - 1);
        vec3 v = offset_of(u.xyz, b);
        float r = u.w * b.radius_max;
        float radius = r + 0.5 * PI * sine(r);
        particles[i] = Particle(inside ? v : fold(v, h), b.sigma_factor * radius, vec3(1.0), b.kappa, 1.0, 0.0, vec2(0.0));
        status[i] = n_attempts | (inside ? 0u : 0x80000000u);
    }
}

void main() {
    uint n_chunk = gl_WorkGroupSize.x * PER_INVOCATION;
    uint run_end = push.i_first + push.n_particles;
    uint first = push.i_first + gl_WorkGroupID.x * n_chunk;
    for (uint chunk = first; chunk < run_end; chunk += gl_NumWorkGroups.x * n_chunk) {
        uint chunk_end = min(chunk + n_chunk, run_end);
        // Groups are runs of consecutive particles, so that a workgroup reads a box once and not
        // for each of them.
        uint last = i_group[chunk_end - 1];
        for (uint g = i_group[chunk]; g <= last; ++g) {
            Box b = boxes[g];
            if (b.form == FORM_GIVEN) {
                continue;
            }
            uint begin = max(chunk, b.i_first), end = min(chunk_end, b.i_first + b.n_particles);
            make(b, begin + gl_LocalInvocationID.x, end, gl_WorkGroupSize.x);
        }
    }
}
