#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"

// Adds 1 to counters, for the atomics of `nimbus devices --roof`. With push.last = 0 all
// invocations share one counter; otherwise neighbours have neighbouring counters.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    uint last;
    uint n_loops;
} push;

UPDATES(0, uint, counters)

void main() {
    uint i = (gl_WorkGroupID.x * 64u + gl_LocalInvocationID.x) & push.last;
    for (uint k = 0; k < push.n_loops; ++k) { atomicAdd(counters[i], 1u); }
}
