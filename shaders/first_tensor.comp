#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"

// Computes T1, the first reflection by light and basis, without energies and materials
// (model.md §7, passes.md "contract").
// In: facets, lights, transmittance [facet][light], the table of basis functions. Out: T1
// [light][row], row = basis and facet; cleared Lit records. Source: C (13)-(16).

layout(push_constant) uniform Push {
    vec3 eye;
    uint n_facets;
    uint n_lights;
    uint n_bases;
    uint n_rows;
    uint i_vectors;
} push;
WRITES(5, Lit, lit)
// [light][row]
WRITES(6, float, t1)

#include "first.glsl"

void main() {
    FOR_EACH(j, push.n_facets) {
        Facet facet = facets[j];
        Region region = region_at(facet.i_region);
        vec3 outgoing = normalize(push.eye - facet.position);
        bool shines = dot(outgoing, facet.normal) > 0.0;
        uint n_vectors = region.i_lobe == NO_LOBE ? 0u : push.n_bases - 1u;
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            Arrival a = arrival_at(light, facet.position);
            float g = share_of(light, a, facet.normal, transmittance[j * push.n_lights + l]);
            uint row = l * push.n_rows + region.i_row + j - region.i_first_facet;
            t1[row] = g * INV_PI;
            Knot knot = knot_at(half_vector_gap(facet.normal, a.toward, outgoing));
            float glossy = shines && light.kind != LIGHT_SKY ? g : 0.0;
            for (uint b = 0u; b < n_vectors; ++b) {
                row += region.n_facets;
                t1[row] = glossy * value_at(push.i_vectors + b, knot);
            }
        }
        // `second` counts into these records and `contract` fills them.
        lit[j] = Lit(vec3(0.0), 0.0, vec3(0.0), 0.0, vec3(0.0), 0.0, vec3(0.0), 0.0);
    }
}
