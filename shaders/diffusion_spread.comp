#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "each.glsl"
#include "diffusion.glsl"
#include "field.glsl"

// Adds what bounces between merged cells have changed to the light of the cells (model.md §18,
// passes.md "diffusion").
// In: phi and F of merged cells, after the bounces and before. In, out: phi and F of the cells.
// Law: the change is trilinear between the merged cells' centres. Error: some ulp.

layout(push_constant) uniform Push {
    Level fine;
    Level merged;
    // Cells by which the first merged one reaches beyond the grid.
    uvec3 before;
    // Edge of a merged cell, in cells.
    uint edge;
} push;
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(0, after)
TEXELS(1, before)
UPDATES(2, vec4, field)

void main() {
    uvec3 n = push.fine.n_cells;
    FOR_EACH(c, n.x * n.y * n.z) {
        ivec3 n_merged = ivec3(push.merged.n_cells);
        vec3 from_first = vec3(place_of(push.fine, c) + ivec3(push.before)) + 0.5;
        vec3 at = from_first / float(push.edge) - 0.5;
        Weights of = weights_among(n_merged, at);
        vec3 rise[4] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
        for (int corner = 0; corner < 8; ++corner) {
            Corner to = corner_of(n_merged, of, corner);
            [[unroll]] for (int k = 0; k < 4; ++k) {
                vec4 now = uintBitsToFloat(TEXEL(after, 4 * to.i_cell + k));
                rise[k] += to.share * (now - uintBitsToFloat(TEXEL(before, 4 * to.i_cell + k))).rgb;
            }
        }
        [[unroll]] for (int k = 0; k < 4; ++k) { field[4 * c + k].rgb += rise[k]; }
    }
}
