#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"

// Computes the first reflection toward the eye (model.md §7, passes.md "first").
// In: facets, lights, transmittance [facet][light], regions, the lobe table. Out: irradiance I_d
// and radiance L1 of every facet, linear RGB.
// Law: L1 = K_d c I_d/pi + K_s sum E f S(w). Source: C (15).

layout(push_constant) uniform Push {
    vec3 eye;
    uint n_facets;
    uint n_lights;
} push;
UPDATES(5, Lit, lit)

#include "first.glsl"

void main() {
    FOR_EACH(j, push.n_facets) {
        Facet facet = facets[j];
        Region region = region_at(facet.i_region);
        vec3 outgoing = normalize(push.eye - facet.position);
        // Only the front side has a lobe; a region without one needs no lookup.
        bool shines = region.i_lobe != NO_LOBE && dot(outgoing, facet.normal) > 0.0;
        uint n_shiny = shines ? 1u : 0u;
        vec3 irradiance = vec3(0.0);
        vec3 glossy = vec3(0.0);
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            Arrival a = arrival_at(light, facet.position);
            vec3 e = light.energy
                     * share_of(light, a, facet.normal, transmittance[j * push.n_lights + l]);
            irradiance += e;
            uint n_lobes = light.kind == LIGHT_SKY ? 0u : n_shiny;
            for (uint s = 0; s < n_lobes; ++s) {
                glossy += e * lobe_between(region.i_lobe, facet.normal, a.toward, outgoing);
            }
        }
        vec3 first = region.kd * facet.color * irradiance * INV_PI + region.ks * glossy;
        lit[j].direct = irradiance;
        lit[j].first = first;
    }
}
