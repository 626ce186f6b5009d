// Stable radix sort, 8 bits a pass. A workgroup owns a tile of 1024 entries, each invocation a run of consecutive ones, so
// that order inside a tile is the order of (invocation, turn). The fewer invocations, the fewer counters to clear and sum:
// the host asks for one subgroup, 32 at most.

#ifndef TILE_INVOCATIONS
#define TILE_INVOCATIONS 32
#endif

const uint TILE = 1024;
const uint RUN = TILE / TILE_INVOCATIONS;
const uint N_DIGITS = 256;

layout(push_constant) uniform Push { uint n_entries; uint n_tiles; uint shift; } push;

uint digit_of(uint key) { return (key >> push.shift) & (N_DIGITS - 1u); }
