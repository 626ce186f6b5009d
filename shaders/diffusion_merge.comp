#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "buffers.glsl"
#include "each.glsl"
#include "diffusion.glsl"

// Merges cells to those between which bounces lead (model.md §18, passes.md "diffusion").
// In: by cell Q0 and q, and what suns and lamps make it send out, beside its extinction. Out: the
// same of merged cells. Law: extinction, Q0, what is sent out times extinction, and q/D are means
// over the volume, in which no cell is empty. Error: some ulp.

layout(push_constant) uniform Push {
    Level fine;
    Level merged;
    // Cells by which the first merged one reaches beyond the grid.
    uvec3 before;
    // Edge of a merged cell, in cells.
    uint edge;
    // 1 - albedo g
    vec3 kept;
    float inverse_chord;
    // Extinction beyond which a merged cell counts as no denser.
    float densest;
} push;
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(0, field)
TEXELS(1, arrived)
WRITES(2, float, merged_density)
WRITES(3, vec4, merged_field)
WRITES(4, vec4, merged_arrived)

vec3 field_at(int k) { return uintBitsToFloat(TEXEL(field, k).rgb); }
vec4 arrived_at(int k) { return uintBitsToFloat(TEXEL(arrived, k)); }

// Returns 1/D.
vec3 loss_of(float sigma) { return 3.0 * sigma * push.kept + push.inverse_chord; }

void main() {
    uvec3 n = push.merged.n_cells;
    FOR_EACH(i, n.x * n.y * n.z) {
        ivec3 low = place_of(push.merged, i) * int(push.edge) - ivec3(push.before);
        ivec3 first = max(low, ivec3(0));
        ivec3 end = min(low + int(push.edge), ivec3(push.fine.n_cells));
        float all = 0.0;
        vec3 sources[4] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)), sent[4] = sources;
        for (int z = first.z; z < end.z; ++z) {
            for (int y = first.y; y < end.y; ++y) {
                for (int x = first.x; x < end.x; ++x) {
                    int c = 4 * index_of(push.fine, ivec3(x, y, z));
                    float sigma = arrived_at(c).w;
                    all += sigma;
                    [[unroll]] for (int k = 0; k < 4; ++k) {
                        sources[k] += k == 0 ? field_at(c) : loss_of(sigma) * field_at(c + k);
                        sent[k] += sigma * arrived_at(c + k).rgb;
                    }
                }
            }
        }
        float share = 1.0 / float(push.edge * push.edge * push.edge);
        // A merged cell sends out all that its cells do, also where less extinction counts.
        float sigma = min(share * all, push.densest), weight = sigma > 0.0 ? share / sigma : 0.0;
        merged_density[i] = sigma;
        [[unroll]] for (int k = 0; k < 4; ++k) {
            vec3 source = share * sources[k];
            merged_field[4 * i + k] = vec4(k == 0 ? source : source / loss_of(sigma), 0.0);
            merged_arrived[4 * i + k] = vec4(weight * sent[k], k == 0 ? sigma : 0.0);
        }
    }
}
