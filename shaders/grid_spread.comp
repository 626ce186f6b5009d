#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"

// Converts the sums of a grid to density and adds what the grid of wider cells gives (model.md §8,
// passes.md "grid"). In: 64-bit sums by cell; the density of the wider cells, which have twice the
// edges. Out: density by cell, extinction per unit length. Law: along each axis a wide cell gives
// its density to six cells, its own two and two on each side. Their shares are 1, 5, 10, 10, 5 and
// 1 of 16. The last cell of the box keeps the shares beyond it. Error: the roundings of the sums,
// and of 27 terms that are not negative.

// 1: the finest grid, whose density others read.
#ifndef FINEST
#define FINEST 0
#endif

// The wider grid has no cells where there is none.
layout(push_constant) uniform Push {
    uvec3 n_cells;
    uint i_first;
    uvec3 n_wider;
    uint i_first_wider;
    float density_per_quantum;
} push;
READS(0, uvec2, sums)
#if FINEST
READS(1, float, wide)
WRITES(2, float, density)
#else
UPDATES(1, float, wide)
#endif

// Returns the weights of three wider cells in cell i of n along an axis. The second is the one that
// cell i lies in.
vec3 given(uint i, uint n, uint n_wider) {
    bool is_odd = (i & 1u) == 1u;
    vec3 w = is_odd ? vec3(1.0, 10.0, 5.0) : vec3(5.0, 10.0, 1.0);
    bool is_last = i + 1u == n;
    if (i == 0u || (is_last && is_odd)) {
        w.y = 16.0;
    } else if (is_last) {
        // Half of the wider cell lies beyond.
        w.xy = vec2(6.0, 26.0);
    }
    if (n == 1u) {
        w.y = 32.0;
    }
    uint own = i / 2u;
    w.x = own > 0u ? w.x : 0.0;
    w.z = own + 1u < n_wider ? w.z : 0.0;
    return w / 16.0;
}

float of_wider(uvec3 at) {
    uvec3 n = push.n_wider, own = at / 2u;
    vec3 x = given(at.x, push.n_cells.x, n.x), y = given(at.y, push.n_cells.y, n.y);
    vec3 z = given(at.z, push.n_cells.z, n.z);
    float sum = 0.0;
    for (int k = 0; k < 9; ++k) {
        uint j = uint(k % 3), l = uint(k / 3);
        // Cells that do not exist have no weight.
        uint row = clamp(own.y + j, 1u, n.y) - 1u, layer = clamp(own.z + l, 1u, n.z) - 1u;
        uint first = push.i_first_wider + n.x * (row + n.y * layer);
        float before = wide[first + max(own.x, 1u) - 1u];
        float after = wide[first + min(own.x + 1u, n.x - 1u)];
        float along = x.x * before + x.y * wide[first + own.x] + x.z * after;
        float of_row = j == 0u ? y.x : j == 1u ? y.y : y.z;
        float of_layer = l == 0u ? z.x : l == 1u ? z.y : z.z;
        sum += of_row * of_layer * along;
    }
    return sum;
}

void main() {
    uvec3 n = push.n_cells;
    FOR_EACH(c, n.x * n.y * n.z) {
        uvec2 own = sums[push.i_first + c];
        float sum = (float(own.y) * 4294967296.0 + float(own.x)) * push.density_per_quantum;
        if (push.n_wider.x > 0u) {
            uint row = c / n.x;
            sum += of_wider(uvec3(c - row * n.x, row % n.y, row / n.y));
        }
#if FINEST
        density[c] = sum;
#else
        wide[push.i_first + c] = sum;
#endif
    }
}
