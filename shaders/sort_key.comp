#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "depths.glsl"
#include "each.glsl"

// Computes the sort keys of the drawn particles from their view depth, or from their distance from
// the eye. Both are relative to that of the lighting origin. Ascending keys run far to near
// (passes.md "sort").
// In: placed particles; the first ones of each group are drawn. Out: entries (key, particle) in
// ascending index. Error: one dot product, or one length and a difference.

READS(1, uint, i_group)
READS(2, Drawn, drawn)
// (key, particle)
WRITES(3, uvec2, entries)

void main() {
    FOR_EACH(i, push.n_particles) {
        Drawn group = drawn[i_group[i]];
        if (i < group.end) {
            entries[i + group.shift] = uvec2(key_at(i), i);
        }
    }
}
