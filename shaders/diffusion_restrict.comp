#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Adds up what the equations of merged cells leave over, and begins to solve those of the coarser
// grid for it (passes.md "diffusion").
// In: operators, phi of the finer grid. In, out: right-hand sides. Out: phi of the coarser grid
// after a sweep from phi = 0.

layout(push_constant) uniform Push {
    Level fine;
    Level coarse;
    // 1 along the axes that are halved.
    uvec3 halved;
    uint n_all;
} push;
TEXELS(0, operators)
UPDATES(1, vec4, source)
TEXELS(2, before)
WRITES(3, vec4, after)
#define OPERATOR(k) uintBitsToFloat(TEXEL(operators, k))
#define SOURCE(k) source[k].rgb
#define PHI(level, at) uintBitsToFloat(TEXEL(before, index_of(level, at))).rgb
#include "equations.glsl"

void main() {
    Level coarse = push.coarse;
    FOR_EACH(i, n_total(coarse)) {
        ivec3 at = place_of(coarse, i);
        vec3 left = left_over(push.fine, ivec3(push.halved), at);
        int k = index_of(coarse, at);
        source[k] = vec4(left, 0.0);
        after[k] = vec4(LONG_STEP * left / diagonal(coarse, at), 0.0);
    }
}
