// How many turns the loops of a gather may take in one dispatch: some drivers end them after some
// ten thousand, without a word (src/frame/exchange.rs says how many). Counts are of invocations
// that take turns together.

// 1: invocations of a subgroup tell each other what they have counted.
#ifndef TOGETHER
#define TOGETHER 1
#endif
// After these no cell is quartered any more; what is left still has room to be finished.
#ifndef QUARTER_TURNS
#define QUARTER_TURNS 60000u
#endif
// After these no further source is looked at: the next dispatch goes on there.
#ifndef BATCH_TURNS
#define BATCH_TURNS 30000u
#endif
// Loops within a step and within a cell, but for those that count themselves.
#define STEP_TURNS (8u + 2u * N_LIGHTS)
#define CELL_TURNS (12u + 5u * N_LIGHTS)
// A receiver that has looked at all of its sources.
const uint DONE = 0xFFFFFFFFu;

// Turns that the loops of this dispatch have taken, of all invocations that take them together.
uint n_turns = 0u;

void count_together() {
#if TOGETHER
    n_turns = subgroupMax(n_turns);
#endif
}
