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

// 1: the clouds' transmittance is also stored by itself.
layout(constant_id = 0) const uint APART = 0;

layout(push_constant) uniform Push {
    Grid grid;
    uint n_facets;
    uint n_lights;
    uint n_surfaces;
    float step_length;
    float backward;
    uint max_steps;
} push;
READS(0, Facet, facets)
READS(1, Light, lights)
TEXELS(2, regions)
#include "regions.glsl"
FLOATS(3, density)
// [facet][light]
WRITES(4, float, transmittance)
WRITES(5, float, through)

#include "sum.glsl"
// Sums in double sample in double.
#define DEEP DOUBLE
#include "density.glsl"
#include "reach.glsl"

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

// Returns where the ray from p along d enters and leaves the grid's box; the end is before the
// beginning where the ray misses the box.
WEIGHTS2 crossing(PLACE p, PLACE d, WEIGHT distance) {
    PLACE low = push.grid.low;
    PLACE high = low + cell_edges() * PLACE(push.grid.n_cells);
    WEIGHT enter = 0.0, leave = distance;
    for (int axis = 0; axis < 3; ++axis) {
        if (d[axis] != 0.0) {
            WEIGHT a = (low[axis] - p[axis]) / d[axis], b = (high[axis] - p[axis]) / d[axis];
            enter = max(enter, min(a, b));
            leave = min(leave, max(a, b));
        } else if (p[axis] < low[axis] || p[axis] > high[axis]) {
            leave = -1.0;
        }
    }
    return WEIGHTS2(enter, leave);
}

// Returns e^-(1-g)tau from p to the light.
float through_the_cloud(PLACE p, LightPath direction) {
    PLACE d = direction.toward;
    WEIGHTS2 part = crossing(p, d, direction.distance);
    WEIGHT length_total = part.y - part.x;
    // There is nothing to march for without losses, or where the ray misses the box.
    bool is_marched = push.backward > 0.0 && length_total > 0.0;
    // Cubes take the step as it is: a unit vector's length is 1 but for its rounding.
    WEIGHT step_length =
        push.grid.aspect == 1.0 ? WEIGHT(push.step_length) : push.step_length / in_widths(d);
    uint n = is_marched ? clamp(uint(ceil(length_total / step_length)), 1u, push.max_steps) : 0u;
    SUM1 tau = EMPTY1;
    for (uint j = 0; j < n; ++j) {
        WEIGHT t0 = WEIGHT(j) * step_length;
        WEIGHT ds = min(step_length, length_total - t0);
        ADD(tau, density_at(p + (part.x + (t0 + 0.5 * ds)) * d) * ds);
    }
    // Vulkan's exp(0) may be three ulp off 1, and an empty path must give exactly 1. There is no
    // exp of doubles.
    float depth = float(push.backward * TOTAL(tau));
    return depth > 0.0 ? exp(-depth) : 1.0;
}

void main() {
    FOR_EACH(k, push.n_facets * push.n_lights) {
        Facet facet = facets[k / push.n_lights];
        Light light = lights[k % push.n_lights];
        // A light without energy is multiplied by 0 later.
        bool is_on = any(notEqual(light.energy, vec3(0.0)));
        bool is_center_clear =
            is_on && is_clear(facet.position, light, facet.i_region, push.n_surfaces);
        // Part of a surface's facet may be lit though its centre is hidden.
        float dimmed = is_center_clear || (APART != 0 && is_on)
                           ? through_the_cloud(facet.position, light_path(light, facet.position))
                           : 0.0;
        transmittance[k] = is_center_clear ? dimmed : 0.0;
        if (APART != 0) {
            through[k] = dimmed;
        }
    }
}
