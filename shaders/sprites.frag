#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "philox.glsl"
#include "functions.glsl"

layout(constant_id = 4) const uint TEXTURED = 0;
layout(constant_id = 5) const uint THRESHOLD = 0;
layout(constant_id = 6) const uint ELLIPSOIDS = 0;

layout(binding = 8) uniform usamplerBuffer pool;
#define SHEET_PIXELS
#include "texture.glsl"

// Optical depth along the pixel's ray through a thin Gaussian blob, premultiplied (docs/model.md
// §9).

layout(push_constant) uniform Push { Camera camera; vec2 pixel; float cutoff; uint i_first_facet; float inv_threshold; uint i_first; } push;

layout(location = 0) flat in vec4 in_blob;
layout(location = 1) flat in vec3 in_radiance;
layout(location = 2) flat in vec4 in_turn;
layout(location = 3) flat in uvec2 in_place;
layout(location = 4) flat in vec3 in_gain;
layout(location = 5) flat in float in_cut;
layout(location = 6) flat in vec4 in_conic;
layout(location = 0) out vec4 out_color;

void main() {
    // The ray (x, y, 1) through the pixel's centre; pixel = (2 tan_x/W, 2 tan_y/H).
    vec2 ray = vec2(gl_FragCoord.x * push.pixel.x - push.camera.tan_x, push.camera.tan_y - gl_FragCoord.y * push.pixel.y);
    // b^2 = |c x d|^2/|d|^2 with c = z (s, 1) and d = (s + delta, 1): one subtraction that can
    // cancel, the delta.
    vec2 s = in_blob.xy;
    vec2 delta = ray - s;
    float twist = s.x * delta.y - s.y * delta.x;
    // b^2/(2 sigma^2)
    float e = in_blob.z * (dot(delta, delta) + twist * twist) / (1.0 + dot(ray, ray));
    float cut = THRESHOLD != 0 ? in_cut : 0.5 * push.cutoff * push.cutoff;
    float tau = in_blob.w;
    if (ELLIPSOIDS != 0) {
        // |M d|^2, and |d|/|M d|: a ray is as long within the ball as it is made to be.
        vec3 d = vec3(ray, 1.0), y = vec3(push.camera.right.y, push.camera.up.y, push.camera.forward.y);
        float up = dot(y, d);
        vec3 across = d - up * y;
        float rest = dot(across, across), white = rest + in_conic.w * up * up;
        e = (in_conic.x * delta.x * delta.x + in_conic.y * delta.x * delta.y + in_conic.z * delta.y * delta.y) / white;
        tau *= sqrt((rest + up * up) / white);
        cut = 0.5 * push.cutoff * push.cutoff;
        if (THRESHOLD != 0) {
            cut = min(cut, log(tau * push.inv_threshold));
        }
    }
    float alpha = 0.0;
    if (e <= cut) {
        float exponent = -e;
        if (TEXTURED != 0) {
            exponent += sheet_exponent(delta, in_turn, in_place, in_gain);
        }
        alpha = one_minus_exp(tau * exp(exponent));
    }
    out_color = vec4(in_radiance * alpha, alpha);
}
