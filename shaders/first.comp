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
#define ARRIVING(k) transmittance[k]
#include "reflect.glsl"

void main() {
    FOR_EACH(j, push.n_facets) {
        Reflected r = reflected_by(j, facets[j], push.eye, push.n_lights);
        lit[j].direct = r.irradiance;
        lit[j].first = r.radiance;
    }
}
