#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "occlude.glsl"
#include "stencil.glsl"
#include "turns.glsl"

// Facets as sources of the second reflection (docs/model.md §7, §11 "second"): what each sends
// diffusely, and by light the flux that its lobe reflects.

layout(local_size_x = 64) in;

const float INV_PI = 0.318309886183791;

layout(push_constant) uniform Push { uint n_facets; uint n_lights; uint n_surfaces; } push;
layout(std430, binding = 0) readonly buffer Facets { Facet facets[]; };
layout(std430, binding = 1) readonly buffer Lights { Light lights[]; };
// [facet][light], and what of it the clouds let through.
layout(std430, binding = 2) readonly buffer Transmittance { float transmittance[]; };
layout(std430, binding = 3) readonly buffer Through { float through[]; };
layout(binding = 4) uniform usamplerBuffer regions;
#include "regions.glsl"
// Facet of each place in the order of facets.
layout(std430, binding = 5) readonly buffer Order { uint order[]; };
// Source of each place.
layout(std430, binding = 6) readonly buffer Leaves { uint leaves[]; };
layout(std430, binding = 7) writeonly buffer Sources { Source sources[]; };
// [source][light], w: sum of A g, g the facet's share of the light's energy; xyz: of a cloud sum of
// A g c, c the facet's own colour; xyz: of a surface's facet A times the greatest share at one of
// its points, what the clouds let through, and the surfaces whose shadows reach it.
layout(std430, binding = 8) writeonly buffer Fluxes { vec4 fluxes[]; };
// [source][light], of surfaces' facets: the shares at the points by the greatest.
layout(std430, binding = 9) writeonly buffer Stencils { Packed stencils[]; };

#include "reach.glsl"
#include "arriving.glsl"

float greatest(Stencil s) {
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
        bool in_part = false;
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            uint k = i * push.n_lights + l;
            uint from = j * push.n_lights + l;
            float g = 0.0;
            if (is_surface) {
                uint shadows = shadows_on(facet.position, radius, light, facet.i_region, push.n_surfaces, in_part);
                Stencil s = arriving(light, Cell(facet.position, u, v), facet.normal, through[from], shadows, facet.i_region, push.n_surfaces);
                float scale = greatest(s), inverse = scale > 0.0 ? 1.0 / scale : 0.0;
                g = 0.0625 * total(s);
                stencils[k] = packed(Stencil(s.a * inverse, s.b * inverse, s.c * inverse, s.d * inverse));
                fluxes[k] = vec4(facet.area * scale, through[from], float(shadows), facet.area * g);
            } else {
                g = share_of(light, arrival_at(light, facet.position), facet.normal, transmittance[from]);
                fluxes[k] = facet.area * g * vec4(facet.color, 1.0);
            }
            irradiance += light.energy * g;
        }
        vec3 flux = facet.area * INV_PI * region.kd * facet.color * irradiance;
        // Second moments of its rectangle; a disc has none, as its form factor is of another kind.
        vec3 square = is_surface ? (u * u + v * v) / 3.0 : vec3(0.0), leaning = is_surface ? (u.xxy * u.yzz + v.xxy * v.yzz) / 3.0 : vec3(0.0);
        sources[i] = Source(
            vec4(facet.position, radius), vec4(flux, in_part ? -1.0 : 1.0), vec4(facet.normal, facet.area), vec4(facet.area, square),
            vec4(leaning, 0.0));
    }
}
