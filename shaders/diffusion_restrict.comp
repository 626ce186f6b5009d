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
#define PHI(at) uintBitsToFloat(TEXEL(before, index_of(push.fine, at))).rgb
#include "equations.glsl"

// Returns the sum of the factors of phi in a cell's equation.
vec3 diagonal(Level level, ivec3 at) {
    int c = index_of(level, at);
    ivec3 stride = strides_of(level);
    FACTORS own = factors(c);
    vec3 sum = factor(own, 0) + factor(own, 1) + factor(own, 2) + factor(own, 3);
    for (int axis = 0; axis < 3; ++axis) {
        if (at[axis] > 0) {
            sum += factor(factors(c - stride[axis]), axis);
        }
    }
    return sum;
}

void main() {
    Level coarse = push.coarse;
    FOR_EACH(i, coarse.n_cells.x * coarse.n_cells.y * coarse.n_cells.z) {
        ivec3 at = place_of(coarse, i), halved = ivec3(push.halved);
        ivec3 first = at << halved;
        ivec3 end = min(first + 1 + halved, ivec3(push.fine.n_cells));
        vec3 left = vec3(0.0);
        for (int z = first.z; z < end.z; ++z) {
            for (int y = first.y; y < end.y; ++y) {
                for (int x = first.x; x < end.x; ++x) {
                    ivec3 from = ivec3(x, y, z);
                    vec3 flows, all;
                    around(push.fine, from, PHI(from), flows, all);
                    left += source[index_of(push.fine, from)].rgb + flows;
                }
            }
        }
        int k = index_of(coarse, at);
        source[k] = vec4(left, 0.0);
        after[k] = vec4(LONG_STEP * left / diagonal(coarse, at), 0.0);
    }
}
