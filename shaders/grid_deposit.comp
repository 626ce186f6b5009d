#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "functions.glsl"
#include "grid_narrow.glsl"

// Deposits each blob's mass into the grid's cells, a workgroup a blob (model.md §8, passes.md
// "grid"). In: placed particles (lengths), kappa (1/length). Out: fixed-point sums of mass by cell,
// 64 bits. Law: the Gaussian, cut at 3 sigma and normalised, integrated over each cell. The
// fixed-point sums do not depend on the order of the atomics. Bound: half a quantum a deposit, and
// erf_approx's error in the weights. Wide blobs are deposited on grids of wider cells, by another
// dispatch. Where there are more, grid_narrow.comp deposits some.

// The host asks for one subgroup, where barriers are cheap.
#ifndef WORKGROUP
#define WORKGROUP 32
#endif
// 1: some ellipsoids are turned, and grid_turned.comp deposits them.
#ifndef TURNED
#define TURNED 0
#endif
layout(local_size_x = WORKGROUP) in;

const uint MAX_CELLS = 512;
const float CUT_SIGMA = 3.0;
// erf(3/sqrt 2): the share of a Gaussian within the cut, the weights' sum before they are
// normalised.
const float WITHIN_CUT = 0.9973002039367398;
// (2 pi)^(3/2)
const float MASS_FACTOR = 15.7496099457224;
// A blob on wider cells has at least so many of them a sigma, along every axis.
const float LEVEL_SIGMA = 1.5;

layout(push_constant) uniform Push {
    Grid grid;
    uint n_particles;
    float quanta_per_mass;
    // Number of grids, and whether those of wider cells are written.
    uint n_levels;
    uint is_wide;
    // 1: grid_narrow.comp deposits some blobs.
    uint has_narrow;
} push;
TEXELS(0, placed)
TEXELS(1, particles)
// Cell c: low word at 2c, high word at 2c + 1. Each grid of wider cells lies behind that of half
// their edges.
UPDATES(2, uint, sums)

shared float weights[3][MAX_CELLS];

// Returns the share of a unit Gaussian at 0 between cell faces a and b, in sigma, cut at
// +-CUT_SIGMA.
float weight(float a, float b) {
    float low = clamp(a, -CUT_SIGMA, CUT_SIGMA), high = clamp(b, -CUT_SIGMA, CUT_SIGMA);
    // Rounding must not make it negative: a negative float has no defined uint.
    return max(
        0.5 / WITHIN_CUT * (erf_approx(high * 0.70710678118) - erf_approx(low * 0.70710678118)), 0.0
    );
}

void main() {
    for (uint p = gl_WorkGroupID.x; p < push.n_particles; p += gl_NumWorkGroups.x) {
        Placed blob = PLACED_AT(p);
        Particle particle = PARTICLE_AT(p);
        float aspect = particle.aspect;
        float mass =
            particle.kappa * MASS_FACTOR * blob.sigma * blob.sigma * blob.sigma * aspect;
#if TURNED
        bool is_turned = particle.aspect_z != 1.0 || particle.turn != uvec2(0);
        mass = is_turned ? 0.0 : mass;
#endif
        vec3 at = place_in_cells(push.grid, blob.position);
        bool is_other = push.has_narrow == 1u && is_narrowed(push.grid, blob.sigma, at);
        mass = is_other ? 0.0 : mass;
        vec3 sigma = blob.sigma * vec3(1.0, aspect, 1.0);
        vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
        vec3 inv_edges = push.grid.inv_cell * vec3(1.0, push.grid.inv_aspect, 1.0);
        vec3 x = blob.position - push.grid.low;
        ivec3 n_cells = ivec3(push.grid.n_cells);
        // Place of the grid's first cell, and its cells' edge over that of the finest.
        int i_first = 0;
        float edge = 1.0;
        vec3 resolved = sigma * inv_edges;
        float least = min(resolved.x, min(resolved.y, resolved.z));
        for (uint level = 1; level < push.n_levels && least >= LEVEL_SIGMA * 2.0 * edge; ++level) {
            i_first += level > 1u ? n_cells.x * n_cells.y * n_cells.z : 0;
            n_cells = (n_cells + 1) / 2;
            edge *= 2.0;
        }
        mass = (edge > 1.0) == (push.is_wide != 0u) ? mass : 0.0;
        // Spreading adds the rest of the variance.
        if (edge > 1.0) {
            sigma = sqrt(sigma * sigma - 0.5 * (edge * edge - 1.0) * edges * edges);
        }
        edges *= edge;
        inv_edges /= edge;
        ivec3 last = n_cells - 1;
        ivec3 begin = clamp(ivec3(floor((x - CUT_SIGMA * sigma) * inv_edges)), ivec3(0), last);
        ivec3 end = clamp(ivec3(floor((x + CUT_SIGMA * sigma) * inv_edges)), begin, last);
        if (mass > 0.0) {
            for (int axis = 0; axis < 3; ++axis) {
                for (int i = begin[axis] + int(gl_LocalInvocationID.x); i <= end[axis];
                     i += int(gl_WorkGroupSize.x)) {
                    float a = (float(i) * edges[axis] - x[axis]) / sigma[axis];
                    float b = (float(i + 1) * edges[axis] - x[axis]) / sigma[axis];
                    weights[axis][i - begin[axis]] = weight(a, b);
                }
            }
        }
        barrier();
        ivec3 n = mass > 0.0 ? end - begin + 1 : ivec3(0);
        float total_quanta = mass * push.quanta_per_mass;
        int row = n_cells.x, layer = row * n_cells.y;
        // k / n.x by a float quotient is exact: k < MAX_CELLS^2 = 2^18 leaves the half a margin of
        // many ulp. Integer division is slow on most devices.
        for (int k = int(gl_LocalInvocationID.x); k < n.x * n.y; k += int(gl_WorkGroupSize.x)) {
            int y = int((float(k) + 0.5) / float(n.x));
            int x = k - y * n.x;
            float across = weights[0][x] * weights[1][y];
            int cell = i_first + begin.x + x + row * (begin.y + y) + layer * begin.z;
            for (int z = 0; z < n.z; ++z, cell += layer) {
                uint quanta = uint(total_quanta * weights[2][z] * across + 0.5);
                if (quanta > 0) {
                    uint before = atomicAdd(sums[2 * cell], quanta);
                    if (before + quanta < before) {
                        atomicAdd(sums[2 * cell + 1], 1u);
                    }
                }
            }
        }
        barrier();
    }
}
