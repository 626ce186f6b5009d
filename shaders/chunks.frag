#version 460
#extension GL_GOOGLE_include_directive : require

// Shows a picture that was composed near to far, or marks the pixels that are saturated, so that
// later chunks skip them (passes.md "chunks").
// In: the composed picture, RGBA floats, rows from the top. Out: the pixel's colour; saturated
// pixels alone where PICKS is 1.

#include "buffers.glsl"
#include "target.glsl"

// 0: shows all pixels; 1: keeps only those that let less light through than push.saturated.
layout(constant_id = 0) const uint PICKS = 0;

layout(push_constant) uniform Push {
    uint width;
    float saturated;
} push;
// Four floats a pixel, rows from the top.
TEXELS(0, composed)

layout(location = 0) out vec4 out_color;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 pixel = uintBitsToFloat(TEXEL(composed, at.y * int(push.width) + at.x));
    if (PICKS != 0 && !(1.0 - pixel.w < push.saturated)) {
        discard;
    }
    out_color = vec4(in_target(pixel.rgb), pixel.a);
}
