// The faces of the box of the density grid in patches, through which light passes between the cells
// and surfaces or ground (model.md §18, passes.md "diffusion"). Needs records.glsl and light.glsl.

// Patches along each edge of a face.
const uint PATCHES = 8u;
const uint OF_FACE = PATCHES * PATCHES;
const uint N_PATCHES = 6u * OF_FACE;
const float PER_PI = 0.318309886183791;

struct Patch {
    vec3 center;
    vec3 outward;
    float area;
};

vec3 extent_of(Grid grid) {
    return grid.cell * vec3(1.0, grid.aspect, 1.0) * vec3(grid.n_cells);
}

// Returns patch i: by axis, lower and upper face, and along the next two axes.
Patch patch_at(Grid grid, uint i) {
    uint axis = i / (2u * OF_FACE), side = i / OF_FACE % 2u;
    uint u = (axis + 1u) % 3u, v = (axis + 2u) % 3u;
    vec3 part, outward = vec3(0.0), extent = extent_of(grid);
    part[axis] = float(side);
    part[u] = (float(i % PATCHES) + 0.5) / float(PATCHES);
    part[v] = (float(i / PATCHES % PATCHES) + 0.5) / float(PATCHES);
    outward[axis] = side == 1u ? 1.0 : -1.0;
    return Patch(grid.low + part * extent, outward, extent[u] * extent[v] / float(OF_FACE));
}

// Returns what of the light that leaves a small area evenly arrives, by its irradiance: A cos cos/
// (pi d^2), at most 1. `offset` leads from the receiver to the area.
float share_between(vec3 offset, vec3 normal_from, float area, vec3 normal_to) {
    float inverse = 1.0 / dot(offset, offset);
    float a = dot(offset, normal_to), b = -dot(offset, normal_from);
    return a > 0.0 && b > 0.0 ? min(area * (a * inverse) * (b * inverse) * PER_PI, 1.0) : 0.0;
}
