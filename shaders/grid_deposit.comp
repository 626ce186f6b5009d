#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "functions.glsl"

// Deposits each blob's mass into the cells it meets (docs/model.md §8, "grid"): a workgroup a blob. Sums are 64-bit fixed
// point, so that they do not depend on the order of the atomics.

layout(local_size_x = 64) in;

const uint MAX_CELLS = 512;
const float CUT_SIGMA = 3.0;
// erf(3/sqrt 2): the share of a Gaussian within the cut, to which the weights sum before they are normalised.
const float WITHIN_CUT = 0.9973002039367398;
// (2 pi)^(3/2)
const float MASS_FACTOR = 15.7496099457224;

layout(push_constant) uniform Push { Grid grid; uint n_particles; float quanta_per_mass; } push;
layout(std430, binding = 0) readonly buffer PlacedParticles { Placed placed[]; };
layout(std430, binding = 1) readonly buffer Particles { Particle particles[]; };
// Cell c: low word at 2c, high word at 2c + 1.
layout(std430, binding = 2) buffer Sums { uint sums[]; };

shared float weights[3][MAX_CELLS];

// Share of a unit Gaussian at 0 between cell faces a and b (in sigma), cut at +-CUT_SIGMA.
float weight(float a, float b) {
    float low = clamp(a, -CUT_SIGMA, CUT_SIGMA), high = clamp(b, -CUT_SIGMA, CUT_SIGMA);
    // Not negative even where rounding makes it so: a negative float has no defined uint.
    return max(0.5 / WITHIN_CUT * (erf_approx(high * 0.70710678118) - erf_approx(low * 0.70710678118)), 0.0);
}

void main() {
    for (uint p = gl_WorkGroupID.x; p < push.n_particles; p += gl_NumWorkGroups.x) {
        Placed blob = placed[p];
        float sigma = blob.sigma;
        float mass = particles[p].kappa * MASS_FACTOR * sigma * sigma * sigma;
        vec3 x = blob.position - push.grid.low;
        ivec3 last = ivec3(push.grid.n_cells) - 1;
        ivec3 begin = clamp(ivec3(floor((x - CUT_SIGMA * sigma) * push.grid.inv_cell)), ivec3(0), last);
        ivec3 end = clamp(ivec3(floor((x + CUT_SIGMA * sigma) * push.grid.inv_cell)), begin, last);
        if (mass > 0.0) {
            for (int axis = 0; axis < 3; ++axis) {
                for (int i = begin[axis] + int(gl_LocalInvocationID.x); i <= end[axis]; i += int(gl_WorkGroupSize.x)) {
                    float a = (float(i) * push.grid.cell - x[axis]) / sigma;
                    float b = (float(i + 1) * push.grid.cell - x[axis]) / sigma;
                    weights[axis][i - begin[axis]] = weight(a, b);
                }
            }
        }
        barrier();
        ivec3 n = end - begin + 1;
        int n_cells = mass > 0.0 ? n.x * n.y * n.z : 0;
        for (int k = int(gl_LocalInvocationID.x); k < n_cells; k += int(gl_WorkGroupSize.x)) {
            ivec3 i = ivec3(k % n.x, (k / n.x) % n.y, k / (n.x * n.y));
            float share = weights[0][i.x] * weights[1][i.y] * weights[2][i.z];
            uint quanta = uint(mass * push.quanta_per_mass * share + 0.5);
            ivec3 at = begin + i;
            int cell = at.x + int(push.grid.n_cells.x) * (at.y + int(push.grid.n_cells.y) * at.z);
            if (quanta > 0) {
                uint before = atomicAdd(sums[2 * cell], quanta);
                if (before + quanta < before) {
                    atomicAdd(sums[2 * cell + 1], 1u);
                }
            }
        }
        barrier();
    }
}
