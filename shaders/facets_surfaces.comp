#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Makes the facets of the surfaces: each rectangle's grid, along u first, row by row along v
// (model.md §5, passes.md "facets").
// In: regions, the region of each facet. Out: facets with position, normal and area. Error: a few
// roundings of f32.

layout(push_constant) uniform Push { uint n_facets; } push;
TEXELS(0, regions)
#include "regions.glsl"
// Region of each facet.
READS(1, uint, i_region)
WRITES(2, Facet, facets)

void main() {
    FOR_EACH(j, push.n_facets) {
        Region region = region_at(i_region[j]);
        uint i = j - region.i_first_facet;
        vec2 at =
            vec2(2u * uvec2(i % region.n_u, i / region.n_u) + 1u) / vec2(region.n_u, region.n_v)
            - 1.0;
        vec3 u = region.u / float(region.n_u), v = region.v / float(region.n_v);
        vec3 position = region.center + at.x * region.u + at.y * region.v;
        float area = 4.0 * length(u) * length(v);
        facets[j] =
            Facet(position, area, region.normal, i_region[j], vec3(1.0), 0.0);
    }
}
