#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "each.glsl"

// Splits the sorted entries into far ones and near ones (passes.md "impostors").
// In: entries (key, particle), placed particles. Out: the entries twice, with NO_PARTICLE in place
// of the near ones and of the far ones. Error: one dot product decides what is far.

// cut: least depth of a far particle along forward, relative to the lighting origin. is_new: 1
// tells far particles by their depths, 0 keeps the last decision.
layout(push_constant) uniform Push {
    vec3 forward;
    float cut;
    uint n_entries;
    uint is_new;
    uvec2 unused;
} push;
// (key, particle)
READS(0, uvec2, entries)
// By particle, whether it is in the shell.
UPDATES(1, uint, members)
WRITES(2, uvec2, far)
WRITES(3, uvec2, near)
TEXELS(4, placed)

void main() {
    FOR_EACH(k, push.n_entries) {
        uvec2 entry = entries[k];
        bool is_far = dot(push.forward, PLACED_AT(entry.y).position) >= push.cut;
        if (push.is_new != 0) {
            members[entry.y] = uint(is_far);
        } else {
            is_far = members[entry.y] != 0;
        }
        far[k] = uvec2(entry.x, is_far ? entry.y : NO_PARTICLE);
        near[k] = uvec2(entry.x, is_far ? NO_PARTICLE : entry.y);
    }
}
