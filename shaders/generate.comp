#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "philox.glsl"
#include "functions.glsl"

// Generates the particles of boxes by bounded rejection (model.md §1, passes.md
// "generate"). In: boxes, the group of each particle. Out: particles relative to their box's
// centre, and the attempts that each took. Law and source: P (1)-(11), Fig. 1. Philox4x32-10 gives
// each attempt's numbers from (seed, box, particle, attempt). Bound: positions lie in the box;
// after max_attempts the last offset is folded into it.

layout(local_size_x = 64) in;

// Particles an invocation makes; src/passes/generate.rs derives the number.
const uint PER_INVOCATION = 16;

layout(push_constant) uniform Push {
    uint i_first;
    uint n_particles;
    uint max_attempts;
} push;
READS(0, Box, boxes)
READS(1, uint, i_group)
TEXEL_STORES(2, particles)
// Attempts made; bit 31 is set where the particle was folded.
WRITES(3, uint, status)

// Returns the offset from the box's centre, P (1)-(7).
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

// Returns u1 to u4 of one attempt of particle i.
vec4 draw(Box b, uint i, uint attempt) {
    return uniforms(philox4x32_10(uvec2(b.seed, b.i_box), uvec4(i - b.i_first, attempt, 0, 0)));
}

// Attempts of the particles found so far, one byte each with the last one lowest: 16 fit.
const uint BYTE_OUTSIDE = 0x80u;

// Makes the particles begin, begin + hop, ... below end, all of box b.
// The first loop searches: each iteration makes one attempt for the invocation's current particle,
// so that an invocation goes on to its next particle without waiting for its neighbours. The second
// loop computes the particles of the kept attempts again and stores them.
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
        STORE_BALL(i, inside ? v : fold(v, h), b.sigma_factor * radius, b.kappa);
        status[i] = n_attempts | (inside ? 0u : 0x80000000u);
    }
}

void main() {
    uint n_chunk = gl_WorkGroupSize.x * PER_INVOCATION;
    uint run_end = push.i_first + push.n_particles;
    uint first = push.i_first + gl_WorkGroupID.x * n_chunk;
    for (uint chunk = first; chunk < run_end; chunk += gl_NumWorkGroups.x * n_chunk) {
        uint chunk_end = min(chunk + n_chunk, run_end);
        // Groups are runs of consecutive particles, so a workgroup reads each box once.
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
