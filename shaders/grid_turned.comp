#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "functions.glsl"
#include "turn.glsl"

// Deposits the mass of each ellipsoid whose axes are turned into the grid's cells, a workgroup a
// blob (model.md §14, passes.md "grid"). In: placed particles (lengths), kappa (1/length). Out:
// fixed-point sums of mass by cell, 64 bits, as those of grid_deposit.comp. Law: slabs along one
// axis, rows along the next, and cells; each is a share of a normal distribution, cut at 3 sigma
// and normalised. Bound: that of grid_deposit.comp for each of the three shares, and the rounding
// of the places of slabs and rows.

#ifndef WORKGROUP
#define WORKGROUP 32
#endif
layout(local_size_x = WORKGROUP) in;

const float CUT_SIGMA = 3.0;
// erf(3/sqrt 2): the share of a Gaussian within the cut.
const float WITHIN_CUT = 0.9973002039367398;
// (2 pi)^(3/2)
const float MASS_FACTOR = 15.7496099457224;
// A blob on wider cells has at least so many of them a sigma, in every direction.
const float LEVEL_SIGMA = 1.5;

layout(push_constant) uniform Push {
    Grid grid;
    uint n_particles;
    float quanta_per_mass;
    // Number of grids, and whether those of wider cells are written.
    uint n_levels;
    uint is_wide;
    // Not read: grid_narrow.comp runs only where no ellipsoid is turned.
    uint has_narrow;
} push;
TEXELS(0, placed)
TEXELS(1, particles)
// Cell c: low word at 2c, high word at 2c + 1. Each grid of wider cells lies behind that of half
// their edges.
UPDATES(2, uint, sums)

float below(float v) { return erf_approx(clamp(v, -CUT_SIGMA, CUT_SIGMA) * 0.70710678118); }

// Returns the share of a unit Gaussian between a and b, which are in sigma.
float share(float a, float b) {
    return max(0.5 / WITHIN_CUT * (below(b) - below(a)), 0.0);
}

// Returns mean and variance of the normal distribution that stands for the part from a to b.
vec2 part(float a, float b) {
    a = clamp(a, -CUT_SIGMA, CUT_SIGMA);
    b = clamp(b, -CUT_SIGMA, CUT_SIGMA);
    float width = (b - a) * (b - a) * (1.0 / 12.0);
    return vec2(0.5 * (a + b), width) / (1.0 + width);
}

// Returns the first and the last cell of an axis that a Gaussian reaches; none has last < first.
ivec2 reached(float at, float sigma, float edge, int n) {
    vec2 ends = floor(vec2(at - CUT_SIGMA * sigma, at + CUT_SIGMA * sigma) / edge);
    return ivec2(clamp(ends, vec2(0.0, -1.0), vec2(float(n), float(n - 1))));
}

