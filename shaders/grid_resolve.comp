#version 460
#extension GL_GOOGLE_include_directive : require
#include "each.glsl"

// Fixed-point sums to density: extinction per unit length.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { uint n_cells; float density_per_quantum; } push;
layout(std430, binding = 0) readonly buffer Sums { uvec2 sums[]; };
layout(std430, binding = 1) writeonly buffer Density { float density[]; };

void main() {
    FOR_EACH(c, push.n_cells) {
        density[c] = (float(sums[c].y) * 4294967296.0 + float(sums[c].x)) * push.density_per_quantum;
    }
}
