#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "tiles.glsl"
#include "each.glsl"

// Nothing drawn yet, in every pixel; where one round is not enough.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { uint n_pixels; uint unused; } push;
layout(std430, binding = 0) readonly buffer Rounds { Round rounds[]; };
layout(std430, binding = 1) writeonly buffer State { vec4 state[]; };

void main() {
    if (rounds[0].bins.w == 0) {
        return;
    }
    FOR_EACH(i, push.n_pixels) {
        state[i] = vec4(0.0);
    }
}
