#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Facets of the ground, put where its origin is (docs/model.md §16).

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { uint n_facets; uint i_first_facet; } push;
layout(binding = 0) uniform usamplerBuffer regions;
#include "regions.glsl"
// Relative to their ground's origin.
layout(std430, binding = 1) readonly buffer Ground { Facet ground[]; };
layout(std430, binding = 2) writeonly buffer Facets { Facet facets[]; };

void main() {
    FOR_EACH(i, push.n_facets) {
        Facet facet = ground[i];
        facet.position += region_at(facet.i_region).center;
        facets[push.i_first_facet + i] = facet;
    }
}
