#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "each.glsl"
#include "diffusion.glsl"
#include "orders.glsl"

// Sums what cells between which bounces lead scatter toward the eye by the high orders of the
// phase function (model.md §18, passes.md "scatter").
// In: their moments by bounce cell. Out: by bounce cell 4 pi times the radiance over s sigma.
// Error: some ulp.

layout(push_constant) uniform Push {
    Grid grid;
    vec3 eye;
} push;
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(0, high)
WRITES(1, vec4, high_seen)

#include "eye.glsl"

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    FOR_EACH(c, n_total(level)) {
        float y[HIGH];
        high_orders(toward_eye(push.grid, place_of(level, c), push.eye), y);
        vec3 sum = vec3(0.0);
        [[unroll]] for (int k = 0; k < HIGH; ++k) {
            sum += y[k] * uintBitsToFloat(TEXEL(high, HIGH * int(c) + k).rgb);
        }
        high_seen[c] = vec4(sum, 0.0);
    }
}
