#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "camera.glsl"
#include "variants.glsl"
#include "philox.glsl"
#include "functions.glsl"

TEXELS(8, pool)
#define SAMPLES_TEXTURE
#include "texture.glsl"

// Computes a thin Gaussian blob's opacity along the pixel's ray (model.md §9, passes.md
// "sprites"). In: the blob from sprites.vert. Out: premultiplied colour and opacity, 1 - e^-tau.
// Law: tau = sqrt(2 pi) kappa sigma e^(-b^2/2 sigma^2), b the ray's distance from the centre.

#include "sprites.glsl"

// 1: writes the layer's optical depth, 1, 0 and its depth near/z in place of colour and opacity.
layout(constant_id = 8) const uint SUMS = 0;

layout(location = 0) flat in vec4 in_blob;
layout(location = 1) flat in vec3 in_radiance;
layout(location = 2) flat in vec4 in_turn;
layout(location = 3) flat in uvec2 in_place;
layout(location = 4) flat in vec3 in_gain;
layout(location = 5) flat in float in_cut;
layout(location = 6) flat in vec4 in_conic;
layout(location = 0) out vec4 out_color;

void main() {
    vec2 ray = ray_through(push.camera, gl_FragCoord.xy, push.pixel).xy;
    // b^2 = |c x d|^2/|d|^2 with c = z (s, 1) and d = (s + delta, 1). Only the subtraction for
    // delta can cancel.
    vec2 s = in_blob.xy;
    vec2 delta = ray - s;
    float twist = s.x * delta.y - s.y * delta.x;
    // b^2/(2 sigma^2)
    float e = in_blob.z * (dot(delta, delta) + twist * twist) / (1.0 + dot(ray, ray));
    float cut = THRESHOLD != 0 ? in_cut : 0.5 * push.cutoff * push.cutoff;
    float tau = in_blob.w;
    if (ELLIPSOIDS != 0) {
        // |M d|^2, and |d|/|M d|: the ray's length in the scene over that in the ball's
        // coordinates.
        vec3 d = vec3(ray, 1.0),
             y = vec3(push.camera.right.y, push.camera.up.y, push.camera.forward.y);
        float up = dot(y, d);
        vec3 across = d - up * y;
        float rest = dot(across, across), white = rest + in_conic.w * up * up;
        e = (in_conic.x * delta.x * delta.x + in_conic.y * delta.x * delta.y
             + in_conic.z * delta.y * delta.y)
            / white;
        tau *= sqrt((rest + up * up) / white);
        cut = 0.5 * push.cutoff * push.cutoff;
        if (THRESHOLD != 0) {
            cut = min(cut, max(log(tau * push.inv_threshold), push.least_cut));
        }
    }
    float alpha = 0.0;
    vec4 sums = vec4(0.0);
    if (e <= cut) {
        float exponent = -e;
        if (TEXTURED != 0) {
            exponent += texture_exponent(delta, in_turn, in_place, in_gain);
        }
        alpha = one_minus_exp(tau * exp(exponent));
        if (SUMS != 0) {
            sums = vec4(tau * exp(exponent), 1.0, 0.0, gl_FragCoord.z);
        }
    }
    out_color = SUMS != 0 ? sums : vec4(in_radiance * alpha, alpha);
}
