#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "functions.glsl"

// One facet a run of particles in Morton order (docs/model.md §5, §11). Means are taken about the
// first particle of the run, so that a run of one is that particle, to the bit.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { Grid grid; uint n_facets; uint i_first_facet; } push;
layout(std430, binding = 0) readonly buffer PlacedParticles { Placed placed[]; };
layout(std430, binding = 1) readonly buffer Particles { Particle particles[]; };
layout(std430, binding = 2) readonly buffer GroupOf { uint i_group[]; };
layout(std430, binding = 3) readonly buffer Groups { Group groups[]; };
layout(binding = 4) uniform samplerBuffer density;
// Particle of each place.
layout(std430, binding = 5) readonly buffer Order { uint order[]; };
layout(std430, binding = 6) readonly buffer Runs { Run runs[]; };
layout(std430, binding = 7) writeonly buffer Facets { Facet facets[]; };
// By particle.
layout(std430, binding = 8) writeonly buffer FacetOf { uint i_facet[]; };

#include "shell.glsl"

// What a run adds up to: by mass the position, sigma bar and count; by area the colour.
struct Sums { float mass; vec3 position; float sigma_mean; float area; vec3 color; vec3 plain_color; vec3 plain_position; float plain_sigma; };

float mass_of(uint i) {
    float sigma = placed[i].sigma;
    return particles[i].kappa * sigma * sigma * sigma * particles[i].aspect;
}

Sums sums_of(Run run, uint first, float sigma_first) {
    Sums s = Sums(0.0, vec3(0.0), 0.0, 0.0, vec3(0.0), vec3(0.0), vec3(0.0), 0.0);
    for (uint k = run.i_first; k < run.i_first + run.n_particles; ++k) {
        uint i = order[k];
        float m = mass_of(i), a = area_of(placed[i].sigma, particles[i].aspect, particles[i].kappa);
        vec3 p = placed[i].position - placed[first].position;
        vec3 c = particles[i].color - particles[first].color;
        float sigma = groups[i_group[i]].sigma_mean - sigma_first;
        s.mass += m;
        s.position += m * p;
        s.sigma_mean += m * sigma;
        s.area += a;
        s.color += a * c;
        s.plain_position += p;
        s.plain_sigma += sigma;
        s.plain_color += c;
    }
    return s;
}

// sigma_g^2 about the mean position: x, or of ellipsoids along x and z, and along y.
vec2 spread_of(Run run, vec3 p, bool by_mass) {
    vec2 sum = vec2(0.0);
    float weight = 0.0;
    for (uint k = run.i_first; k < run.i_first + run.n_particles; ++k) {
        uint i = order[k];
        float m = by_mass ? mass_of(i) : 1.0;
        float sigma = placed[i].sigma;
        vec3 d = placed[i].position - p;
#if ELLIPSOIDS
        float high = particles[i].aspect * sigma;
        sum += m * vec2(sigma * sigma + 0.5 * (d.x * d.x + d.z * d.z), high * high + d.y * d.y);
#else
        sum.x += m * (sigma * sigma + dot(d, d) * (1.0 / 3.0));
#endif
        weight += m;
    }
    return sum / weight;
}

void main() {
    FOR_EACH(g, push.n_facets) {
        Run run = runs[g];
        uint first = order[run.i_first];
        Group group = groups[i_group[first]];
        Sums s = sums_of(run, first, group.sigma_mean);
        float n_inverse = 1.0 / float(run.n_particles);
        // Without mass, or area, all count alike.
        bool by_mass = s.mass > 0.0, by_area = s.area > 0.0;
        vec3 p = placed[first].position + (by_mass ? s.position / s.mass : s.plain_position * n_inverse);
        float sigma_mean = group.sigma_mean + (by_mass ? s.sigma_mean / s.mass : s.plain_sigma * n_inverse);
        vec3 color = particles[first].color + (by_area ? s.color / s.area : s.plain_color * n_inverse);
        vec2 spread = run.n_particles > 1u ? sqrt(spread_of(run, p, by_mass)) : vec2(placed[first].sigma, 0.0);
        float sigma = spread.x;
#if ELLIPSOIDS
        float aspect = run.n_particles > 1u ? (sigma > 0.0 ? clamp(spread.y / sigma, LEAST_ASPECT, 1.0 / LEAST_ASPECT) : 1.0) : particles[first].aspect;
#else
        float aspect = 1.0;
#endif
        float scale = max(sigma, sigma_mean);
        vec3 n = normal_at(p, scale, aspect, group.cloud_center);
        uint facet = push.i_first_facet + g;
        facets[facet] = Facet(shell_at(p, scale, aspect, n), s.area, n, group.i_region, color, 0u);
        for (uint k = run.i_first; k < run.i_first + run.n_particles; ++k) {
            i_facet[order[k]] = facet;
        }
    }
}
