#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"

// Converts the grid's fixed-point sums to density (passes.md "grid").
// In: 64-bit sums by cell. Out: density, extinction per unit length. Error: three roundings.

layout(push_constant) uniform Push {
    uint n_cells;
    float density_per_quantum;
} push;
READS(0, uvec2, sums)
WRITES(1, float, density)

void main() {
    FOR_EACH(c, push.n_cells) {
        density[c] =
            (float(sums[c].y) * 4294967296.0 + float(sums[c].x)) * push.density_per_quantum;
    }
}