void main() {
    for (uint p = gl_WorkGroupID.x; p < push.n_particles; p += gl_NumWorkGroups.x) {
        Placed blob = PLACED_AT(p);
        Particle particle = PARTICLE_AT(p);
        vec3 lengths = vec3(1.0, particle.aspect, particle.aspect_z);
        uvec2 turn = particle.turn;
        // sigma cubed alone may overflow.
        vec3 sigmas = blob.sigma * lengths;
        float mass = particle.kappa * MASS_FACTOR * sigmas.x * sigmas.y * sigmas.z;
        if ((lengths.z == 1.0 && turn == uvec2(0)) || !(mass > 0.0)) {
            continue;
        }
        // All lengths are in sigma from here on.
        float in_sigma = 1.0 / blob.sigma;
        vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0) * in_sigma;
        vec3 x = (blob.position - push.grid.low) * in_sigma;
        ivec3 n_cells = ivec3(push.grid.n_cells);
        int i_first = 0;
        float edge = 1.0;
        float least = min(1.0, min(lengths.y, lengths.z)) / max(edges.x, max(edges.y, edges.z));
        for (uint level = 1; level < push.n_levels && least >= LEVEL_SIGMA * 2.0 * edge; ++level) {
            i_first += level > 1u ? n_cells.x * n_cells.y * n_cells.z : 0;
            n_cells = (n_cells + 1) / 2;
            edge *= 2.0;
        }
        if ((edge > 1.0) != (push.is_wide != 0u)) {
            continue;
        }
        vec3 y, z;
        axes_of(turn, y, z);
        mat3 axes = mat3(cross(y, z), y, z), back = transpose(axes);
        vec3 squares = lengths * lengths;
        mat3 covariance = axes * mat3(squares.x, 0.0, 0.0, 0.0, squares.y, 0.0, 0.0, 0.0, squares.z)
                          * back;
        mat3 inverted = axes
                       * mat3(
                           1.0 / squares.x, 0.0, 0.0, 0.0, 1.0 / squares.y, 0.0, 0.0, 0.0,
                           1.0 / squares.z
                       )
                       * back;
        float product = squares.y * squares.z;
        if (edge > 1.0) {
            // Spreading adds the rest of the variance.
            vec3 spread = 0.5 * (edge * edge - 1.0) * edges * edges;
            covariance -= mat3(spread.x, 0.0, 0.0, 0.0, spread.y, 0.0, 0.0, 0.0, spread.z);
            inverted = inverse(covariance);
            product = determinant(covariance);
        }
        edges *= edge;
        // The axes, those first along which the blob extends over the most cells.
        vec3 cells = vec3(covariance[0].x, covariance[1].y, covariance[2].z) / (edges * edges);
        int a = cells.y > cells.x ? 1 : 0;
        a = cells.z > cells[a] ? 2 : a;
        int b = a == 0 ? 1 : 0, c = 3 - a - b;
        if (cells[c] > cells[b]) {
            int other = b;
            b = c;
            c = other;
        }
        // b = by_a a + ..., and c = of_a a + of_b b + ..., about the centre; the rest of each is
        // independent of what comes before.
        float by_a = covariance[b][a] / covariance[a][a];
        float rest_b = inverted[c][c] * product / covariance[a][a];
        float of_a = -inverted[c][a] / inverted[c][c], of_b = -inverted[c][b] / inverted[c][c];
        float rest_c = 1.0 / inverted[c][c];
        ivec3 strides = ivec3(1, n_cells.x, n_cells.x * n_cells.y);
        float total_quanta = mass * push.quanta_per_mass;
        float sigma_a = sqrt(covariance[a][a]);
        ivec2 slabs = reached(x[a], sigma_a, edges[a], n_cells[a]);
        for (int i = slabs.x; i <= slabs.y; ++i) {
            vec2 ends = (vec2(float(i), float(i + 1)) * edges[a] - x[a]) / sigma_a;
            float in_slab = share(ends.x, ends.y);
            vec2 slab = part(ends.x, ends.y) * vec2(sigma_a, sigma_a * sigma_a);
            float variance_b = rest_b + by_a * by_a * slab.y;
            // How far a lies off the slab's mean where b lies off the row's.
            float lag = by_a * slab.y / variance_b;
            float slope = of_a * lag + of_b;
            float left = rest_c + of_a * of_a * slab.y * (rest_b / variance_b);
            float at_b = x[b] + by_a * slab.x, sigma_b = sqrt(variance_b);
            ivec2 rows = reached(at_b, sigma_b, edges[b], n_cells[b]);
            for (int j = rows.x + int(gl_LocalInvocationID.x); j <= rows.y;
                 j += int(gl_WorkGroupSize.x)) {
                ends = (vec2(float(j), float(j + 1)) * edges[b] - at_b) / sigma_b;
                float quanta_of_row = total_quanta * in_slab * share(ends.x, ends.y);
                vec2 row = part(ends.x, ends.y) * vec2(sigma_b, variance_b);
                float at_c = x[c] + (of_a + of_b * by_a) * slab.x + slope * row.x;
                float sigma_c = sqrt(left + slope * slope * row.y);
                ivec2 run = reached(at_c, sigma_c, edges[c], n_cells[c]);
                int cell = i_first + i * strides[a] + j * strides[b] + run.x * strides[c];
                float before = below((float(run.x) * edges[c] - at_c) / sigma_c);
                for (int k = run.x; k <= run.y; ++k, cell += strides[c]) {
                    float after = below((float(k + 1) * edges[c] - at_c) / sigma_c);
                    float of_cell = max(0.5 / WITHIN_CUT * (after - before), 0.0);
                    before = after;
                    uint quanta = uint(quanta_of_row * of_cell + 0.5);
                    if (quanta > 0) {
                        uint found = atomicAdd(sums[2 * cell], quanta);
                        if (found + quanta < found) {
                            atomicAdd(sums[2 * cell + 1], 1u);
                        }
                    }
                }
            }
        }
    }
}
