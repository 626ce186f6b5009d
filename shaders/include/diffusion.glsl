// The grids of the diffusion solver, one behind the other in the same buffers, the finest first
// (model.md §18, passes.md "diffusion").

// A grid: its cells along each axis, and the place of its first cell.
struct Level {
    uvec3 n_cells;
    uint i_first;
};

// The steps of a pair of sweeps: together they damp what two neighbours do not share best.
const float LONG_STEP = 1.6;
const float SHORT_STEP = 0.6;

// 3: channels have equations of their own; 1: one for all.
#ifndef N_SETS
#define N_SETS 1
#endif

uint n_total(Level level) { return level.n_cells.x * level.n_cells.y * level.n_cells.z; }

// Steps between cells along each axis.
ivec3 strides_of(Level level) {
    return ivec3(1, level.n_cells.x, level.n_cells.x * level.n_cells.y);
}

// Returns where cell c of a level lies.
ivec3 place_of(Level level, uint c) {
    uvec3 n = level.n_cells;
    uint row = c / n.x;
    return ivec3(c - row * n.x, row % n.y, row / n.y);
}

int index_of(Level level, ivec3 at) {
    return int(level.i_first) + at.x + int(level.n_cells.x) * (at.y + int(level.n_cells.y) * at.z);
}
