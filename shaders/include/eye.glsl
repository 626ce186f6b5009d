// The direction from cells to the eye (model.md §18).

// Returns the way from a cell's middle to the eye.
vec3 way_to_eye(Grid grid, ivec3 at, vec3 eye) {
    return eye - grid.low - grid.cell * vec3(1.0, grid.aspect, 1.0) * (vec3(at) + 0.5);
}

// Returns its direction, up where the eye is.
vec3 toward_eye(Grid grid, ivec3 at, vec3 eye) {
    vec3 way = way_to_eye(grid, at, eye);
    return dot(way, way) > 0.0 ? normalize(way) : vec3(0.0, 1.0, 0.0);
}
