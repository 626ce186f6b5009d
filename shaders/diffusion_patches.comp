#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "field.glsl"
#include "patches.glsl"

// Takes the diffuse light at the patches of the grid's box for surfaces and ground (model.md §18,
// passes.md "diffusion").
// In: fluence and flux by cell. Out: the same by patch.

layout(push_constant) uniform Push { Grid grid; } push;
TEXELS(0, field)
WRITES(1, vec4, patches)

void main() {
    FOR_EACH(i, N_PATCHES) {
        Weights of = weights_at(push.grid, patch_at(push.grid, i).center);
        for (int k = 0; k < 4; ++k) {
            vec4 sum = vec4(0.0);
            for (int corner = 0; corner < 8; ++corner) {
                Corner c = corner_of(ivec3(push.grid.n_cells), of, corner);
                sum += c.share * uintBitsToFloat(TEXEL(field, 4 * c.i_cell + k));
            }
            patches[4u * i + uint(k)] = sum;
        }
    }
}
