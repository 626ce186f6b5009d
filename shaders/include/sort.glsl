// Stable radix sort, 8 bits a pass. A workgroup of 32 invocations owns a tile of 1024 entries, each invocation 32
// consecutive ones, so that order inside a tile is the order of (invocation, turn).

const uint TILE_INVOCATIONS = 32;
const uint RUN = 32;
const uint TILE = TILE_INVOCATIONS * RUN;
const uint N_DIGITS = 256;

layout(push_constant) uniform Push { uint n_entries; uint n_tiles; uint shift; } push;

uint digit_of(uint key) { return (key >> push.shift) & (N_DIGITS - 1u); }
