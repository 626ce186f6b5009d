// Straight ways through the cells, which are even inside (model.md §18). Needs faces.glsl,
// sky.glsl, medium.glsl, push.grid and push.weakened. Of each cell it needs sent_along(c, w): 4 pi
// times what it sends out along w, beside its extinction. OUTSIDE(l) is what a bounce or an eye
// takes of the sky's radiance l, which is below 0 high up under a low sun. FROM_SOLIDS(at, axis,
// side, d, above) is pi times the radiance of surfaces and ground from d.

// Returns the share of light that passes a depth, by channel where channels differ.
#if N_SETS == 1
#define KEPT float
float kept_by(float depth) {
    return depth == 0.0 ? 1.0 : exp(-min(push.weakened.x * depth, OPAQUE_DEPTH));
}
#else
#define KEPT vec3
vec3 kept_by(float depth) { return through(push.weakened * depth); }
#endif

// Returns 4 pi times the radiance along w in the middle of a cell. Of what comes from outside, the
// share `above` comes from above the horizon.
vec3 radiance_along(Level level, ivec3 at, vec3 w, float above, Skies skies) {
    vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
    // Length of the way through a cell along each axis, and to the next face.
    vec3 across = edges / max(abs(w), vec3(1e-6)), face = 0.5 * across;
    // The way leads to where light comes from.
    ivec3 turn = mix(ivec3(1), ivec3(-1), greaterThan(w, vec3(0.0)));
    ivec3 stride = turn * strides_of(level);
    ivec3 left = mix(at, ivec3(level.n_cells) - 1 - at, greaterThan(turn, ivec3(0)));
    int c = index_of(level, at);
    vec3 sum = vec3(0.0);
    KEPT passed = KEPT(1.0);
    float done = 0.0;
    uint axis = 0u;
    for (bool is_inside = true; is_inside;) {
        axis = face.x <= face.y && face.x <= face.z ? 0u : face.y <= face.z ? 1u : 2u;
        float to = face[axis];
        vec4 sent = sent_along(c, w);
        KEPT kept = kept_by(sent.w * (to - done));
        sum += passed * (1.0 - kept) * sent.rgb;
        passed *= kept;
        done = to;
        face[axis] += across[axis];
        is_inside = left[axis] > 0;
        left[axis] -= 1;
        if (is_inside) {
            at[axis] += turn[axis];
            c += stride[axis];
        }
    }
    vec3 outside = OUTSIDE(sky_along(skies, -w, above));
    outside += FROM_SOLIDS(at, axis, turn[axis] > 0 ? 1u : 0u, -w, above);
    return sum + 4.0 * passed * outside;
}
