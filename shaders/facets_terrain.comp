#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Moves the ground's facets to the place of the ground's origin (model.md §16).
// In: facets relative to the origin. Out: facets relative to the lighting origin. Error: one
// rounding.

layout(push_constant) uniform Push {
    uint n_facets;
    uint i_first_facet;
} push;
TEXELS(0, regions)
#include "regions.glsl"
// Facets relative to their ground's origin.
READS(1, Facet, ground)
WRITES(2, Facet, facets)

void main() {
    FOR_EACH(i, push.n_facets) {
        Facet facet = ground[i];
        facet.position += region_at(facet.i_region).center;
        facets[push.i_first_facet + i] = facet;
    }
}
