#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Moves every phi toward the solution of its own equation (passes.md "diffusion").
// In: operators, right-hand sides, phi; with CORRECTED phi of the coarser grid, which is added to
// it first. Out: phi.

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
#define OPERATOR(k) uintBitsToFloat(TEXEL(operators, k))
#define SOURCE(k) uintBitsToFloat(TEXEL(source, k)).rgb
#define phi_of(level, at) uintBitsToFloat(TEXEL(before, index_of(level, at))).rgb
#if CORRECTED
#define PHI(level, at) (phi_of(level, at) + phi_of(push.coarse, (at) >> added_axes()))
#else
#define PHI(level, at) phi_of(level, at)
#endif
ivec3 added_axes() { return ivec3(push.halved); }

#include "equations.glsl"

void main() {
    Level level = push.level;
    FOR_EACH(i, n_total(level)) {
        ivec3 at = place_of(level, i);
        float step = push.is_long != 0u ? LONG_STEP : SHORT_STEP;
        after[index_of(level, at)] = vec4(swept(level, at, step), 0.0);
    }
}
