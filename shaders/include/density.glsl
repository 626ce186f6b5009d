// Trilinear density between cell centres, 0 outside their hull (passes.md
// "sample"). Needs `Grid grid` in the push constants and `FLOATS density`.

// 1: places and weights are doubles.
#ifndef DEEP
#define DEEP 0
#endif
#if DEEP
#define PLACE dvec3
#define WEIGHT double
#define WEIGHTS2 dvec2
#define WEIGHTS4 dvec4
#define IN_CELLS(x) ((x) / double(push.grid.cell) * dvec3(1.0, push.grid.inv_aspect, 1.0))
#else
#define PLACE vec3
#define WEIGHT float
#define WEIGHTS2 vec2
#define WEIGHTS4 vec4
#define IN_CELLS(x) ((x) * push.grid.inv_cell * vec3(1.0, push.grid.inv_aspect, 1.0))
#endif

// Returns the edges of a cell.
PLACE cell_edges() { return push.grid.cell * PLACE(1.0, push.grid.aspect, 1.0); }

// Returns the length of d in widths of cells: 1 for a unit vector where cells are cubes.
WEIGHT in_widths(PLACE d) { return length(PLACE(d.x, d.y * push.grid.inv_aspect, d.z)); }

float cell_at(int c) { return FLOAT(density, c); }

WEIGHT density_at(PLACE p) {
    PLACE g = IN_CELLS(p - push.grid.low) - 0.5;
    PLACE base = floor(g);
    ivec3 i = ivec3(base);
    ivec3 n = ivec3(push.grid.n_cells);
    if (any(lessThan(i, ivec3(0))) || any(greaterThanEqual(i, n - 1))) {
        return 0.0;
    }
    PLACE f = g - base;
    int row = n.x, layer = n.x * n.y;
    int c = i.x + row * i.y + layer * i.z;
    WEIGHTS4 low =
        WEIGHTS4(cell_at(c), cell_at(c + row), cell_at(c + layer), cell_at(c + layer + row));
    WEIGHTS4 high = WEIGHTS4(
        cell_at(c + 1), cell_at(c + row + 1), cell_at(c + layer + 1), cell_at(c + layer + row + 1)
    );
    WEIGHTS4 x = mix(low, high, f.x);
    WEIGHTS2 y = mix(x.xz, x.yw, f.y);
    return mix(y.x, y.y, f.z);
}
