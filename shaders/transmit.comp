#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Transmittance from every facet toward every light through the density grid (docs/model.md §8, §11).

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { Grid grid; uint n_facets; uint n_lights; float step_length; float backward; uint max_steps; } push;
layout(std430, binding = 0) readonly buffer Facets { Facet facets[]; };
layout(std430, binding = 1) readonly buffer Lights { Light lights[]; };
layout(std430, binding = 2) readonly buffer Density { float density[]; };
// [facet][light]
layout(std430, binding = 3) writeonly buffer Transmittance { float transmittance[]; };

#include "density.glsl"

// Distance from p along d to where the ray leaves the grid's box; 0 from outside.
float exit_distance(vec3 p, vec3 d) {
    vec3 low = push.grid.low;
    vec3 high = low + push.grid.cell * vec3(push.grid.n_cells);
    if (any(lessThan(p, low)) || any(greaterThan(p, high))) {
        return 0.0;
    }
    float t = 3.4e38;
    for (int axis = 0; axis < 3; ++axis) {
        if (d[axis] != 0.0) {
            t = min(t, ((d[axis] > 0.0 ? high[axis] : low[axis]) - p[axis]) / d[axis]);
        }
    }
    return max(t, 0.0);
}

void main() {
    FOR_EACH(k, push.n_facets * push.n_lights) {
        vec3 p = facets[k / push.n_lights].position;
        vec3 d = lights[k % push.n_lights].toward;
        float length_total = exit_distance(p, d);
        uint n = clamp(uint(ceil(length_total / push.step_length)), 1u, push.max_steps);
        float tau = 0.0;
        for (uint j = 0; j < n; ++j) {
            float t0 = float(j) * push.step_length;
            float ds = min(push.step_length, length_total - t0);
            tau += density_at(p + (t0 + 0.5 * ds) * d) * ds;
        }
        // Vulkan's exp(0) may be three ulp off 1: nothing on the way is exactly nothing.
        float depth = push.backward * tau;
        transmittance[k] = depth > 0.0 ? exp(-depth) : 1.0;
    }
}
