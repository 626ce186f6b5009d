#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Entries near to far, in chunks of equal numbers, and each chunk's draw (docs/model.md §11
// "chunks").

layout(local_size_x = 64) in;

// `stride`: places of a chunk, no fewer than it can have entries.
layout(push_constant) uniform Push { uint n_chunks; uint stride; } push;
// (key, particle), far to near.
layout(std430, binding = 0) readonly buffer Entries { uvec2 entries[]; };
layout(std430, binding = 1) readonly buffer KeptOnes { Kept kept[]; };
layout(std430, binding = 2) writeonly buffer Nearest { uvec2 nearest[]; };
// Vertices, instances, 0, 0.
layout(std430, binding = 3) writeonly buffer Draws { uvec4 draws[]; };

void main() {
    uint n = kept[0].sort.w;
    uint size = (n + push.n_chunks - 1u) / push.n_chunks;
    FOR_EACH(i, n) {
        nearest[i / size * push.stride + i % size] = entries[n - 1u - i];
    }
    FOR_EACH(c, push.n_chunks) {
        uint before = min(c * size, n);
        draws[c] = uvec4(4u, min(size, n - before), 0u, 0u);
    }
}
