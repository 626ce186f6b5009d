// Limits on the loop iterations of a gather in one dispatch: some drivers end loops after some ten
// thousand iterations without a message (src/frame/gather_lists.rs sets the limits). Invocations
// that run in step count together.

// 1: the invocations of a subgroup share their counts.
#ifndef TOGETHER
#define TOGETHER 1
#endif
// After these iterations no cell is split any more; what is left still has room to finish.
#ifndef SPLIT_ITERATIONS
#define SPLIT_ITERATIONS 60000u
#endif
// After these iterations no further source is looked at: the next dispatch continues there.
#ifndef BATCH_ITERATIONS
#define BATCH_ITERATIONS 30000u
#endif
// Iterations within a step and within a cell, except in loops that count themselves.
#define STEP_ITERATIONS (8u + 2u * N_LIGHTS)
#define CELL_ITERATIONS (12u + 5u * N_LIGHTS)
// Marks a receiver that has looked at all of its sources.
const uint DONE = 0xFFFFFFFFu;

// Iterations of this dispatch, over all invocations that run in step.
uint n_iterations = 0u;

void share_iteration_count() {
#if TOGETHER
    n_iterations = subgroupMax(n_iterations);
#endif
}
