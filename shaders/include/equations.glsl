// The equations of cells: sum w (phi - phi_n) + sink phi = source. Needs diffusion.glsl,
// `operators` [set][cell] (w toward the next cell along each axis, and sink) and `phi`, and n_all in
// the push constants: the cells of all levels.

// Returns component k of the equations of cell c, by channel.
vec3 factors(int c, int k) {
#if N_SETS == 3
    int n = int(push.n_all);
    return vec3(operators[c][k], operators[c + n][k], operators[c + 2 * n][k]);
#else
    return vec3(operators[c][k]);
#endif
}

// Sets `flows` to sum w phi_n over the neighbours of a cell, and `all` to the sum of w and sink.
void around(Level level, ivec3 at, out vec3 flows, out vec3 all) {
    int c = index_of(level, at);
    ivec3 stride = strides_of(level);
    flows = vec3(0.0);
    all = factors(c, 3);
    for (int axis = 0; axis < 3; ++axis) {
        if (at[axis] + 1 < int(level.n_cells[axis])) {
            vec3 w = factors(c, axis);
            flows += w * phi[c + stride[axis]].rgb;
            all += w;
        }
        if (at[axis] > 0) {
            vec3 w = factors(c - stride[axis], axis);
            flows += w * phi[c - stride[axis]].rgb;
            all += w;
        }
    }
}
