// The first reflection of a facet (model.md §7, passes.md "first"). Needs first.glsl and
// light.glsl, and ARRIVING(k): what arrives of light and facet k through clouds and past surfaces.
// With WITHOUT_SKY that of skies is left out.

#ifndef WITHOUT_SKY
#define WITHOUT_SKY 0
#endif

struct Reflected {
    vec3 irradiance;
    vec3 radiance;
};

// Returns the irradiance of facet j, and the radiance that it reflects toward the eye.
Reflected reflected_by(uint j, Facet facet, vec3 eye, uint n_lights) {
    Region region = region_at(facet.i_region);
    vec3 outgoing = normalize(eye - facet.position);
    // Only the front side has a lobe; a region without one needs no lookup.
    bool shines = region.i_lobe != NO_LOBE && dot(outgoing, facet.normal) > 0.0;
    uint n_shiny = shines ? 1u : 0u;
    vec3 irradiance = vec3(0.0);
    vec3 glossy = vec3(0.0);
    for (uint l = 0; l < n_lights; ++l) {
        Light light = lights[l];
        if (WITHOUT_SKY != 0 && light.kind == LIGHT_SKY) {
            continue;
        }
        Arrival a = arrival_at(light, facet.position);
        vec3 e = light.energy * share_of(light, a, facet.normal, ARRIVING(j * n_lights + l));
        irradiance += e;
        uint n_lobes = light.kind == LIGHT_SKY ? 0u : n_shiny;
        for (uint s = 0; s < n_lobes; ++s) {
            glossy += e * lobe_between(region.i_lobe, facet.normal, a.toward, outgoing);
        }
    }
    return Reflected(
        irradiance, region.kd * facet.color * irradiance * INV_PI + region.ks * glossy
    );
}
