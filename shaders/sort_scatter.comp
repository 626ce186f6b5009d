#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "sort.glsl"
#include "one_subgroup.glsl"
// 1: the invocations find equal digits by ballots, which take 1 KiB of shared memory. 0: by
// counters of their own, which a CPU visits faster.
#ifndef BALLOT
#define BALLOT 0
#endif
#if BALLOT
#extension GL_KHR_shader_subgroup_ballot : require
#endif

// Moves every entry to its place: the table's base for (digit, tile) plus its rank among its digit
// inside the tile (passes.md "sort").
// In: entries and the scanned table. Out: entries sorted by one digit; stable.

layout(local_size_x = TILE_INVOCATIONS) in;

READS(1, uvec2, entries)
READS(2, uint, table)
WRITES(3, uvec2, entries_sorted)

#if BALLOT
// Place of the next entry of each digit.
shared uint places[N_DIGITS];

// Moves the entries of a tile in their order, one for each invocation at a time. The rank of an
// entry is the number of invocations before it that hold the same digit.
void scatter(uint tile, uint n, uint n_tiles) {
    uint t = lane();
    for (uint d = t; d < N_DIGITS; d += TILE_INVOCATIONS) {
        places[d] = table[d * n_tiles + tile];
    }
    wait_for_all();
    for (uint j = 0; j < RUN; ++j) {
        uint i = tile * TILE + j * TILE_INVOCATIONS + t;
        bool is_entry = i < n;
        uvec2 entry = is_entry ? entries[i] : uvec2(0);
        uint d = digit_of(entry.x);
        uvec4 same = subgroupBallot(is_entry);
        for (uint bit = 0; bit < DIGIT_BITS; ++bit) {
            bool is_set = (d >> bit & 1u) == 1u;
            uvec4 set = subgroupBallot(is_set);
            same &= is_set ? set : ~set;
        }
        uint rank = subgroupBallotExclusiveBitCount(same);
        uint place = places[d];
        wait_for_all();
        if (is_entry) {
            entries_sorted[place + rank] = entry;
            if (rank == 0) {
                places[d] = place + subgroupBallotBitCount(same);
            }
        }
        wait_for_all();
    }
}
#else
// Counters of two digits a word: word w of invocation t at [w * TILE_INVOCATIONS + t]. They take 16
// KiB for 32 invocations, which every Vulkan device has; a tile's 1024 entries fit 16 bits.
shared uint ranks[N_DIGITS / 2 * TILE_INVOCATIONS];

void scatter(uint tile, uint n, uint n_tiles) {
    uint t = gl_LocalInvocationID.x;
    uint first = tile * TILE + t * RUN;
    uint n_run = first < n ? min(RUN, n - first) : 0u;
    for (uint w = 0; w < N_DIGITS / 2; ++w) {
        ranks[w * TILE_INVOCATIONS + t] = 0;
    }
    for (uint j = 0; j < n_run; ++j) {
        uint d = digit_of(entries[first + j].x);
        ranks[(d >> 1) * TILE_INVOCATIONS + t] += 1u << (16 * (d & 1));
    }
    wait_for_all();
    for (uint w = t; w < N_DIGITS / 2; w += TILE_INVOCATIONS) {
        uint before = 0;
        for (uint k = 0; k < TILE_INVOCATIONS; ++k) {
            uint count = ranks[w * TILE_INVOCATIONS + k];
            ranks[w * TILE_INVOCATIONS + k] = before;
            before += count;
        }
    }
    wait_for_all();
    for (uint j = 0; j < n_run; ++j) {
        uvec2 entry = entries[first + j];
        uint d = digit_of(entry.x);
        uint word = (d >> 1) * TILE_INVOCATIONS + t;
        uint rank = (ranks[word] >> (16 * (d & 1))) & 0xffffu;
        ranks[word] += 1u << (16 * (d & 1));
        entries_sorted[table[d * n_tiles + tile] + rank] = entry;
    }
    wait_for_all();
}
#endif

void main() {
    uint n = n_entries(), n_tiles = n_tiles();
    for (uint tile = gl_WorkGroupID.x; tile < n_tiles; tile += gl_NumWorkGroups.x) {
        scatter(tile, n, n_tiles);
    }
}
