#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Merges the equations of cells to those of a coarser grid (passes.md "diffusion").
// In, out: operators. Law: sinks add up, and what flows through the faces between merged cells
// counts half along an axis that is halved, as their centres lie twice as far apart.

layout(push_constant) uniform Push {
    Level fine;
    Level coarse;
    // 1 along the axes that are halved.
    uvec3 halved;
    uint n_all;
} push;
UPDATES(0, vec4, operators)

void main() {
    Level coarse = push.coarse;
    FOR_EACH(i, coarse.n_cells.x * coarse.n_cells.y * coarse.n_cells.z) {
        ivec3 at = place_of(coarse, i), halved = ivec3(push.halved);
        ivec3 first = at << halved;
        ivec3 end = min(first + 1 + halved, ivec3(push.fine.n_cells));
        vec3 weight = vec3(1.0) - 0.5 * vec3(halved);
        for (int set = 0; set < N_SETS; ++set) {
            int plane = set * int(push.n_all);
            vec4 sum = vec4(0.0);
            for (int z = first.z; z < end.z; ++z) {
                for (int y = first.y; y < end.y; ++y) {
                    for (int x = first.x; x < end.x; ++x) {
                        vec4 own = operators[plane + index_of(push.fine, ivec3(x, y, z))];
                        // Of the faces along a halved axis, those of the second cell lead on.
                        bvec3 leads = equal(ivec3(x, y, z) - first, halved);
                        sum.xyz += mix(vec3(0.0), own.xyz * weight, leads);
                        sum.w += own.w;
                    }
                }
            }
            operators[plane + index_of(coarse, at)] = sum;
        }
    }
}
