// The march through the density grid (passes.md "transmit"). Needs density.glsl and sum.glsl. The
// push constants have `Grid grid`, `float step_length` and `uint max_steps`.

// Returns where the ray from p along d enters and leaves the grid's box; the end is before the
// beginning where the ray misses the box.
WEIGHTS2 crossing(PLACE p, PLACE d, WEIGHT distance) {
    PLACE low = push.grid.low;
    PLACE high = low + cell_edges() * PLACE(push.grid.n_cells);
    WEIGHT enter = 0.0, leave = distance;
    for (int axis = 0; axis < 3; ++axis) {
        if (d[axis] != 0.0) {
            WEIGHT a = (low[axis] - p[axis]) / d[axis], b = (high[axis] - p[axis]) / d[axis];
            enter = max(enter, min(a, b));
            leave = min(leave, max(a, b));
        } else if (p[axis] < low[axis] || p[axis] > high[axis]) {
            leave = -1.0;
        }
    }
    return WEIGHTS2(enter, leave);
}

// Returns the optical depth from p along d, by midpoint samples. There is nothing to march for
// where the ray misses the box.
REAL depth_along(PLACE p, PLACE d, WEIGHT distance, bool is_wanted) {
    WEIGHTS2 part = crossing(p, d, distance);
    WEIGHT length_total = part.y - part.x;
    bool is_marched = is_wanted && length_total > 0.0;
    // Cubes take the step as it is: a unit vector's length is 1 but for its rounding.
    WEIGHT step_length =
        push.grid.aspect == 1.0 ? WEIGHT(push.step_length) : push.step_length / in_widths(d);
    uint n = is_marched ? clamp(uint(ceil(length_total / step_length)), 1u, push.max_steps) : 0u;
    SUM1 tau = EMPTY1;
    for (uint j = 0; j < n; ++j) {
        WEIGHT t0 = WEIGHT(j) * step_length;
        WEIGHT ds = min(step_length, length_total - t0);
        ADD(tau, density_at(p + (part.x + (t0 + 0.5 * ds)) * d) * ds);
    }
    return TOTAL(tau);
}
