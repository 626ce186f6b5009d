#version 460

// A picture as a display shows it: over the background, tone-mapped, in sRGB, dithered (docs/model.md §11 "present").

// 0: bytes, 1: half floats, 2: floats.
layout(constant_id = 0) const uint FORMAT = 1;

layout(push_constant) uniform Push { vec3 background; float exposure; uvec2 size; ivec2 corner; uint tone_map; uint unused; } push;
layout(std430, binding = 0) readonly buffer Picture { uint words[]; };

layout(location = 0) out vec4 out_color;

const uint NEUTRAL = 0;
const float START_COMPRESSION = 0.8;
const float DESATURATION = 0.15;

// Premultiplied linear RGBA.
vec4 pixel_at(uvec2 p) {
    uint i = p.y * push.size.x + p.x;
    if (FORMAT == 0) {
        return unpackUnorm4x8(words[i]);
    }
    if (FORMAT == 1) {
        return vec4(unpackHalf2x16(words[2 * i]), unpackHalf2x16(words[2 * i + 1]));
    }
    return uintBitsToFloat(uvec4(words[4 * i], words[4 * i + 1], words[4 * i + 2], words[4 * i + 3]));
}

// Khronos PBR Neutral.
vec3 neutral(vec3 color) {
    float peak = max(max(color.r, color.g), color.b);
    if (!(peak >= START_COMPRESSION)) {
        return color;
    }
    const float d = 1.0 - START_COMPRESSION;
    float new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    float gray = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    // What is beyond f32's numbers is white.
    return peak > 3e38 ? vec3(1.0) : mix(color * (new_peak / peak), vec3(new_peak), gray);
}

// IEC 61966-2-1; NaN is black.
float encoded(float linear) {
    float v = linear > 0.0 ? min(linear, 1.0) : 0.0;
    return v <= 0.0031308 ? 12.92 * v : 1.055 * exp2(log2(v) / 2.4) - 0.055;
}

// (B + 1/2)/64 of Bayer's 8 by 8 matrix B.
float dither(uvec2 p) {
    uint a = (p.x ^ p.y) & 7u, b = p.y & 7u, bayer = 0u;
    for (uint i = 0u; i < 3u; ++i) {
        bayer = bayer << 2 | (a >> i & 1u) << 1 | (b >> i & 1u);
    }
    return (float(bayer) + 0.5) / 64.0;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - push.corner;
    out_color = vec4(0.0, 0.0, 0.0, 1.0);
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, ivec2(push.size)))) {
        return;
    }
    vec4 pixel = pixel_at(uvec2(at));
    vec3 linear = push.exposure * (pixel.rgb + (1.0 - pixel.a) * push.background);
    vec3 shown = push.tone_map == NEUTRAL ? neutral(linear) : linear;
    vec3 code = floor(255.0 * vec3(encoded(shown.r), encoded(shown.g), encoded(shown.b)) + dither(uvec2(at)));
    out_color = vec4(min(code, 255.0) / 255.0, 1.0);
}
