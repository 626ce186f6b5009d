#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"

// Blurs a density along one axis (passes.md "grid"). In: the density, and the 64-bit sums of what
// needs as many blurs. Out: the blurred density; the last blur adds it to the grid's. Law: shares
// of 1, 20, 54, 20 and 1 of 96, whose variance is 1/2 cell² and whose fourth cumulant is 0. The
// grid's ends are mirrors, so that the mass is kept. Error: the roundings of terms that are not
// negative.

layout(push_constant) uniform Push {
    uvec3 n_cells;
    // 0, 1, 2: along x, y, z.
    uint axis;
    // The sums' first cell.
    uint i_first;
    // 1: the sums count; the density counts; the result is added to what is there.
    uint has_sums;
    uint has_density;
    uint adds;
    float density_per_quantum;
} push;
READS(0, uvec2, sums)
READS(1, float, density)
UPDATES(2, float, blurred)

float value_of(uint c) {
    float value = 0.0;
    if (push.has_density == 1u) {
        value = density[c];
    }
    if (push.has_sums == 1u) {
        uvec2 own = sums[push.i_first + c];
        value += (float(own.y) * 4294967296.0 + float(own.x)) * push.density_per_quantum;
    }
    return value;
}

// Returns the cell that stands for cell i of n, which may lie beyond an end.
int mirrored(int i, int n) {
    i = i < 0 ? -1 - i : i;
    i = i >= n ? 2 * n - 1 - i : i;
    return clamp(i, 0, n - 1);
}

void main() {
    uvec3 n = push.n_cells;
    FOR_EACH(c, n.x * n.y * n.z) {
        uvec3 at = uvec3(c % n.x, c / n.x % n.y, c / (n.x * n.y));
        uvec3 strides = uvec3(1u, n.x, n.x * n.y);
        int i = int(at[push.axis]), n_along = int(n[push.axis]), stride = int(strides[push.axis]);
        float sum = 54.0 * value_of(c);
        for (int k = 1; k <= 2; ++k) {
            float before = value_of(uint(int(c) + stride * (mirrored(i - k, n_along) - i)));
            float after = value_of(uint(int(c) + stride * (mirrored(i + k, n_along) - i)));
            sum += (k == 1 ? 20.0 : 1.0) * (before + after);
        }
        sum *= 1.0 / 96.0;
        blurred[c] = push.adds == 1u ? blurred[c] + sum : sum;
    }
}
