// Light of surfaces and ground on the faces of the grid's box (model.md §18). Needs patches.glsl,
// sectors.glsl, and with SOLIDS the buffer `faces`: by patch irradiance, and pi times the radiance
// of each sector.

#if SOLIDS
// Returns a number of the patches at a face of a cell: bilinear between them.
vec3 at_face_of(ivec3 at, uint axis, uint side, uint number) {
    uint u = (axis + 1u) % 3u, v = (axis + 2u) % 3u;
    vec3 part = (vec3(at) + 0.5) / vec3(push.grid.n_cells);
    vec2 k = clamp(vec2(part[u], part[v]) * float(PATCHES) - 0.5, 0.0, float(PATCHES - 1u));
    uvec2 base = min(uvec2(k), PATCHES - 1u), next = min(base + 1u, PATCHES - 1u);
    uint first = (2u * axis + side) * OF_FACE;
    uint low = first + base.y * PATCHES, high = first + next.y * PATCHES;
    vec2 t = k - vec2(base);
    vec3 of_low = mix(
        faces[(low + base.x) * OF_PATCH + number].rgb,
        faces[(low + next.x) * OF_PATCH + number].rgb, t.x
    );
    vec3 of_high = mix(
        faces[(high + base.x) * OF_PATCH + number].rgb,
        faces[(high + next.x) * OF_PATCH + number].rgb, t.x
    );
    return mix(of_low, of_high, t.y);
}

// Returns the irradiance of surfaces and ground at a face of a cell.
vec3 of_solids(ivec3 at, uint axis, uint side) { return at_face_of(at, axis, side, 0u); }

// Returns pi times their radiance from a sector.
vec3 of_sector(ivec3 at, uint axis, uint side, uint k) {
    return at_face_of(at, axis, side, 1u + k);
}

// Returns pi times their radiance from a direction, of which the share `above` comes from above the
// horizon.
vec3 between_sectors(ivec3 at, uint axis, uint side, vec3 d, float above) {
    vec3 positive = positive_of(d, axis, side);
    positive.y = axis == 1u ? positive.y : above;
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < N_DIRECTIONS; ++k) {
        float share = share_in(k, d, positive);
        if (share > 0.0) {
            sum += share * of_sector(at, axis, side, k);
        }
    }
    return sum;
}
#else
#define of_solids(at, axis, side) vec3(0.0)
#define of_sector(at, axis, side, k) vec3(0.0)
#define between_sectors(at, axis, side, d, above) vec3(0.0)
#endif
