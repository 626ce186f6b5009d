// Trilinear density between cell centres, 0 outside their hull (docs/model.md, "sample"). Needs `Grid grid` in the push
// constants and `samplerBuffer density`.

float cell_at(int c) { return texelFetch(density, c).x; }

float density_at(vec3 p) {
    vec3 g = (p - push.grid.low) * push.grid.inv_cell - 0.5;
    vec3 base = floor(g);
    ivec3 i = ivec3(base);
    ivec3 n = ivec3(push.grid.n_cells);
    if (any(lessThan(i, ivec3(0))) || any(greaterThanEqual(i, n - 1))) {
        return 0.0;
    }
    vec3 f = g - base;
    int row = n.x, layer = n.x * n.y;
    int c = i.x + row * i.y + layer * i.z;
    vec4 low = vec4(cell_at(c), cell_at(c + row), cell_at(c + layer), cell_at(c + layer + row));
    vec4 high = vec4(cell_at(c + 1), cell_at(c + row + 1), cell_at(c + layer + 1), cell_at(c + layer + row + 1));
    vec4 x = mix(low, high, f.x);
    vec2 y = mix(x.xz, x.yw, f.y);
    return mix(y.x, y.y, f.z);
}
