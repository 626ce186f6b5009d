#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"

// Reads, writes or copies elements of 16 bytes, for the bandwidth of `nimbus devices --roof` and
// for the cold caches of `nimbus bench --cold`.
// Each workgroup passes over a block of push.n_block times 64 elements, then over the next one,
// push.n_repeat blocks in all; behind the last element follows the first. Element i is written as
// 4 i + (0, 1, 2, 3) + push.salt, so that sums over the elements are known.

// 0: read as elements of a storage buffer; 1: read as texels; 2: write; 3: copy.
#ifndef MODE
#define MODE 0
#endif

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    uint last;
    uint n_block;
    uint n_repeat;
    uint salt;
} push;

#if MODE == 0
READS(0, uvec4, from)
// By invocation: the sum of the elements that it has read.
WRITES(1, uvec4, sums)
#elif MODE == 1
TEXELS(0, from)
WRITES(1, uvec4, sums)
#elif MODE == 2
WRITES(0, uvec4, to)
#else
READS(0, uvec4, from)
WRITES(1, uvec4, to)
#endif

void main() {
    uint group = gl_WorkGroupID.x, lane = gl_LocalInvocationID.x;
    uvec4 sum = uvec4(0u);
    for (uint r = 0; r < push.n_repeat; ++r) {
        uint first = (group + r) * push.n_block * 64u + lane;
        for (uint k = 0; k < push.n_block; ++k) {
            uint i = (first + 64u * k) & push.last;
#if MODE == 0
            sum += from[i];
#elif MODE == 1
            sum += TEXEL(from, int(i));
#elif MODE == 2
            to[i] = 4u * i + uvec4(0u, 1u, 2u, 3u) + push.salt;
#else
            to[i] = from[i];
#endif
        }
    }
#if MODE < 2
    sums[group * 64u + lane] = sum;
#endif
}
