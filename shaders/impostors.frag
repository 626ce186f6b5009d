#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Draws a shell's picture as seen from elsewhere (passes.md "impostors").
// In: the shell's picture, RGBA floats. Out: the pixel's colour.
// Law: a homography gives the pixel's place in the shell's picture; Catmull-Rom cubics interpolate
// between its texels.

#include "buffers.glsl"
#include "target.glsl"
#include "impostors.glsl"
// Four floats a texel, rows from the top.
TEXELS(0, shell)

layout(location = 0) out vec4 out_color;

vec4 weights(float t) {
    float t2 = t * t, t3 = t2 * t;
    return 0.5
           * vec4(2.0 * t2 - t - t3, 2.0 - 5.0 * t2 + 3.0 * t3, t + 4.0 * t2 - 3.0 * t3, t3 - t2);
}

vec4 texel(int i, int j) { return uintBitsToFloat(TEXEL(shell, j * int(push.width) + i)); }

void main() {
    vec3 pixel = vec3(gl_FragCoord.xy - push.middle, 1.0);
    vec2 extent = vec2(push.width, push.height);
    // In texels from the first one's centre, clamped to the texels there are.
    vec2 at = vec2(dot(push.column, pixel), dot(push.row, pixel)) / dot(push.under, pixel)
              + 0.5 * extent - 0.5;
    at = clamp(at, vec2(0.0), extent - 1.0);
    vec2 low = floor(at);
    vec4 across = weights(at.x - low.x), down = weights(at.y - low.y);
    ivec2 first = ivec2(low) - 1, last = ivec2(extent) - 1;
    ivec4 i = clamp(first.x + ivec4(0, 1, 2, 3), 0, last.x),
          j = clamp(first.y + ivec4(0, 1, 2, 3), 0, last.y);
    vec4 sum = vec4(0.0);
    [[unroll]] for (int k = 0; k < 4; ++k) {
        vec4 line = across.x * texel(i.x, j[k]) + across.y * texel(i.y, j[k])
                    + across.z * texel(i.z, j[k]) + across.w * texel(i.w, j[k]);
        sum += down[k] * line;
    }
    out_color = vec4(in_target(max(sum.xyz, 0.0)), clamp(sum.w, 0.0, 1.0));
}
