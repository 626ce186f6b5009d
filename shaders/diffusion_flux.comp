#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Writes fluence and flux of the diffuse light (model.md §18, passes.md "diffusion").
// In: the density grid, phi. In, out: by cell Q0 and q, then phi and F = q - D grad phi; what
// stands beside Q0 stays. With BOUNCES also what bounces begin with: what suns and lamps and all
// light make a cell send out.

// 1: bounces follow.
#ifndef BOUNCES
#define BOUNCES 0
#endif

layout(push_constant) uniform Push {
    Grid grid;
    // 1 - albedo g
    vec3 kept;
    float inverse_chord;
    // s
    vec3 weakened;
    float unused;
    // albedo (1-f)/s, and albedo (g-f)/s
    vec3 even;
    float unused_too;
    vec3 forward;
} push;
FLOATS(0, density)
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(1, phi)
UPDATES(2, vec4, field)
#if BOUNCES
WRITES(3, vec4, arrived)
WRITES(4, vec4, sent)
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
        vec3 inverse = sigma > 0.0 ? 1.0 / (sigma * push.weakened) : vec3(0.0);
        vec3 of_suns = field[4 * c].rgb * inverse;
        arrived[4 * c] = vec4(of_suns, sigma);
        sent[4 * c] = vec4(of_suns + push.even * phi_at(c), sigma);
        // Beside q stands the flux of the sky that is in it.
        vec3 fallen = vec3(field[4 * c + 1].w, field[4 * c + 2].w, field[4 * c + 3].w);
#endif
        field[4 * c].rgb = phi_at(c);
        for (int axis = 0; axis < 3; ++axis) {
            vec3 carried = field[4 * c + 1 + axis].rgb;
            vec3 flux = carried - reach * slope_along(level, at, c, axis, edges[axis]);
            field[4 * c + 1 + axis].rgb = flux;
#if BOUNCES
            vec3 of_sky = axis == 1 ? push.inverse_chord * fallen : vec3(0.0);
            vec3 along = (carried / reach + of_sky) * inverse;
            arrived[4 * c + 1 + axis] = vec4(along, 0.0);
            sent[4 * c + 1 + axis] = vec4(along + 3.0 * push.forward * flux, 0.0);
#endif
        }
    }
}
