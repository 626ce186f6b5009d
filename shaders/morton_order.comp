#version 460
#extension GL_GOOGLE_include_directive : require
#include "each.glsl"

// The indices of sorted entries: place to index (docs/model.md §11 "morton").

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { uint n_entries; } push;
layout(std430, binding = 0) readonly buffer Entries { uvec2 entries[]; };
layout(std430, binding = 1) writeonly buffer Order { uint order[]; };

void main() {
    FOR_EACH(k, push.n_entries) {
        order[k] = entries[k].y;
    }
}
