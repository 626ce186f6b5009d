#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "each.glsl"
#include "diffusion.glsl"
#include "field.glsl"
#include "medium.glsl"
#include "second_order.glsl"

// Sums what each cell scatters toward the eye of light that is not scattered straight on (model.md
// §18, passes.md "scatter").
// In: phi and F by cell, what suns and lamps make a cell send out, and the second order by bounce
// cell. Out: by cell what it sends out, times 4 pi, beside its extinction. Error: some ulp.

layout(push_constant) uniform Push {
    Grid grid;
    // albedo', and 3 albedo' g'
    vec3 even;
    float g;
    vec3 forward;
    float straight;
    vec3 eye;
    // Edge of a bounce cell, in cells.
    uint edge;
    // Cells by which the first bounce cell reaches beyond the grid.
    uvec3 before;
    uint unused;
    uvec3 n_bounce_cells;
} push;
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(0, field)
TEXELS(1, arrived)
WRITES(2, vec4, toward)
#if SECOND
TEXELS(3, of_second)
#endif

#include "eye.glsl"
#include "of_suns.glsl"

vec3 field_at(int k) { return uintBitsToFloat(TEXEL(field, k).rgb); }

#if SECOND
// Returns the second order along w, trilinear between the bounce cells' centres.
vec3 second_at(ivec3 at, vec3 w) {
    ivec3 n = ivec3(push.n_bounce_cells);
    Weights of =
        weights_among(n, (vec3(at + ivec3(push.before)) + 0.5) / float(push.edge) - 0.5);
    float y[N_SECOND] = second_order(w);
    vec3 sum = vec3(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        Corner to = corner_of(n, of, corner);
        [[unroll]] for (int m = 0; m < N_SECOND; ++m) {
            vec3 value = uintBitsToFloat(TEXEL(of_second, N_SECOND * to.i_cell + m).rgb);
            sum += to.share * y[m] * value;
        }
    }
    return sum;
}
#endif

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    FOR_EACH(i, n_total(level)) {
        int c = int(i);
        ivec3 at = place_of(level, i);
        vec3 w = toward_eye(push.grid, at, push.eye);
        vec3 along =
            w.x * field_at(4 * c + 1) + w.y * field_at(4 * c + 2) + w.z * field_at(4 * c + 3);
        vec3 diffuse = push.even * field_at(4 * c) + push.forward * along;
#if SECOND
        diffuse += second_at(at, w);
#endif
        OfSuns suns = of_suns(c);
        float peak = lobe(suns, push.g, w) / max(1.0 - push.straight, 1e-30);
        vec3 once = suns.all * mix(1.0, peak, suns.directed);
        toward[c] = vec4(max(diffuse, vec3(0.0)) + once, arrived_at(4 * c).w);
    }
}
