#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "occlude.glsl"

// Computes how much of every light arrives at every facet, past the surfaces and through the
// density grid (model.md §8, passes.md "transmit").
// In: facets, lights, regions, the density grid (1/length). Out: transmittance [facet][light], and
// the clouds' share of it where the second reflection needs it.
// Law: V = [nothing hides] e^{-(1-g) tau}, tau by midpoint samples of trilinear density.
// Bound: of the march's sum, passes.md "sums"; IN_PLANE for the surfaces.
// DEPTHS: tau instead of V, for clouds as a medium.

// 1: the clouds' transmittance is also stored by itself.
layout(constant_id = 0) const uint APART = 0;
// 1: ground may hide a light from its own points.
layout(constant_id = 1) const uint RELIEF = 0;

#ifndef DEPTHS
#define DEPTHS 0
#endif
// Result of a way that a surface bars, or that leads to a light without energy.
#if DEPTHS
const float BARRED = BARRED_DEPTH;
#else
const float BARRED = 0.0;
#endif

layout(push_constant) uniform Push {
    Grid grid;
    uint n_facets;
    uint n_lights;
    uint n_surfaces;
    float step_length;
    float backward;
    uint max_steps;
    // The first so many facets receive the sky through the clouds.
    uint n_under_sky;
    // Facets of the ground's points.
    uint i_first_ground;
    uint n_ground;
} push;
READS(0, Facet, facets)
READS(1, Light, lights)
TEXELS(2, regions)
#include "regions.glsl"
FLOATS(3, density)
// [facet][light]
WRITES(4, float, transmittance)
WRITES(5, float, through)
// [point of the ground][light] 1: ground hides the light.
READS(6, uint, hidden)

#include "sum.glsl"
// Sums in double sample in double.
#define DEEP DOUBLE
#include "density.glsl"
#include "reach.glsl"
#include "march.glsl"

// The direction toward a light, and its distance.
struct LightPath {
    PLACE toward;
    WEIGHT distance;
};

LightPath light_path(Light light, vec3 p) {
#if DEEP
    if (light.kind == LIGHT_POINT) {
        PLACE offset = PLACE(light.position) - PLACE(p);
        WEIGHT d = length(offset);
        return LightPath(d > 0.0 ? offset / d : PLACE(0.0, 1.0, 0.0), d);
    }
#endif
    Arrival a = arrival_at(light, p);
    return LightPath(PLACE(a.toward), a.distance);
}

// Returns (1-g)tau from p to the light; with DEPTHS tau itself.
float depth_to(PLACE p, LightPath way) {
    // There is no march without losses.
    REAL tau = depth_along(p, way.toward, way.distance, push.backward > 0.0);
    return float(push.backward * tau);
}

// Returns what arrives through the cloud. Vulkan's exp(0) may be three ulp off 1, and an empty path
// must give exactly 1. There is no exp of doubles.
float arriving(float depth) {
#if DEPTHS
    return depth;
#else
    return depth > 0.0 ? exp(-depth) : 1.0;
#endif
}

// Whether ground hides a light from facet j.
bool is_behind_ground(uint j, uint i_light) {
    uint i_point = j - push.i_first_ground;
    return RELIEF != 0 && j >= push.i_first_ground && i_point < push.n_ground
           && hidden[i_point * push.n_lights + i_light] != 0u;
}

void main() {
    FOR_EACH(k, push.n_facets * push.n_lights) {
        uint j = k / push.n_lights, i_light = k % push.n_lights;
        Facet facet = facets[j];
        Light light = lights[i_light];
        // A light without energy is multiplied by 0 later.
        bool is_on = any(notEqual(light.energy, vec3(0.0)))
                     && (light.kind != LIGHT_SKY || j < push.n_under_sky)
                     && !is_behind_ground(j, i_light);
        bool is_center_clear =
            is_on && is_clear(facet.position, light, facet.i_region, push.n_surfaces);
        // Part of a surface's facet may be lit though its centre is hidden.
        float dimmed = is_center_clear || (APART != 0 && is_on)
                           ? arriving(
                                 depth_to(facet.position, light_path(light, facet.position))
                             )
                           : BARRED;
        transmittance[k] = is_center_clear ? dimmed : BARRED;
        if (APART != 0) {
            through[k] = dimmed;
        }
    }
}
