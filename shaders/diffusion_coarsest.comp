#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "diffusion.glsl"

// Solves the equations of the coarsest grid by sweeps in one workgroup (passes.md "diffusion").
// In: operators, right-hand sides. Out: phi. Law: Gauss and Seidel, the cells of one colour of a
// chessboard at once, from phi = 0.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    Level level;
    uint n_all;
    uint n_sweeps;
} push;
TEXELS(0, operators)
READS(1, vec4, source)
UPDATES(2, vec4, phi)
#define PHI(at) phi[index_of(push.level, at)].rgb
#include "equations.glsl"

void main() {
    Level level = push.level;
    uint c = gl_LocalInvocationID.x;
    bool is_cell = c < level.n_cells.x * level.n_cells.y * level.n_cells.z;
    ivec3 at = place_of(level, c);
    int k = index_of(level, at);
    if (is_cell) {
        phi[k] = vec4(0.0);
    }
    for (uint i = 0; i < 2u * push.n_sweeps; ++i) {
        memoryBarrierBuffer();
        barrier();
        if (is_cell && (uint(at.x + at.y + at.z) + i) % 2u == 0u) {
            vec3 own = phi[k].rgb, flows, all;
            around(level, at, own, flows, all);
            phi[k] = vec4(own + (source[k].rgb + flows) / all, 0.0);
        }
    }
}
