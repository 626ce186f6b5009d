#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"

// Facets as sources of the second reflection (docs/model.md §7, §11 "second"): what each sends diffusely, and by light the
// flux that its lobe reflects.

layout(local_size_x = 64) in;

const float INV_PI = 0.318309886183791;

layout(push_constant) uniform Push { uint n_facets; uint n_lights; } push;
layout(std430, binding = 0) readonly buffer Facets { Facet facets[]; };
layout(std430, binding = 1) readonly buffer Lights { Light lights[]; };
layout(std430, binding = 2) readonly buffer Shares { float shares[]; };
layout(std430, binding = 3) readonly buffer Regions { Region regions[]; };
// Facet of each place in the order of facets.
layout(std430, binding = 4) readonly buffer Order { uint order[]; };
// Source of each place.
layout(std430, binding = 5) readonly buffer Leaves { uint leaves[]; };
layout(std430, binding = 6) writeonly buffer Sources { Source sources[]; };
// [source][light]: sum of A g c and of A g, g the facet's share of the light's energy and c its own colour.
layout(std430, binding = 7) writeonly buffer Fluxes { vec4 fluxes[]; };

void main() {
    FOR_EACH(place, push.n_facets) {
        uint j = order[place];
        uint i = leaves[place];
        Facet facet = facets[j];
        Region region = regions[facet.i_region];
        vec3 irradiance = vec3(0.0);
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            Arrival a = arrival_at(light, facet.position);
            float g = share_of(light, a, facet.normal, shares[j * push.n_lights + l]);
            irradiance += light.energy * g;
            fluxes[i * push.n_lights + l] = facet.area * g * vec4(facet.color, 1.0);
        }
        vec3 half_diagonal = region.u / float(max(region.n_u, 1u)) + region.v / float(max(region.n_v, 1u));
        // A particle's facet is a disc.
        float radius = region.kind == REGION_SURFACE ? length(half_diagonal) : sqrt(facet.area * INV_PI);
        vec3 flux = facet.area * INV_PI * region.kd * facet.color * irradiance;
        sources[i] = Source(facet.position, radius, facet.normal, facet.area, flux, facet.area, 0.0, 0.0, 0.0, 0.0);
    }
}
