#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "cull.glsl"
#define SCANNED 256
#include "scan.glsl"

// Scans the tiles' counts of kept particles (passes.md "cull"). One workgroup;
// each invocation owns a run of tiles. In: kept particles of each tile. Out: kept particles before
// each tile, and the Kept record with the dispatch and draw sizes of the passes to come. Exact:
// integers.

layout(local_size_x = SCANNED) in;

layout(push_constant) uniform Push {
    uint n_tiles;
    uint sort_tile;
    uint splat_block;
    uint max_groups;
} push;
// In: kept particles of each tile. Out: kept particles of the tiles before it.
UPDATES(0, uint, n_kept)
WRITES(1, Kept, kept)

uint groups(uint n, uint size) { return min((n + size - 1u) / size, push.max_groups); }

void main() {
    uint t = gl_LocalInvocationID.x;
    uint run = (push.n_tiles + SCANNED - 1u) / SCANNED;
    uint first = min(t * run, push.n_tiles), end = min(first + run, push.n_tiles);
    uint total = 0;
    for (uint tile = first; tile < end; ++tile) {
        total += n_kept[tile];
    }
    uint before = sum_before(total);
    for (uint tile = first; tile < end; ++tile) {
        uint n = n_kept[tile];
        n_kept[tile] = before;
        before += n;
    }
    // The last invocation has added up all tiles.
    if (t == SCANNED - 1u) {
        uint n = before;
        kept[0].sort = uvec4(groups(n, push.sort_tile), 1, 1, n);
        kept[0].draw = uvec4(4, n, 0, 0);
        kept[0].splat = uvec4(groups(n, push.splat_block), 1, 1, 0);
        kept[0].points = uvec4(n, 1, 0, 0);
    }
}
