#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Positions relative to the lighting origin: placed = position + its group's offset (docs/model.md §11).

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { uint n_particles; } push;
layout(std430, binding = 0) readonly buffer Particles { Particle particles[]; };
layout(std430, binding = 1) readonly buffer GroupOf { uint i_group[]; };
layout(std430, binding = 2) readonly buffer Groups { Group groups[]; };
layout(std430, binding = 3) writeonly buffer PlacedParticles { Placed placed[]; };

void main() {
    FOR_EACH(i, push.n_particles) {
        placed[i] = Placed(particles[i].position + groups[i_group[i]].offset, particles[i].sigma);
    }
}
