// Stable radix sort, DIGIT_BITS bits a pass (passes.md "sort"). A workgroup owns a
// tile of 1024 entries, each invocation a run of consecutive ones, so that order inside a tile is
// the order of (invocation, iteration). Fewer invocations have fewer counters to clear and sum: the
// host asks for one subgroup, 32 at most.

#include "buffers.glsl"

#ifndef TILE_INVOCATIONS
#define TILE_INVOCATIONS 32
#endif

#ifndef DIGIT_BITS
#define DIGIT_BITS 8
#endif

const uint TILE = 1024;
const uint RUN = TILE / TILE_INVOCATIONS;
const uint N_DIGITS = 1 << DIGIT_BITS;

// i_count: the word of n_counted that holds the number of entries; NO_COUNT where the host knows
// the number.
layout(push_constant) uniform Push {
    uint n_entries;
    uint i_count;
    uint shift;
} push;
READS(0, uint, n_counted)

const uint NO_COUNT = 0xFFFFFFFFu;

uint n_entries() { return push.i_count == NO_COUNT ? push.n_entries : n_counted[push.i_count]; }
uint n_tiles() { return (n_entries() + TILE - 1u) / TILE; }

uint digit_of(uint key) { return (key >> push.shift) & (N_DIGITS - 1u); }
