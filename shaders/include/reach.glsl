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

// The light's way to the ball about p past one surface: x, whether its middle is hidden; y, whether the shadow's rim runs
// through it.
bvec2 shadow_of(uint i, vec3 p, float radius, Light light, uint i_own, uint n_surfaces) {
    Region r = regions[min(i, n_surfaces - 1u)];
    bvec2 by = light.kind == LIGHT_POINT ? hides_ball(r, light.position, p, radius) : shades_ball(r, p, light.toward, radius);
    bool counts = i < n_surfaces && i != i_own;
    return bvec2(counts && by.x, counts && by.y);
}

// The same of all surfaces but the ball's own. Four a turn: turns are counted (src/frame/exchange.rs).
bvec2 shadows_on(vec3 p, float radius, Light light, uint i_own, uint n_surfaces) {
    bvec2 found = bvec2(false);
    for (uint i = 0u; i < n_surfaces; i += 4u) {
        bvec2 a = shadow_of(i, p, radius, light, i_own, n_surfaces);
        bvec2 b = shadow_of(i + 1u, p, radius, light, i_own, n_surfaces);
        bvec2 c = shadow_of(i + 2u, p, radius, light, i_own, n_surfaces);
        bvec2 d = shadow_of(i + 3u, p, radius, light, i_own, n_surfaces);
        found = bvec2(found.x || a.x || b.x || c.x || d.x, found.y || a.y || b.y || c.y || d.y);
    }
    return found;
}
