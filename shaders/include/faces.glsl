// Light of surfaces and ground on the faces of the grid's box (model.md §18). Needs patches.glsl,
// and with SOLIDS the buffer `faces`: irradiance by patch.

#if SOLIDS
// Returns the light of surfaces and ground at a face of a cell: bilinear between the patches.
vec3 of_solids(ivec3 at, uint axis, uint side) {
    uint u = (axis + 1u) % 3u, v = (axis + 2u) % 3u;
    vec3 part = (vec3(at) + 0.5) / vec3(push.grid.n_cells);
    vec2 k = clamp(vec2(part[u], part[v]) * float(PATCHES) - 0.5, 0.0, float(PATCHES - 1u));
    uvec2 base = min(uvec2(k), PATCHES - 1u), next = min(base + 1u, PATCHES - 1u);
    uint first = (2u * axis + side) * OF_FACE;
    vec2 t = k - vec2(base);
    vec3 low = mix(
        faces[first + base.y * PATCHES + base.x].rgb, faces[first + base.y * PATCHES + next.x].rgb,
        t.x
    );
    vec3 high = mix(
        faces[first + next.y * PATCHES + base.x].rgb, faces[first + next.y * PATCHES + next.x].rgb,
        t.x
    );
    return mix(low, high, t.y);
}
#else
#define of_solids(at, axis, side) vec3(0.0)
#endif
