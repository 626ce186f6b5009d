#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "functions.glsl"

// Positions relative to the lighting origin: position, as it has grown, + its group's offset + the
// gusts' displacement (docs/model.md §11 to §13).

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { uint n_particles; } push;
layout(std430, binding = 0) readonly buffer Particles { Particle particles[]; };
layout(std430, binding = 1) readonly buffer GroupOf { uint i_group[]; };
layout(std430, binding = 2) readonly buffer Groups { Group groups[]; };
layout(std430, binding = 3) readonly buffer Modes { Mode modes[]; };
layout(std430, binding = 4) writeonly buffer PlacedParticles { Placed placed[]; };

void main() {
    FOR_EACH(i, push.n_particles) {
        Group group = groups[i_group[i]];
        vec3 rest = particles[i].position * group.scale;
        vec3 x = rest + group.center;
        vec3 d = vec3(0.0);
        for (uint m = group.i_mode; m < group.i_mode + group.n_modes; ++m) {
            d += modes[m].a * sine(dot(modes[m].k, x) + modes[m].phase);
        }
        placed[i] = Placed(rest + group.offset + d, particles[i].sigma * group.scale);
    }
}
