#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "occlude.glsl"
#include "cell_samples.glsl"
#include "iterations.glsl"

// Makes facets the sources of the second reflection (model.md §7, passes.md "second").
// In: facets, lights, transmittance, regions. Out: what each facet sends diffusely, and by light
// the flux that its lobe reflects and the light at its 4 x 4 points.
// Law: Lambda of passes.md "second". Bound: points are kept in 16 bits of their greatest.

const float INV_PI = 0.318309886183791;

layout(push_constant) uniform Push {
    uint n_facets;
    uint n_lights;
    uint n_surfaces;
} push;
READS(0, Facet, facets)
READS(1, Light, lights)
// [facet][light], and the clouds' share of it.
READS(2, float, transmittance)
READS(3, float, through)
TEXELS(4, regions)
#include "regions.glsl"
// Facet of each place in the order of facets.
READS(5, uint, order)
// Source of each place.
READS(6, uint, leaves)
WRITES(7, Source, sources)
// [source][light]. w: sum of A g, g the facet's share of the light's energy.
// xyz of a cloud's: sum of A g c, c the facet's own colour.
// xyz of a surface's: A times the greatest share at a point, the clouds' transmittance, and the
// mask of surfaces whose shadows reach the facet.
WRITES(8, vec4, fluxes)
// [source][light] of surfaces' facets: the shares at the points over the greatest.
WRITES(9, Packed, cell_samples)

#include "reach.glsl"
#include "arriving.glsl"

float greatest(CellSamples s) {
    vec4 m = max(max(s.a, s.b), max(s.c, s.d));
    return max(max(m.x, m.y), max(m.z, m.w));
}

void main() {
    FOR_EACH(place, push.n_facets) {
        uint j = order[place];
        uint i = leaves[place];
        Facet facet = facets[j];
        Region region = region_at(facet.i_region);
        bool is_surface = region.kind == REGION_SURFACE;
        vec3 u = region.u / float(max(region.n_u, 1u)), v = region.v / float(max(region.n_v, 1u));
        // A particle's facet is a disc.
        float radius = is_surface ? length(u + v) : sqrt(facet.area * INV_PI);
        vec3 irradiance = vec3(0.0);
        bool is_partly_shadowed = false;
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            uint k = i * push.n_lights + l;
            uint from = j * push.n_lights + l;
            float g = 0.0;
            if (is_surface) {
                uint shadows = shadows_on(
                    facet.position, radius, light, facet.i_region, push.n_surfaces,
                    is_partly_shadowed
                );
                CellSamples s = arriving(
                    light, Cell(facet.position, u, v), facet.normal, through[from], shadows,
                    facet.i_region, push.n_surfaces
                );
                float scale = greatest(s), inverse = scale > 0.0 ? 1.0 / scale : 0.0;
                g = 0.0625 * total(s);
                cell_samples[k] =
                    packed(CellSamples(s.a * inverse, s.b * inverse, s.c * inverse, s.d * inverse));
                fluxes[k] = vec4(facet.area * scale, through[from], float(shadows), facet.area * g);
            } else {
                g = share_of(
                    light, arrival_at(light, facet.position), facet.normal, transmittance[from]
                );
                fluxes[k] = facet.area * g * vec4(facet.color, 1.0);
            }
            irradiance += light.energy * g;
        }
        vec3 flux = facet.area * INV_PI * region.kd * facet.color * irradiance;
        // Second moments of the rectangle; a disc has none, as its form factor is of another kind.
        vec3 square = is_surface ? (u * u + v * v) / 3.0 : vec3(0.0),
             leaning = is_surface ? (u.xxy * u.yzz + v.xxy * v.yzz) / 3.0 : vec3(0.0);
        sources[i] = Source(
            vec4(facet.position, radius), vec4(flux, is_partly_shadowed ? -1.0 : 1.0),
            vec4(facet.normal, facet.area), vec4(facet.area, square), vec4(leaning, 0.0)
        );
    }
}
