#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "medium.glsl"
#include "angle.glsl"

// Computes the light that the facets of surfaces and ground send out for the clouds (model.md §18,
// passes.md "diffusion").
// In: facets, optical depths [facet][light], lights, regions. Out: by facet place and area, normal,
// and radiosity, W/m^2.
// Law: K_d sum E f e^{-(1-g) tau}; lobes are left out. Bound: some ulp, and that of the depth.

layout(push_constant) uniform Push {
    uint n_facets;
    uint n_lights;
    // 1-g
    float backward;
} push;
READS(0, Facet, facets)
READS(1, Light, lights)
READS(2, float, depths)
TEXELS(3, regions)
#include "regions.glsl"
#include "sky.glsl"
WRITES(4, vec4, solids)

void main() {
    FOR_EACH(j, push.n_facets) {
        Facet facet = facets[j];
        vec3 irradiance = vec3(0.0);
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            float tau = depths[j * push.n_lights + l];
            float v = tau < BARRED_DEPTH ? through(vec3(push.backward * tau)).x : 0.0;
            vec3 n = facet.normal;
            irradiance += light.energy
                          * (light.kind == LIGHT_SKY
                                 ? share_of_sky(light, n, v)
                                 : vec3(share_of(light, arrival_at(light, facet.position), n, v)));
        }
        solids[3u * j] = vec4(facet.position, facet.area);
        solids[3u * j + 1u] = vec4(facet.normal, 0.0);
        solids[3u * j + 2u] = vec4(region_at(facet.i_region).kd * facet.color * irradiance, 0.0);
    }
}
