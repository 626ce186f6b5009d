// The slope of phi between cells (model.md §18). Needs diffusion.glsl, and the texels `phi`.

vec3 phi_at(int c) { return uintBitsToFloat(TEXEL(phi, c).rgb); }

// Returns the slope along an axis: between the cells on both sides, and at the faces of the box
// one-sided.
vec3 slope_along(Level level, ivec3 at, int c, int axis, float edge) {
    int stride = strides_of(level)[axis];
    int after = at[axis] + 1 < int(level.n_cells[axis]) ? c + stride : c;
    int prior = at[axis] > 0 ? c - stride : c;
    int n_steps = (after - prior) / stride;
    vec3 rise = phi_at(after) - phi_at(prior);
    return n_steps > 0 ? rise / (float(n_steps) * edge) : vec3(0.0);
}
