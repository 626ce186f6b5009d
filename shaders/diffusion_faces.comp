#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "light.glsl"
#include "angle.glsl"
#include "patches.glsl"

// Gathers the light of surfaces and ground on the faces of the grid's box, less that of the sky
// which they hide (model.md §18, passes.md "diffusion"): a workgroup a patch.
// In: facets with their radiosity, lights. Out: by patch irradiance, and pi times the mean radiance
// of each sector, W/m^2. Law: sum of A cos cos/(pi d^2) times radiosity less the sky's; the
// receiving places lie deeper by a facet's edge. Error: some ulp of the terms.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    Grid grid;
    uint n_facets;
    uint n_lights;
    float lift;
} push;
READS(0, Light, lights)
// By facet: place and area, normal, radiosity. Texels, which llvmpipe fetches for all invocations
// at once.
TEXELS(1, solids)
WRITES(2, vec4, faces)

#include "sky.glsl"
#include "directions.glsl"
#include "sectors.glsl"

vec4 solid_at(uint k) { return uintBitsToFloat(TEXEL(solids, int(k))); }

// 1: bounces want the light by sector.
#ifndef BOUNCES
#define BOUNCES 0
#endif

// Light of a facet an invocation, and the direction that it comes from.
shared vec3 lights_of[64];
shared vec3 towards[64];

void main() {
    uint k = gl_LocalInvocationID.x, i_patch = gl_WorkGroupID.x;
    uint axis = i_patch / (2u * OF_FACE), side = i_patch / OF_FACE % 2u;
    Patch to = patch_at(push.grid, i_patch);
    vec3 deeper = min(vec3(push.lift), 0.5 * extent_of(push.grid));
    vec3 at = to.center - to.outward * deeper;
    Skies skies = all_skies();
    // Light of all, and of sector k.
    vec3 sum = vec3(0.0), of_sector = vec3(0.0);
    for (uint first = 0u; first < push.n_facets; first += 64u) {
        uint j = first + k;
        vec3 light = vec3(0.0), toward = vec3(0.0);
        if (j < push.n_facets) {
            vec4 place = solid_at(3u * j);
            vec3 offset = place.xyz - at;
            float share = share_between(offset, solid_at(3u * j + 1u).xyz, place.w, to.outward);
            vec3 sent = solid_at(3u * j + 2u).rgb;
            toward = offset * inversesqrt(max(dot(offset, offset), 1e-30));
            light = share * (sent - sky_along(skies, toward, offset.y > 0.0 ? 1.0 : 0.0));
        }
        sum += light;
#if BOUNCES
        lights_of[k] = light;
        towards[k] = toward;
        barrier();
        if (k < N_DIRECTIONS) {
            for (uint i = 0u; i < 64u; ++i) {
                vec3 d = towards[i];
                of_sector += share_in(k, d, positive_of(d, axis, side)) * lights_of[i];
            }
        }
        barrier();
#endif
    }
    lights_of[k] = sum;
    for (uint n = 32u; n > 0u; n /= 2u) {
        barrier();
        if (k < n) {
            lights_of[k] += lights_of[k + n];
        }
    }
    if (k == 0u) {
        faces[OF_PATCH * i_patch] = vec4(lights_of[0], 0.0);
    }
#if BOUNCES
    if (k < N_DIRECTIONS) {
        // The integral over pi of a cosine times the shares.
        float all = k >> 3 == axis ? 0.125 : 0.0625;
        faces[OF_PATCH * i_patch + 1u + k] = vec4(of_sector / all, 0.0);
    }
#endif
}
