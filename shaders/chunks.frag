#version 460

// What has been composed near to far: shown; or the pixels that let no more through than may be
// left out, and those alone (docs/model.md §11 "chunks").

// 0: shows; 1: picks.
layout(constant_id = 0) const uint PICKS = 0;

layout(push_constant) uniform Push { uint width; float saturated; } push;
// Four floats a pixel, rows from the top.
layout(binding = 0) uniform usamplerBuffer composed;

layout(location = 0) out vec4 out_color;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 pixel = uintBitsToFloat(texelFetch(composed, at.y * int(push.width) + at.x));
    if (PICKS != 0 && !(1.0 - pixel.w < push.saturated)) {
        discard;
    }
    out_color = pixel;
}
