#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "light.glsl"
#include "angle.glsl"
#include "patches.glsl"

// Gathers the light of surfaces and ground on the faces of the grid's box, less that of the sky
// which they hide (model.md §18, passes.md "diffusion"): a workgroup a patch.
// In: facets with their radiosity, lights. Out: irradiance by patch, W/m^2. Law: sum of
// A cos cos/(pi d^2) times radiosity less the sky's; the receiving places lie deeper by a facet's
// edge. Error: some ulp of the terms.

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

vec4 solid_at(uint k) { return uintBitsToFloat(TEXEL(solids, int(k))); }

shared vec3 sums[64];

void main() {
    uint k = gl_LocalInvocationID.x;
    Patch to = patch_at(push.grid, gl_WorkGroupID.x);
    vec3 deeper = min(vec3(push.lift), 0.5 * extent_of(push.grid));
    vec3 at = to.center - to.outward * deeper;
    Skies skies = all_skies();
    vec3 sum = vec3(0.0);
    for (uint j = k; j < push.n_facets; j += 64u) {
        vec4 place = solid_at(3u * j);
        vec3 offset = place.xyz - at;
        float share = share_between(offset, solid_at(3u * j + 1u).xyz, place.w, to.outward);
        vec3 sent = solid_at(3u * j + 2u).rgb;
        vec3 toward = offset * inversesqrt(max(dot(offset, offset), 1e-30));
        sum += share * (sent - sky_along(skies, toward, offset.y > 0.0 ? 1.0 : 0.0));
    }
    sums[k] = sum;
    for (uint n = 32u; n > 0u; n /= 2u) {
        barrier();
        if (k < n) {
            sums[k] += sums[k + n];
        }
    }
    if (k == 0u) {
        faces[gl_WorkGroupID.x] = vec4(sums[0], 0.0);
    }
}
