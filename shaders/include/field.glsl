// Places between the centres of the grid's cells, for values that are trilinear there and beyond
// the outermost centres as on them (model.md §18).

struct Weights {
    ivec3 base;
    vec3 part;
};

struct Corner {
    int i_cell;
    float share;
};

// Returns those at a place in cells from the centre of the first one.
Weights weights_among(ivec3 n, vec3 at) {
    at = clamp(at, vec3(0.0), vec3(n - 1));
    ivec3 base = ivec3(at);
    return Weights(base, at - vec3(base));
}

Weights weights_at(Grid grid, vec3 p) {
    vec3 at = (p - grid.low) * grid.inv_cell * vec3(1.0, grid.inv_aspect, 1.0) - 0.5;
    return weights_among(ivec3(grid.n_cells), at);
}

// Returns one of the 8 cells around, and its share.
Corner corner_of(ivec3 n, Weights of, int corner) {
    ivec3 to = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
    vec3 share = mix(1.0 - of.part, of.part, equal(to, ivec3(1)));
    ivec3 i = min(of.base + to, n - 1);
    return Corner(i.x + n.x * (i.y + n.y * i.z), share.x * share.y * share.z);
}
