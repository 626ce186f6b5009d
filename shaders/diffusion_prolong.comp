#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Adds the phi of the coarser grid to that of the cells it merges (passes.md "diffusion").

layout(push_constant) uniform Push {
    Level fine;
    Level coarse;
    uvec3 halved;
    uint unused;
} push;
UPDATES(0, vec4, phi)

void main() {
    Level fine = push.fine;
    FOR_EACH(i, fine.n_cells.x * fine.n_cells.y * fine.n_cells.z) {
        ivec3 at = place_of(fine, i) >> ivec3(push.halved);
        phi[fine.i_first + i] += phi[index_of(push.coarse, at)];
    }
}
