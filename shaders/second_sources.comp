#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "occlude.glsl"

// Facets as sources of the second reflection (docs/model.md §7, §11 "second"): what each sends diffusely, and by light the
// flux that its lobe reflects.

layout(local_size_x = 64) in;

// Points of a facet along each side, as transmit.comp has them.
const uint SHARE_SIDE = 4;
const float INV_PI = 0.318309886183791;

layout(push_constant) uniform Push { uint n_facets; uint n_lights; uint n_surfaces; } push;
layout(std430, binding = 0) readonly buffer Facets { Facet facets[]; };
layout(std430, binding = 1) readonly buffer Lights { Light lights[]; };
layout(std430, binding = 2) readonly buffer Shares { vec2 shares[]; };
layout(std430, binding = 3) readonly buffer Regions { Region regions[]; };
// Facet of each place in the order of facets.
layout(std430, binding = 4) readonly buffer Order { uint order[]; };
// Source of each place.
layout(std430, binding = 5) readonly buffer Leaves { uint leaves[]; };
layout(std430, binding = 6) writeonly buffer Sources { Source sources[]; };
// [source][light], w: sum of A g, g the facet's share of the light's energy; xyz: of a cloud sum of A g c, c the facet's own
// colour; of a surface's facet the share of it that the light reaches, what of it the clouds let through, and
// the surfaces whose shadows reach it.
layout(std430, binding = 7) writeonly buffer Fluxes { vec4 fluxes[]; };

#include "reach.glsl"

// A lamp's mean over the middles of the facet's 4 x 4 parts, as the shares are.
float mean_falloff(Light light, Facet facet, Region region) {
    vec3 u = region.u / float(region.n_u), v = region.v / float(region.n_v);
    float sum = 0.0;
    for (uint i = 0; i < SHARE_SIDE * SHARE_SIDE; ++i) {
        vec2 at = (vec2(i % SHARE_SIDE, i / SHARE_SIDE) + 0.5) * (2.0 / float(SHARE_SIDE)) - 1.0;
        Arrival a = arrival_at(light, facet.position + at.x * u + at.y * v);
        sum += share_of(light, a, facet.normal, 1.0);
    }
    return sum * (1.0 / float(SHARE_SIDE * SHARE_SIDE));
}

void main() {
    FOR_EACH(place, push.n_facets) {
        uint j = order[place];
        uint i = leaves[place];
        Facet facet = facets[j];
        Region region = regions[facet.i_region];
        vec3 half_diagonal = region.u / float(max(region.n_u, 1u)) + region.v / float(max(region.n_v, 1u));
        // A particle's facet is a disc.
        float radius = region.kind == REGION_SURFACE ? length(half_diagonal) : sqrt(facet.area * INV_PI);
        vec3 irradiance = vec3(0.0);
        bool in_part = false;
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            Arrival a = arrival_at(light, facet.position);
            vec2 share = shares[j * push.n_lights + l];
            float g = light.kind == LIGHT_POINT && region.kind == REGION_SURFACE
                ? share.x * share.y * mean_falloff(light, facet, region)
                : share_of(light, a, facet.normal, share.x * share.y);
            irradiance += light.energy * g;
            uint n_surfaces = region.kind == REGION_SURFACE ? push.n_surfaces : 0u;
            uint shadows = shadows_on(facet.position, radius, light, facet.i_region, n_surfaces, in_part);
            vec3 rest = region.kind == REGION_SURFACE ? vec3(share, float(shadows)) : facet.area * g * facet.color;
            fluxes[i * push.n_lights + l] = vec4(rest, facet.area * g);
        }
        vec3 flux = facet.area * INV_PI * region.kd * facet.color * irradiance;
        sources[i] = Source(facet.position, radius, facet.normal, facet.area, flux, facet.area, 0.0, in_part ? 1.0 : 0.0, 0.0, 0.0);
    }
}
