#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "clear_sky.glsl"

// Puts the air before facets (model.md §19, passes.md "haze"). In: facets, their light, the sky.
// Out: the light as the eye sees it, as "first" alone, and its changes inside of blobs. Law: light
// times the share that comes through, plus the light of the air. Error: 1e-5 of the magnitudes that
// are added up.

// 1: the light changes inside of blobs.
layout(constant_id = 0) const uint SLOPES = 0;

layout(push_constant) uniform Push {
    uint n_facets;
} push;
READS(0, Facet, facets)
READS(1, Lit, lit)
READS(2, Slope, slopes)
READS(3, Sky, skies)
WRITES(4, Lit, hazed)
WRITES(5, Slope, hazed_slopes)

float sum(vec3 v) { return v.r + v.g + v.b; }

void main() {
    FOR_EACH(i, push.n_facets) {
        Sky sky = skies[0];
        vec3 offset = facets[i].position - sky.camera.eye;
        float far = length(offset);
        // At the eye there is no air, whatever the direction.
        Haze haze = haze_before(sky, far > 0.0 ? offset / far : vec3(0.0, 1.0, 0.0), far);
        Lit light = lit[i];
        vec3 through = haze.through * (light.first + light.second);
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
