#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "functions.glsl"

// Makes one lighting facet for each particle (model.md §5, passes.md "facets").
// In: placed particles, groups, the density grid (1/length). Out: facets with position, unit
// normal, area and colour.
// Law: the normal opposes the gradient of the smoothed density where that is well conditioned, else
// it points away from the cloud's centre. Source: C §2.4.

#include "shell.glsl"

void main() {
    FOR_EACH(i, push.n_facets) {
        Placed blob = PLACED_AT(i);
        Particle particle = PARTICLE_AT(i);
        vec3 p = blob.position;
        float sigma = blob.sigma;
        Group group = groups[i_group[i]];
        // Small blobs take the group's scale: on their own scale the normal is that of their
        // neighbours' noise, and they would show as specks.
        float scale = max(sigma, group.sigma_mean);
        Form form = form_of(particle);
        vec3 n = normal_at(p, scale, form, group.cloud_center);
        float area = area_of(sigma, form, particle.kappa);
        vec3 place = shell_at(p, scale, form, n);
        facets[push.i_first_facet + i] =
            Facet(place, area, n, group.i_region, particle.color, sigma);
    }
}
