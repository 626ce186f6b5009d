#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "functions.glsl"

// One facet a particle (docs/model.md §5, §11): normal from the gradient of the smoothed density
// where that is well conditioned, else away from the cloud's centre.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { Grid grid; uint n_particles; uint i_first_facet; } push;
layout(std430, binding = 0) readonly buffer PlacedParticles { Placed placed[]; };
layout(std430, binding = 1) readonly buffer Particles { Particle particles[]; };
layout(std430, binding = 2) readonly buffer GroupOf { uint i_group[]; };
layout(std430, binding = 3) readonly buffer Groups { Group groups[]; };
layout(binding = 4) uniform samplerBuffer density;
layout(std430, binding = 5) writeonly buffer Facets { Facet facets[]; };

#include "shell.glsl"

void main() {
    FOR_EACH(i, push.n_particles) {
        vec3 p = placed[i].position;
        float sigma = placed[i].sigma;
        Group group = groups[i_group[i]];
        // The light on a small blob is that of the blobs it lies among: on its own scale it would
        // be a speck.
        float scale = max(sigma, group.sigma_mean);
        float aspect = particles[i].aspect;
        vec3 n = normal_at(p, scale, aspect, group.cloud_center);
        float area = area_of(sigma, aspect, particles[i].kappa);
        facets[push.i_first_facet + i] =
            Facet(shell_at(p, scale, aspect, n), area, n, group.i_region, particles[i].color, 0u);
    }
}
