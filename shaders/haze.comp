#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "angle.glsl"
#include "clear_sky.glsl"
#include "sea.glsl"

// Puts the air before facets (model.md §19, passes.md "haze"). In: facets, their light, the sky;
// what arrives of the sun and the waves, by facet and region. Out: the light as the eye sees it, as
// "first" alone, and its changes inside of blobs. Law: light, and what a sea mirrors, times the
// share that comes through, plus the light of the air. Error: 1e-5 of the magnitudes that are added
// up.

// 1: the light changes inside of blobs.
layout(constant_id = 0) const uint SLOPES = 0;
// 1: some ground is a sea.
layout(constant_id = 1) const uint HAS_SEA = 0;
// 1: optical depths arrive, in place of shares.
layout(constant_id = 2) const uint DEPTHS = 0;

layout(push_constant) uniform Push {
    uint n_facets;
    uint n_lights;
    // Number of the sun.
    uint i_sun;
    // Regions of surfaces and ground.
    uint n_solids;
    // Share of the depth that weakens light on its way to them.
    float backward;
} push;
READS(0, Facet, facets)
READS(1, Lit, lit)
READS(2, Slope, slopes)
READS(3, Sky, skies)
WRITES(4, Lit, hazed)
WRITES(5, Slope, hazed_slopes)
// [facet][light]
READS(6, float, arriving)
// By region the mean square of a sea's slopes; 0 where there is none.
READS(7, float, seas)

float sum(vec3 v) { return v.r + v.g + v.b; }

// Returns what the facet of a sea mirrors toward the eye.
vec3 mirrored_by(Sky sky, uint i, vec3 direction) {
    uint i_region = facets[i].i_region;
    float slopes = i_region < push.n_solids ? seas[i_region] : 0.0;
    if (!(slopes > 0.0 && direction.y < 0.0)) {
        return vec3(0.0);
    }
    float v = arriving[i * push.n_lights + push.i_sun];
    // A barred way has the depth 1e30.
    float sunlit = DEPTHS != 0 ? exp(-push.backward * v) : v;
    return of_sea(sky, slopes, -direction, v < 1e29 ? sunlit : 0.0);
}

void main() {
    FOR_EACH(i, push.n_facets) {
        Sky sky = skies[0];
        vec3 offset = facets[i].position - sky.camera.eye;
        float far = length(offset);
        // At the eye there is no air, whatever the direction.
        vec3 direction = far > 0.0 ? offset / far : vec3(0.0, 1.0, 0.0);
        Haze haze = haze_before(sky, direction, far);
        Lit light = lit[i];
        vec3 sent = light.first + light.second;
        if (HAS_SEA != 0) {
            sent += mirrored_by(sky, i, direction);
        }
        vec3 through = haze.through * sent;
        light.first = through + haze.added;
        light.second = vec3(0.0);
        hazed[i] = light;
        if (SLOPES != 0) {
            // Only the light that comes through changes. The mean of the channels stands for it.
            Slope slope = slopes[i];
            float all = sum(light.first);
            slope.relative *= all > 0.0 ? sum(through) / all : 1.0;
            hazed_slopes[i] = slope;
        }
    }
}
