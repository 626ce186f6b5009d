#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// The first reflection, C (15), in the diffuse basis (docs/model.md §7, §11).

layout(local_size_x = 64) in;

const float INV_PI = 0.318309886183791;

layout(push_constant) uniform Push { uint n_facets; uint n_lights; } push;
layout(std430, binding = 0) readonly buffer Facets { Facet facets[]; };
layout(std430, binding = 1) readonly buffer Lights { Light lights[]; };
layout(std430, binding = 2) readonly buffer Transmittance { float transmittance[]; };
layout(std430, binding = 3) readonly buffer Particles { Particle particles[]; };
layout(std430, binding = 4) readonly buffer GroupOf { uint i_group[]; };
layout(std430, binding = 5) readonly buffer Groups { Group groups[]; };
layout(std430, binding = 6) writeonly buffer LitFacets { Lit lit[]; };

void main() {
    FOR_EACH(j, push.n_facets) {
        vec3 n = facets[j].normal;
        vec3 irradiance = vec3(0.0);
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            float v = transmittance[j * push.n_lights + l];
            float cosine = dot(n, light.toward);
            float share = light.kind == LIGHT_SKY ? v * (0.5 + 0.5 * cosine) + light.constant : v * max(cosine, 0.0);
            irradiance += light.irradiance * share;
        }
        vec3 albedo = groups[i_group[j]].kd * particles[j].color;
        lit[j] = Lit(vec4(irradiance, 0.0), vec4(albedo * irradiance * INV_PI, 0.0));
    }
}
