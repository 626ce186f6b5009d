// The light that arrives at each point of a cell (passes.md "second"). Needs
// cell_samples.glsl, reach.glsl, iterations.glsl.

// Returns a lamp's falloff times cosine over one row of points. o: from the row's middle to the
// lamp; height: of the lamp over the cell's plane.
vec4 row_of_falloffs(Light light, vec3 o, vec3 u, float height) {
    vec4 d2 = max(dot(o, o) - ALONG * (2.0 * dot(o, u)) + ALONG * ALONG * dot(u, u), 1e-30);
    vec4 inverse = inversesqrt(d2);
    vec4 axis = dot(o, light.toward) - ALONG * dot(u, light.toward);
    vec4 cone = clamp(light.cone_scale * axis * inverse + light.cone_offset, 0.0, 1.0);
    return height * inverse * cone * cone / max(d2, light.radius * light.radius);
}

// Returns the share of a light's energy that arrives at each point of a facet, past the surfaces of
// the mask that shadows_on() found. through: transmittance of the clouds.
CellSamples arriving(
    Light light, Cell cell, vec3 normal, float through, uint shadows, uint i_own, uint n_surfaces
) {
    CellSamples s = CellSamples(vec4(through), vec4(through), vec4(through), vec4(through));
    bool lamp = light.kind == LIGHT_POINT;
    uint i = shadows != 0u ? uint(findLSB(shadows)) : n_surfaces;
    while (i < n_surfaces) {
        if (i != i_own) {
            subtract_shadow(
                s, region_at(i), lamp ? light.position : light.toward, lamp ? 1.0 : 0.0, cell
            );
        }
        n_iterations += 1u;
        i += N_MASK;
        bool done = i >= n_surfaces;
        shadows &= done ? shadows - 1u : shadows;
        i = done ? (shadows != 0u ? uint(findLSB(shadows)) : n_surfaces) : i;
    }
    // The cell is flat, so the lamp's height over it is the same everywhere.
    vec3 o = light.position - cell.middle;
    float height = max(dot(normal, o), 0.0), cosine = dot(normal, light.toward);
    return CellSamples(
        lamp ? s.a * row_of_falloffs(light, o - ALONG.x * cell.v, cell.u, height)
             : share_by(light, cosine, s.a),
        lamp ? s.b * row_of_falloffs(light, o - ALONG.y * cell.v, cell.u, height)
             : share_by(light, cosine, s.b),
        lamp ? s.c * row_of_falloffs(light, o - ALONG.z * cell.v, cell.u, height)
             : share_by(light, cosine, s.c),
        lamp ? s.d * row_of_falloffs(light, o - ALONG.w * cell.v, cell.u, height)
             : share_by(light, cosine, s.d)
    );
}
