#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Merges the equations of cells to those of a coarser grid (passes.md "diffusion").
// In, out: operators.

layout(push_constant) uniform Push {
    Level fine;
    Level coarse;
    // 1 along the axes that are halved.
    uvec3 halved;
    uint n_all;
} push;
UPDATES(0, vec4, operators)
#define OPERATOR(k) operators[k]
#include "equations.glsl"

void main() {
    Level coarse = push.coarse;
    FOR_EACH(i, n_total(coarse)) {
        ivec3 at = place_of(coarse, i);
        for (int set = 0; set < N_SETS; ++set) {
            vec4 merged = merged_operator(push.fine, ivec3(push.halved), at, set);
            operators[index_of(coarse, at) + set * int(push.n_all)] = merged;
        }
    }
}
