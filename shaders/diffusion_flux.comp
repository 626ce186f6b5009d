#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Writes fluence and flux of the diffuse light (model.md §18, passes.md "diffusion").
// In: the density grid, phi. In, out: by cell Q0 and q, then phi and F = q - D grad phi; what
// stands beside Q0 stays. The slope is that between the cells on both sides. At the faces of the
// box it is one-sided.

layout(push_constant) uniform Push {
    Grid grid;
    // 1 - albedo g
    vec3 kept;
    float inverse_chord;
} push;
FLOATS(0, density)
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(1, phi)
UPDATES(2, vec4, field)

vec3 phi_at(int c) { return uintBitsToFloat(TEXEL(phi, c).rgb); }

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    FOR_EACH(i, level.n_cells.x * level.n_cells.y * level.n_cells.z) {
        int c = int(i);
        ivec3 at = place_of(level, i), stride = strides_of(level);
        vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
        vec3 reach = 1.0 / (3.0 * FLOAT(density, c) * push.kept + push.inverse_chord);
        field[4 * c].rgb = phi_at(c);
        for (int axis = 0; axis < 3; ++axis) {
            int after = at[axis] + 1 < int(level.n_cells[axis]) ? c + stride[axis] : c;
            int prior = at[axis] > 0 ? c - stride[axis] : c;
            int n_steps = (after - prior) / stride[axis];
            vec3 rise = phi_at(after) - phi_at(prior);
            vec3 slope = n_steps > 0 ? rise / (float(n_steps) * edges[axis]) : vec3(0.0);
            field[4 * c + 1 + axis].rgb -= reach * slope;
        }
    }
}
