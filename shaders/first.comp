#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"

// The first reflection, C (15), in the diffuse basis (docs/model.md §7, §11).

layout(local_size_x = 64) in;

const float INV_PI = 0.318309886183791;

layout(push_constant) uniform Push { uint n_facets; uint n_lights; } push;
layout(std430, binding = 0) readonly buffer Facets { Facet facets[]; };
layout(std430, binding = 1) readonly buffer Lights { Light lights[]; };
layout(std430, binding = 2) readonly buffer Transmittance { float transmittance[]; };
layout(std430, binding = 3) readonly buffer Regions { Region regions[]; };
layout(std430, binding = 4) writeonly buffer LitFacets { Lit lit[]; };

void main() {
    FOR_EACH(j, push.n_facets) {
        Facet facet = facets[j];
        vec3 irradiance = vec3(0.0);
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            Arrival a = arrival_at(light, facet.position);
            irradiance += light.energy * share_of(light, a, facet.normal, transmittance[j * push.n_lights + l]);
        }
        vec3 albedo = regions[facet.i_region].kd * facet.color;
        lit[j] = Lit(irradiance, 0.0, vec3(0.0), 0.0, albedo * irradiance * INV_PI, 0.0, vec3(0.0), 0.0);
    }
}
