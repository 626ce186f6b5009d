// Splats that a tile has found wait in registers, one an invocation, until there are as many as
// invocations (passes.md "tiles"). For CPUs: llvmpipe reads and writes shared memory for one
// invocation after the other. Needs subgroup operations.

// They are composed from this number on.
const uint ENOUGH = INVOCATIONS;
// The waiting splats, in the order in which they were found, and those beyond as many as
// invocations.
uint waiting;
uint left_over;

// Moves splats by k invocations towards the first one where `by` has this bit.
void move_by(uint k, inout uint by, inout uint r) {
    uint from = min(lane() + k, INVOCATIONS - 1u);
    uint by_there = subgroupShuffle(by, from), there = subgroupShuffle(r, from);
    bool comes = (by_there & k) != 0;
    by = comes ? by_there : by;
    r = comes ? there : r;
}

// Appends the splats of the invocations that hit to the n that wait, in the order of invocations;
// returns the new number, below twice that of invocations.
uint append(uint n, bool hit, uint r) {
    uint t = lane();
    uvec4 hits = subgroupBallot(hit);
    // Each moves towards the first invocation by the number of those before it that missed: by 1 or
    // not, by 2 or not, and so on. No two meet, as their order stays. Copies that are left behind,
    // and those of the last invocation, are behind all that moved, and do not count.
    uint by = hit ? t - subgroupBallotExclusiveBitCount(hits) : 0u;
    // No loop: llvmpipe does not unroll one that doubles its counter, and counts its iterations.
    move_by(1, by, r);
    move_by(2, by, r);
    move_by(4, by, r);
    if (INVOCATIONS > 8) { move_by(8, by, r); }
    if (INVOCATIONS > 16) { move_by(16, by, r); }
    if (INVOCATIONS > 32) { move_by(32, by, r); }
    // Behind those that wait, and around the end.
    r = subgroupShuffle(r, (t - n) & (INVOCATIONS - 1u));
    waiting = t < n ? waiting : r;
    left_over = r;
    return n + subgroupBallotBitCount(hits);
}
