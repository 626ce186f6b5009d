#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// The sorted entries once with what is far alone, once with what is near (docs/model.md §11
// "impostors").

layout(local_size_x = 64) in;

// last_key: of what is far; is_new: who is far is said anew by the keys, else it is what it was.
layout(push_constant) uniform Push { uint n_entries; uint last_key; uint is_new; uint unused; } push;
// (key, particle)
layout(std430, binding = 0) readonly buffer Entries { uvec2 entries[]; };
// By particle whether it is in the shell.
layout(std430, binding = 1) buffer Members { uint members[]; };
layout(std430, binding = 2) writeonly buffer Far { uvec2 far[]; };
layout(std430, binding = 3) writeonly buffer Near { uvec2 near[]; };

void main() {
    FOR_EACH(k, push.n_entries) {
        uvec2 entry = entries[k];
        bool is_far = entry.x <= push.last_key;
        if (push.is_new != 0) {
            members[entry.y] = uint(is_far);
        } else {
            is_far = members[entry.y] != 0;
        }
        far[k] = uvec2(entry.x, is_far ? entry.y : NO_PARTICLE);
        near[k] = uvec2(entry.x, is_far ? NO_PARTICLE : entry.y);
    }
}
