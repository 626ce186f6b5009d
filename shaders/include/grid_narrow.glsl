// Which blobs are deposited narrower than they are, and blurred to their size (passes.md "grid").
// Needs records.glsl.

// Least sigma in cells, and the sigma at which wider cells begin.
const float NARROW_SIGMA = 1.125;
const float NARROW_BELOW = 3.0;

// Returns whether a blob of `sigma` along x is one. `at` is its place in cells from the grid's low
// corner. Both kernels must say the same of a blob.
bool is_narrowed(Grid grid, float sigma, vec3 at) {
    precise float across = sigma * grid.inv_cell;
    return across >= NARROW_SIGMA && across < NARROW_BELOW
        && all(greaterThanEqual(at, vec3(1.0))) && all(lessThan(at, vec3(grid.n_cells - 1u)));
}

// Returns the place of a blob in cells from the grid's low corner.
vec3 place_in_cells(Grid grid, vec3 position) {
    precise vec3 inv_edges = grid.inv_cell * vec3(1.0, grid.inv_aspect, 1.0);
    precise vec3 at = (position - grid.low) * inv_edges;
    return at;
}
