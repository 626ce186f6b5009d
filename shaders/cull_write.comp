#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "depths.glsl"
#include "cull.glsl"
#include "each.glsl"

// Writes the sort keys of the kept particles, in ascending index and without gaps
// (passes.md "cull"). In: cull_test's masks and cull_scan's offsets. Out: entries
// (key, particle). Key: key.glsl.

READS(1, uvec2, masks)
// Kept particles of the tiles before.
READS(2, uint, n_before)
// (key, particle)
WRITES(3, uvec2, entries)

void main() {
    FOR_EACH(i, push.n_particles) {
        uvec2 mask = masks[i / 32u];
        uint bit = 1u << (i % 32u);
        if ((mask.x & bit) != 0u) {
            uint at = n_before[i / TILE] + mask.y + bitCount(mask.x & (bit - 1u));
            entries[at] = uvec2(key_at(i), i);
        }
    }
}
