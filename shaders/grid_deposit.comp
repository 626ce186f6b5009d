#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "functions.glsl"

// Deposits each blob's mass into the grid's cells, a workgroup a blob (model.md §8, passes.md
// "grid"). In: placed particles (lengths), kappa (1/length). Out: fixed-point sums of mass by cell,
// 64 bits. Law: the Gaussian, cut at 3 sigma and normalised, integrated over each cell. The
// fixed-point sums do not depend on the order of the atomics. Bound: half a quantum a deposit, and
// erf_approx's error in the weights.

// The host asks for one subgroup, where barriers are cheap.
#ifndef WORKGROUP
#define WORKGROUP 32
#endif
layout(local_size_x = WORKGROUP) in;

const uint MAX_CELLS = 512;
const float CUT_SIGMA = 3.0;
// erf(3/sqrt 2): the share of a Gaussian within the cut, the weights' sum before they are
// normalised.
const float WITHIN_CUT = 0.9973002039367398;
// (2 pi)^(3/2)
const float MASS_FACTOR = 15.7496099457224;

layout(push_constant) uniform Push {
    Grid grid;
    uint n_particles;
    float quanta_per_mass;
} push;
READS(0, Placed, placed)
READS(1, Particle, particles)
// Cell c: low word at 2c, high word at 2c + 1.
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
        Placed blob = placed[p];
        float aspect = particles[p].aspect;
        float mass =
            particles[p].kappa * MASS_FACTOR * blob.sigma * blob.sigma * blob.sigma * aspect;
        vec3 sigma = blob.sigma * vec3(1.0, aspect, 1.0);
        vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
        vec3 inv_edges = push.grid.inv_cell * vec3(1.0, push.grid.inv_aspect, 1.0);
        vec3 x = blob.position - push.grid.low;
        ivec3 last = ivec3(push.grid.n_cells) - 1;
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
        int row = int(push.grid.n_cells.x), layer = row * int(push.grid.n_cells.y);
        for (int z = 0; z < n.z; ++z) {
            int first = begin.x + row * begin.y + layer * (begin.z + z);
            float layer_quanta = total_quanta * weights[2][z];
            // k / n.x by a float quotient is exact: k < MAX_CELLS^2 = 2^18 leaves the half a margin
            // of many ulp. Integer division is slow on most devices.
            for (int k = int(gl_LocalInvocationID.x); k < n.x * n.y; k += int(gl_WorkGroupSize.x)) {
                int y = int((float(k) + 0.5) / float(n.x));
                int x = k - y * n.x;
                uint quanta = uint(layer_quanta * (weights[0][x] * weights[1][y]) + 0.5);
                int cell = first + x + row * y;
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
