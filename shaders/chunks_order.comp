#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Reverses the sorted entries to near-to-far order and deals them to chunks of equal size
// (passes.md "chunks").
// In: n entries (key, particle), far to near. Out: the entries by chunk, and one indirect draw a
// chunk. Exact: it only copies.

// stride: room for the entries of a chunk, at least as many as it can have.
layout(push_constant) uniform Push {
    uint n_chunks;
    uint stride;
} push;
// (key, particle), far to near.
READS(0, uvec2, entries)
READS(1, Kept, kept)
WRITES(2, uvec2, nearest)
// Vertices, instances, 0, 0.
WRITES(3, uvec4, draws)

void main() {
    uint n = kept[0].sort.w;
    uint size = (n + push.n_chunks - 1u) / push.n_chunks;
    FOR_EACH(i, n) { nearest[i / size * push.stride + i % size] = entries[n - 1u - i]; }
    FOR_EACH(c, push.n_chunks) {
        uint before = min(c * size, n);
        draws[c] = uvec4(4u, min(size, n - before), 0u, 0u);
    }
}
