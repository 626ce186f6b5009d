#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "tiles.glsl"
#include "each.glsl"

// Clears the state of all pixels where one round is not enough (passes.md "tiles"). Out: fours of
// floats, all 0.

layout(push_constant) uniform Push {
    uint n_fours;
    uint unused;
} push;
READS(0, Round, rounds)
WRITES(1, vec4, state)

void main() {
    if (rounds[0].bins.w == 0) {
        return;
    }
    FOR_EACH(i, push.n_fours) { state[i] = vec4(0.0); }
}
