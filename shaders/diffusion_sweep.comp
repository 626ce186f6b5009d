#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Solves the equation of every second cell for its own phi (passes.md "diffusion").
// In: operators, right-hand sides. In, out: phi. Law: Gauss and Seidel, the cells of one colour of a
// chessboard at once.

layout(push_constant) uniform Push {
    Level level;
    uint n_all;
    uint color;
} push;
READS(0, vec4, operators)
READS(1, vec4, source)
UPDATES(2, vec4, phi)
#include "equations.glsl"

void main() {
    Level level = push.level;
    uint n_row = (level.n_cells.x + 1u) / 2u;
    FOR_EACH(i, n_row * level.n_cells.y * level.n_cells.z) {
        uint row = i / n_row;
        uint y = row % level.n_cells.y, z = row / level.n_cells.y;
        uint x = 2u * (i - row * n_row) + (y + z + push.color) % 2u;
        if (x < level.n_cells.x) {
            ivec3 at = ivec3(x, y, z);
            int c = index_of(level, at);
            vec3 flows, all;
            around(level, at, flows, all);
            phi[c] = vec4((source[c].rgb + flows) / all, 0.0);
        }
    }
}
