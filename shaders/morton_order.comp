#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"

// Extracts the indices of sorted entries: place to index (passes.md "morton").
// Exact: it only copies.

layout(push_constant) uniform Push { uint n_entries; } push;
READS(0, uvec2, entries)
WRITES(1, uint, order)

void main() {
    FOR_EACH(k, push.n_entries) { order[k] = entries[k].y; }
}
