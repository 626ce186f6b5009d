// Whether light reaches a point past all surfaces (docs/model.md §11 "transmit"). Needs light.glsl, occlude.glsl and
// `Region regions[]`, the surfaces' first.

// Whether no surface but the point's own hides the light from p.
bool is_clear(vec3 p, Light light, uint i_own, uint n_surfaces) {
    for (uint i = 0; i < n_surfaces; ++i) {
        Region r = regions[i];
        if (i != i_own && (light.kind == LIGHT_POINT ? hides(r, p, light.position) : shades(r, p, light.toward))) {
            return false;
        }
    }
    return true;
}

// Sets of surfaces, kept in a float: surface i is in set i mod 24.
const uint N_SETS = 24u;

// How the light's way to the ball about p passes surface i: x, whether its middle is hidden; y, whether the shadow's rim
// runs through it.
bvec2 shadow_of(uint i, vec3 p, float radius, Light light) {
    Region r = regions[i];
    return light.kind == LIGHT_POINT ? hides_ball(r, light.position, p, radius) : shades_ball(r, p, light.toward, radius);
}

// Sets of the surfaces whose shadows' rims run through the ball; none where one surface hides all of it.
float rims_on(vec3 p, float radius, Light light, uint i_own, uint n_surfaces) {
    uint sets = 0u;
    bool hidden = false;
    for (uint i = 0u; i < n_surfaces; ++i) {
        bvec2 by = shadow_of(i, p, radius, light);
        hidden = hidden || (i != i_own && by.x && !by.y);
        sets |= i != i_own && by.y ? 1u << (i % N_SETS) : 0u;
    }
    return hidden ? 0.0 : float(sets);
}

// What surfaces of the sets hide of the ball: x, its middle; y, part of it.
bvec2 shadows_on(vec3 p, float radius, Light light, uint i_own, uint n_surfaces, float sets) {
    bvec2 found = bvec2(false);
    uint left = uint(sets);
    uint i = findLSB(left);
    while (left != 0u) {
        bvec2 by = shadow_of(i, p, radius, light);
        bool counts = i != i_own;
        found = bvec2(found.x || (counts && by.x), found.y || (counts && by.y));
        i += N_SETS;
        left = i < n_surfaces ? left : left & (left - 1u);
        i = i < n_surfaces ? i : findLSB(left);
    }
    return found;
}
