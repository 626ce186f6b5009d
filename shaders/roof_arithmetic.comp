#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "buffers.glsl"

// Multiplies and adds in independent chains, for the arithmetic of `nimbus devices --roof`. Twelve
// chains an invocation cover the latency of a multiplication and a sum on a processor that begins
// two a cycle, and its sixteen registers hold them. Vectors of 64-bit numbers take two registers,
// so that eight chains do.
// A step is x = a x + b. The host passes a = b = 1, which the compiler does not know. Each chain
// then ends at its start plus the number of steps, exactly in every format.

// 0: f32; 1: f64; 2: f16; 3: 32-bit integers; 4: 64-bit integers.
#ifndef KIND
#define KIND 0
#endif

// 1: twelve chains, 0: eight.
#define IS_WIDE (KIND == 0 || KIND == 2 || KIND == 3)

#if KIND == 0
#define FOUR vec4
#define ONE float
#elif KIND == 1
#define FOUR dvec4
#define ONE double
#elif KIND == 2
#extension GL_EXT_shader_explicit_arithmetic_types_float16 : require
#define FOUR f16vec4
#define ONE float16_t
#elif KIND == 3
#define FOUR uvec4
#define ONE uint
#else
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#define FOUR u64vec4
#define ONE uint64_t
#endif
#if KIND < 3
#define STEP(x) fma(x, a, b)
#else
#define STEP(x) (x * a + b)
#endif

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    // Loops of 16 steps.
    uint n_loops;
    uint a;
    uint b;
} push;

// By invocation: the sum of the ends of its chains.
WRITES(0, uint, sums)

void main() {
    FOUR a = FOUR(ONE(push.a)), b = FOUR(ONE(push.b));
    // Starts differ between invocations, so that no compiler takes them for one.
    FOUR x = FOUR(0, 1, 2, 3) + FOUR(ONE(gl_LocalInvocationID.x & 7u)), y = x + FOUR(ONE(4));
#if IS_WIDE
    FOUR z = x + FOUR(ONE(8));
#endif
    for (uint i = 0; i < push.n_loops; ++i) {
        [[unroll]] for (uint k = 0; k < 16; ++k) {
            x = STEP(x);
            y = STEP(y);
#if IS_WIDE
            z = STEP(z);
#endif
        }
    }
    uvec4 ends = uvec4(x) + uvec4(y);
#if IS_WIDE
    ends += uvec4(z);
#endif
    sums[gl_WorkGroupID.x * 64u + gl_LocalInvocationID.x] = ends.x + ends.y + ends.z + ends.w;
}
