// Whether light reaches a point past all surfaces (passes.md "transmit"). Needs
// light.glsl, occlude.glsl and regions.glsl; the surfaces are the first regions.

// Whether no surface but the point's own hides the light from p.
bool is_clear(vec3 p, Light light, uint i_own, uint n_surfaces) {
    for (uint i = 0; i < n_surfaces; ++i) {
        Region r = region_at(i);
        if (i != i_own
            && (light.kind == LIGHT_POINT ? hides(r, p, light.position)
                                          : shades(r, p, light.toward))) {
            return false;
        }
    }
    return true;
}

// Returns x: whether surface i hides the light from the middle of the ball about p; y: whether its
// shadow's edge crosses the ball.
bvec2 shadow_of(uint i, vec3 p, float radius, Light light, uint i_own) {
    Region r = region_at(i);
    vec2 past = hides_ball(r, light.position, p, radius);
    bvec2 by = light.kind == LIGHT_POINT ? bvec2(past.x > 0.0, past.y > 0.0)
                                         : shades_ball(r, p, light.toward, radius);
    return bvec2(i != i_own && by.x, i != i_own && by.y);
}

// Surfaces are remembered by number modulo this: a float holds whole numbers of as many bits.
const uint N_MASK = 24u;

// Returns a mask of the surfaces whose shadow reaches into the ball, and sets has_edge where the
// edge of one does.
uint shadows_on(
    vec3 p, float radius, Light light, uint i_own, uint n_surfaces, inout bool has_edge
) {
    uint mask = 0u;
    for (uint i = 0u; i < n_surfaces; ++i) {
        bvec2 by = shadow_of(i, p, radius, light, i_own);
        mask |= by.x || by.y ? 1u << (i % N_MASK) : 0u;
        has_edge = has_edge || by.y;
    }
    return mask;
}
