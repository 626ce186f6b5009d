#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Adds up what the equations of merged cells leave over (passes.md "diffusion").
// In: operators, phi of the finer grid. In, out: right-hand sides of the coarser grid. Out: its
// phi = 0.

layout(push_constant) uniform Push {
    Level fine;
    Level coarse;
    uvec3 halved;
    uint n_all;
} push;
READS(0, vec4, operators)
UPDATES(1, vec4, source)
UPDATES(2, vec4, phi)
#include "equations.glsl"

void main() {
    Level coarse = push.coarse;
    FOR_EACH(i, coarse.n_cells.x * coarse.n_cells.y * coarse.n_cells.z) {
        ivec3 at = place_of(coarse, i), halved = ivec3(push.halved);
        ivec3 first = at << halved;
        ivec3 end = min(first + 1 + halved, ivec3(push.fine.n_cells));
        vec3 left = vec3(0.0);
        for (int z = first.z; z < end.z; ++z) {
            for (int y = first.y; y < end.y; ++y) {
                for (int x = first.x; x < end.x; ++x) {
                    ivec3 from = ivec3(x, y, z);
                    int c = index_of(push.fine, from);
                    vec3 flows, all;
                    around(push.fine, from, flows, all);
                    left += source[c].rgb + flows - all * phi[c].rgb;
                }
            }
        }
        int k = index_of(coarse, at);
        source[k] = vec4(left, 0.0);
        phi[k] = vec4(0.0);
    }
}
