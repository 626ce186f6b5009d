#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Adds to the light of a bounce what diffusion makes of its change (model.md §18, passes.md
// "diffusion").
// In: the density grid, phi of the change, by cell its sources Q0 and q, and what suns and lamps
// make a cell send out. In, out: phi and F by cell. Out: what each cell sends out.

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
TEXELS(2, change)
TEXELS(3, arrived)
UPDATES(4, vec4, field)
WRITES(5, vec4, sent)

#include "flux.glsl"

vec3 arrived_at(int k) { return uintBitsToFloat(TEXEL(arrived, k).rgb); }

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    FOR_EACH(i, level.n_cells.x * level.n_cells.y * level.n_cells.z) {
        int c = int(i);
        ivec3 at = place_of(level, i);
        vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
        float sigma = FLOAT(density, c);
        vec3 reach = 1.0 / (3.0 * sigma * push.kept + push.inverse_chord);
        vec3 all = field[4 * c].rgb + phi_at(c);
        field[4 * c].rgb = all;
        sent[4 * c] = vec4(arrived_at(4 * c) + push.even * all, sigma);
        for (int axis = 0; axis < 3; ++axis) {
            int k = 4 * c + 1 + axis;
            vec3 carried = uintBitsToFloat(TEXEL(change, k).rgb);
            vec3 flux = field[k].rgb + carried
                        - reach * slope_along(level, at, c, axis, edges[axis]);
            field[k].rgb = flux;
            sent[k] = vec4(arrived_at(k) + 3.0 * push.forward * flux, 0.0);
        }
    }
}
