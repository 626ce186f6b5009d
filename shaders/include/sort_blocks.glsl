// Blocks of the sort's table, digit by digit in the order of its tiles, which a workgroup scans.
// Needs sort.glsl.

const uint INVOCATIONS = 256;
// Consecutive counts of an invocation.
const uint COUNTS_EACH = 8;
const uint COUNTS_OF_BLOCK = INVOCATIONS * COUNTS_EACH;

layout(local_size_x = INVOCATIONS) in;

#define SCANNED INVOCATIONS
#include "scan.glsl"

uint n_counts() { return N_DIGITS * n_tiles(); }
uint n_blocks() { return (n_counts() + COUNTS_OF_BLOCK - 1) / COUNTS_OF_BLOCK; }
uint first_of(uint block) { return block * COUNTS_OF_BLOCK + gl_LocalInvocationID.x * COUNTS_EACH; }
