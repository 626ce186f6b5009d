#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "functions.glsl"

// One facet a particle (docs/model.md §5, §11): normal from the gradient of the smoothed density where that is well
// conditioned, else away from the cloud's centre.

layout(local_size_x = 64) in;

const float SHELL_SIGMA = 1.5;
// Radius of the quadrature's sphere: 14 points at sqrt(5) s integrate a Gaussian of standard deviation s, here 2 sigma, to
// degree 5.
const float SMOOTH_SIGMA = 4.47213595499958;
const float CONDITION_LOW = 0.02;
const float CONDITION_HIGH = 0.10;
const float SQRT_TAU = 2.50662827463;

layout(push_constant) uniform Push { Grid grid; uint n_particles; uint i_first_facet; } push;
layout(std430, binding = 0) readonly buffer PlacedParticles { Placed placed[]; };
layout(std430, binding = 1) readonly buffer Particles { Particle particles[]; };
layout(std430, binding = 2) readonly buffer GroupOf { uint i_group[]; };
layout(std430, binding = 3) readonly buffer Groups { Group groups[]; };
layout(std430, binding = 4) readonly buffer Density { float density[]; };
layout(std430, binding = 5) writeonly buffer Facets { Facet facets[]; };

#include "density.glsl"

vec3 unit_or(vec3 v, vec3 otherwise) {
    float l = length(v);
    return l > 1e-30 ? v / l : otherwise;
}

void main() {
    FOR_EACH(i, push.n_particles) {
        vec3 p = placed[i].position;
        float sigma = placed[i].sigma;
        Group group = groups[i_group[i]];
        // The light on a small blob is that of the blobs it lies among: on its own scale it would be a speck.
        float scale = max(sigma, group.sigma_mean);
        vec3 gradient = vec3(0.0);
        float sum = 0.0;
        // A quadrature of degree 5 on the sphere: 6 axes and 8 diagonals.
        for (int k = 0; k < 14; ++k) {
            vec3 d;
            float w;
            if (k < 6) {
                d = vec3(0.0);
                d[k >> 1] = (k & 1) == 0 ? 1.0 : -1.0;
                w = 1.0 / 15.0;
            } else {
                d = vec3((k & 1) == 0 ? 1.0 : -1.0, (k & 2) == 0 ? 1.0 : -1.0, k < 10 ? 1.0 : -1.0) * 0.57735026919;
                w = 3.0 / 40.0;
            }
            float rho = w * density_at(p + SMOOTH_SIGMA * scale * d);
            gradient += rho * d;
            sum += rho;
        }
        float slope = length(gradient);
        float condition = sum > 0.0 ? slope / sum : 0.0;
        vec3 outward = unit_or(p - group.cloud_center, vec3(0.0, 1.0, 0.0));
        float t = smoothstep(CONDITION_LOW, CONDITION_HIGH, condition);
        vec3 n = t > 0.0 ? unit_or(t * (-gradient / slope) + (1.0 - t) * outward, outward) : outward;
        float radius = 3.0 * sigma;
        float opacity = one_minus_exp(SQRT_TAU * particles[i].kappa * sigma);
        facets[push.i_first_facet + i] =
            Facet(p + SHELL_SIGMA * scale * n, PI * radius * radius * opacity, n, group.i_region, particles[i].color, 0u);
    }
}
