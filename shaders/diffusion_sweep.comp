#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Moves every phi toward the solution of its own equation (passes.md "diffusion").
// In: operators, right-hand sides, phi; with CORRECTED phi of the coarser grid, which is added to
// it first. Out: phi. Law: Jacobi's, phi + step (source - A phi)/diagonal.

#ifndef CORRECTED
#define CORRECTED 0
#endif

layout(push_constant) uniform Push {
    Level level;
    Level coarse;
    // 1 along the axes that are halved.
    uvec3 halved;
    uint n_all;
    uint is_long;
} push;
TEXELS(0, operators)
TEXELS(1, source)
TEXELS(2, before)
WRITES(3, vec4, after)
#if CORRECTED
// Phi of the coarser grid.
#define PHI(at) (phi_of(before, push.level, at) + phi_of(before, push.coarse, (at) >> halved()))
#else
#define PHI(at) phi_of(before, push.level, at)
#endif
#define phi_of(name, level, at) uintBitsToFloat(TEXEL(name, index_of(level, at))).rgb
ivec3 halved() { return ivec3(push.halved); }

#include "equations.glsl"

void main() {
    Level level = push.level;
    FOR_EACH(i, level.n_cells.x * level.n_cells.y * level.n_cells.z) {
        ivec3 at = place_of(level, i);
        int c = index_of(level, at);
        vec3 own = PHI(at), flows, all;
        around(level, at, own, flows, all);
        vec3 right = uintBitsToFloat(TEXEL(source, c)).rgb;
        float step = push.is_long != 0u ? LONG_STEP : SHORT_STEP;
        after[c] = vec4(own + step * (right + flows) / all, 0.0);
    }
}
