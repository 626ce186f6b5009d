#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "light.glsl"
#include "angle.glsl"
#include "patches.glsl"

// Gathers the light of surfaces and ground on the faces of the grid's box, less that of the sky
// which they hide (model.md §18, passes.md "diffusion"): a workgroup a patch.
// In: facets with their radiosity, lights. Out: by patch irradiance, and pi times the mean radiance
// of each sector, W/m^2. Law: sum of A cos cos/(pi d^2) times radiosity less the sky's; the
// receiving places lie deeper by a facet's edge. Error: some ulp of the terms.

// Invocations, a power of 2, at least 8. The fewer, the less is to be added up.
#ifndef WORKGROUP
#define WORKGROUP 32
#endif

layout(local_size_x = WORKGROUP) in;

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

// Sums of invocations: of all light, then of eight sectors at a time.
shared vec3 sums[8 * WORKGROUP];

// Adds up the sums of sectors 8a to 8a+7, and writes them. It stands three times in the text: some
// GPUs would keep an array in memory that a loop with barriers reads.
#define WRITE_EIGHT(a)                                             \
    barrier();                                                     \
    [[unroll]] for (uint i = 0u; i < 8u; ++i) {                    \
        sums[WORKGROUP * i + k] = of_sector[8u * a + i];           \
    }                                                              \
    barrier();                                                     \
    if (k < 8u) {                                                  \
        faces[OF_PATCH * i_patch + 1u + 8u * a + k] = vec4(        \
            sum_of(k) / (a == axis ? 0.125 : 0.0625), 0.0          \
        );                                                         \
    }

vec3 sum_of(uint i_sector) {
    vec3 all = vec3(0.0);
    for (uint i = 0u; i < WORKGROUP; ++i) {
        all += sums[WORKGROUP * i_sector + i];
    }
    return all;
}

void main() {
    uint k = gl_LocalInvocationID.x, i_patch = gl_WorkGroupID.x;
    uint axis = i_patch / (2u * OF_FACE), side = i_patch / OF_FACE % 2u;
    Patch to = patch_at(push.grid, i_patch);
    vec3 deeper = min(vec3(push.lift), 0.5 * extent_of(push.grid));
    vec3 at = to.center - to.outward * deeper;
    Skies skies = all_skies();
    vec3 sum = vec3(0.0);
#if BOUNCES
    vec3 of_sector[N_DIRECTIONS];
    [[unroll]] for (uint i = 0u; i < N_DIRECTIONS; ++i) { of_sector[i] = vec3(0.0); }
#endif
    for (uint j = k; j < push.n_facets; j += WORKGROUP) {
        vec4 place = solid_at(3u * j);
        vec3 offset = place.xyz - at;
        float share = share_between(offset, solid_at(3u * j + 1u).xyz, place.w, to.outward);
        if (share > 0.0) {
            vec3 sent = solid_at(3u * j + 2u).rgb;
            vec3 toward = offset * inversesqrt(max(dot(offset, offset), 1e-30));
            vec3 light = share * (sent - sky_along(skies, toward, offset.y > 0.0 ? 1.0 : 0.0));
            sum += light;
#if BOUNCES
            vec3 positive = positive_of(toward, axis, side);
            [[unroll]] for (uint i = 0u; i < N_DIRECTIONS; ++i) {
                of_sector[i] += share_in(i, toward, positive) * light;
            }
#endif
        }
    }
    sums[k] = sum;
    for (uint n = WORKGROUP / 2u; n > 0u; n /= 2u) {
        barrier();
        if (k < n) {
            sums[k] += sums[k + n];
        }
    }
    if (k == 0u) {
        faces[OF_PATCH * i_patch] = vec4(sums[0], 0.0);
    }
#if BOUNCES
    // By the integral over pi of a cosine times the shares.
    WRITE_EIGHT(0u)
    WRITE_EIGHT(1u)
    WRITE_EIGHT(2u)
#endif
}
