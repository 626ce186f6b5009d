#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "grid_narrow.glsl"
#include "each.glsl"

// Deposits balls, in cells, of some cells narrower than they are; grid_blur.comp makes them as
// wide (passes.md "grid"). It is run where there are many. In: placed particles (lengths), kappa
// (1/length). Out: fixed-point sums of mass by number of blurs and cell, 64 bits. Law: along each
// axis the quadratic B-spline, whose variance is 1/4 cell², in three cells. The mass is dealt to
// two numbers of blurs, so that the variance is that of the blob in its cells. Error: half a
// quantum a deposit, and some roundings.

layout(push_constant) uniform Push {
    Grid grid;
    uint n_particles;
    float quanta_per_mass;
    // Greatest number of blurs.
    uint n_blurs;
} push;
TEXELS(0, placed)
TEXELS(1, particles)
// Cell c after so many blurs from FIRST_BLUR on: low word at 2c, high word at 2c + 1.
UPDATES(2, uint, sums)

// (2 pi)^(3/2)
const float MASS_FACTOR = 15.7496099457224;
// The least number of blurs that a blob needs.
const uint FIRST_BLUR = 2;

void main() {
    FOR_EACH(p, push.n_particles) {
        Placed blob = PLACED_AT(p);
        Particle particle = PARTICLE_AT(p);
        vec3 at = place_in_cells(push.grid, blob.position);
        float mass = particle.kappa * MASS_FACTOR * blob.sigma * blob.sigma * blob.sigma
            * particle.aspect;
        if (mass > 0.0 && is_narrowed(push.grid, blob.sigma, at)) {
            // A blob in its cells has the variance sigma² + 1/12, of which the spline has 1/4. A
            // blur adds 1/2.
            float across = blob.sigma * push.grid.inv_cell;
            float steps = 2.0 * across * across - 1.0 / 3.0;
            uint step = min(uint(steps), push.n_blurs - 1u);
            float more = clamp(steps - float(step), 0.0, 1.0);
            uvec3 own = uvec3(at);
            vec3 f = at - vec3(own) - 0.5;
            vec3 before = 0.5 * (f - 0.5) * (f - 0.5), after = 0.5 * (f + 0.5) * (f + 0.5);
            mat3 weights = mat3(before, 0.75 - f * f, after);
            uint row = push.grid.n_cells.x, layer = row * push.grid.n_cells.y;
            uint n_cells = layer * push.grid.n_cells.z;
            uint first = own.x - 1u + row * (own.y - 1u) + layer * (own.z - 1u);
            float quanta_of_blob = mass * push.quanta_per_mass;
            for (uint k = 0; k < 54u; ++k) {
                uint x = k % 3u, y = k / 3u % 3u, z = k / 9u % 3u, is_more = k / 27u;
                float share = weights[x].x * weights[y].y * weights[z].z;
                share *= is_more == 1u ? more : 1.0 - more;
                uint cell = (step + is_more - FIRST_BLUR) * n_cells;
                cell += first + x + row * y + layer * z;
                uint quanta = uint(quanta_of_blob * share + 0.5);
                if (quanta > 0u) {
                    uint sum = atomicAdd(sums[2u * cell], quanta);
                    if (sum + quanta < sum) {
                        atomicAdd(sums[2u * cell + 1u], 1u);
                    }
                }
            }
        }
    }
}
