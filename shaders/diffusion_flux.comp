#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Writes fluence and flux of the diffuse light (model.md §18, passes.md "diffusion").
// In: the density grid, phi. In, out: by cell Q0 and q, then phi and F = q - D grad phi; what
// stands beside Q0 stays. With BOUNCES also what each cell sends out, beside its extinction.

// 1: bounces follow.
#ifndef BOUNCES
#define BOUNCES 0
#endif

layout(push_constant) uniform Push {
    Grid grid;
    // 1 - albedo g
    vec3 kept;
    float inverse_chord;
    // albedo (1-f)/s, and albedo (g-f)/s
    vec3 even;
    float unused;
    vec3 forward;
} push;
FLOATS(0, density)
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(1, phi)
UPDATES(2, vec4, field)
#if BOUNCES
TEXELS(3, arrived)
WRITES(4, vec4, sent)

vec3 arrived_at(int k) { return uintBitsToFloat(TEXEL(arrived, k).rgb); }
#endif

#include "flux.glsl"

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    FOR_EACH(i, level.n_cells.x * level.n_cells.y * level.n_cells.z) {
        int c = int(i);
        ivec3 at = place_of(level, i);
        vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
        float sigma = FLOAT(density, c);
        vec3 reach = 1.0 / (3.0 * sigma * push.kept + push.inverse_chord);
#if BOUNCES
        sent[4 * c] = vec4(arrived_at(4 * c) + push.even * phi_at(c), sigma);
#endif
        field[4 * c].rgb = phi_at(c);
        for (int axis = 0; axis < 3; ++axis) {
            vec3 carried = field[4 * c + 1 + axis].rgb;
            vec3 flux = carried - reach * slope_along(level, at, c, axis, edges[axis]);
            field[4 * c + 1 + axis].rgb = flux;
#if BOUNCES
            int k = 4 * c + 1 + axis;
            sent[k] = vec4(arrived_at(k) + 3.0 * push.forward * flux, 0.0);
#endif
        }
    }
}
