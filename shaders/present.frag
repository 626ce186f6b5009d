#version 460
#extension GL_GOOGLE_include_directive : require

// Shows a picture on a display: over the background, tone-mapped, in sRGB, dithered; or two
// pictures compared (passes.md "present").
// In: one or two pictures, premultiplied linear RGBA. Out: code values of 8 bits. Error: half a
// code value, by dithering.

#include "records.glsl"
#include "camera.glsl"
#include "angle.glsl"
#include "clear_sky.glsl"
#include "sea.glsl"
#include "behind.glsl"

// 0: bytes, 1: half floats, 2: floats.
layout(constant_id = 0) const uint FORMAT = 1;
// 1: the sky is behind the picture, in place of the background.
layout(constant_id = 1) const uint HAS_SKY = 0;

layout(push_constant) uniform Push {
    vec3 background;
    float exposure;
    uvec2 size;
    ivec2 corner;
    uint tone_map;
    uint compare;
    int split;
    float gain;
} push;
// Four words a texel, which devices read best.
TEXELS(0, picture_a)
TEXELS(1, picture_b)
READS(2, Sky, skies)

layout(location = 0) out vec4 out_color;

// Tone maps.
const uint NEUTRAL = 0;
const uint FILMIC = 2;

// Ways of comparing.
const uint SPLIT = 1;
const uint DIFFERENCE = 2;
const uint SECOND = 3;
// Rows of a dash of the dividing line, so that the line shows on white and on black.
const uint DASH = 4;
const float START_COMPRESSION = 0.8;
const float DESATURATION = 0.15;

// Returns a premultiplied linear RGBA pixel.
vec4 pixel_at(bool is_b, uvec2 p) {
    uint i = p.y * push.size.x + p.x;
    int at = int(FORMAT == 0 ? i >> 2 : FORMAT == 1 ? i >> 1 : i);
    uvec4 words = is_b ? TEXEL(picture_b, at) : TEXEL(picture_a, at);
    if (FORMAT == 0) {
        return unpackUnorm4x8(words[i & 3u]);
    }
    if (FORMAT == 1) {
        uvec2 half_words = (i & 1u) == 0u ? words.xy : words.zw;
        return vec4(unpackHalf2x16(half_words.x), unpackHalf2x16(half_words.y));
    }
    return uintBitsToFloat(words);
}

// Khronos PBR Neutral.
vec3 neutral(vec3 color) {
    // NaN counts as 0: the maximum of NaN and a number may be either (GLSL.std.450, FMax).
    vec3 known = mix(vec3(0.0), color, greaterThan(color, vec3(0.0)));
    float peak = max(max(known.r, known.g), known.b);
    if (!(peak >= START_COMPRESSION)) {
        return color;
    }
    const float d = 1.0 - START_COMPRESSION;
    float new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    float gray = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    // Beyond f32's range the colour is white.
    return peak > 3e38 ? vec3(1.0) : mix(color * (new_peak / peak), vec3(new_peak), gray);
}

// Returns how far two pixels over the background are apart, times the gain. Differences are formed
// first, so that small ones keep their digits. NaN gives 1, so that it is not taken for no
// difference.
vec3 apart(vec4 a, vec4 b, vec3 behind) {
    vec4 d = a - b;
    vec3 far = push.gain * (push.exposure * abs(d.rgb - d.a * behind));
    return mix(vec3(1.0), far, greaterThanEqual(far, vec3(0.0)));
}

// Narkowicz's fit of the filmic curve; NaN is black.
float filmic(float x) {
    x = x > 0.0 ? min(x, 1e6) : 0.0;
    return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
}

vec3 toned(vec3 linear) {
    if (push.tone_map == FILMIC) {
        return vec3(filmic(linear.r), filmic(linear.g), filmic(linear.b));
    }
    return push.tone_map == NEUTRAL ? neutral(linear) : linear;
}

// Returns the radiance behind a place in the picture.
vec3 behind_pixel(uvec2 p) {
    if (HAS_SKY == 0) {
        return push.background;
    }
    Camera camera = skies[0].camera;
    vec2 pixel = 2.0 * vec2(camera.tan_x, camera.tan_y) / vec2(push.size);
    vec3 ray = ray_through(camera, vec2(p) + 0.5, pixel);
    return sky_behind(
        skies[0], normalize(ray.x * camera.right + ray.y * camera.up + camera.forward)
    );
}

// IEC 61966-2-1; NaN is black.
float encoded(float linear) {
    float v = linear > 0.0 ? min(linear, 1.0) : 0.0;
    return v <= 0.0031308 ? 12.92 * v : 1.055 * exp2(log2(v) / 2.4) - 0.055;
}

// Returns (B + 1/2)/64 of Bayer's 8 by 8 matrix B.
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
    if (push.compare == SPLIT && at.x == push.split) {
        out_color = vec4(vec3((uint(at.y) / DASH & 1u) == 0u ? 1.0 : 0.0), 1.0);
        return;
    }
    bool shows_b = push.compare == SECOND || (push.compare == SPLIT && at.x > push.split);
    vec4 pixel = pixel_at(shows_b, uvec2(at));
    vec3 behind = behind_pixel(uvec2(at)), shown;
    if (push.compare == DIFFERENCE) {
        shown = apart(pixel, pixel_at(true, uvec2(at)), behind);
    } else {
        shown = toned(push.exposure * (pixel.rgb + (1.0 - pixel.a) * behind));
    }
    vec3 code = floor(
        255.0 * vec3(encoded(shown.r), encoded(shown.g), encoded(shown.b)) + dither(uvec2(at))
    );
    out_color = vec4(min(code, 255.0) / 255.0, 1.0);
}
