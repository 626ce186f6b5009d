#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "camera.glsl"
#include "variants.glsl"
#include "philox.glsl"
#include "functions.glsl"
#include "seen.glsl"
#include "target.glsl"

TEXELS(8, pool)
#define SAMPLES_TEXTURE
#include "texture.glsl"

// Computes a thin Gaussian blob's opacity along the pixel's ray (model.md §9, passes.md
// "sprites"). In: the blob from sprites.vert. Out: premultiplied colour and opacity, 1 - e^-tau.
// Law: tau = sqrt(2 pi) kappa sigma e^(-b^2/2 sigma^2), b the ray's distance from the centre.

#include "sprites.glsl"

// 1: writes the layer's optical depth, 1, 0 and its depth near/z in place of colour and opacity.
layout(constant_id = 8) const uint SUMS = 0;
// 1: the light changes linearly across a blob.
layout(constant_id = 12) const uint SHADED = 0;

layout(location = 0) flat in vec4 in_blob;
layout(location = 1) flat in vec3 in_radiance;
layout(location = 2) flat in vec4 in_turn;
layout(location = 3) flat in uvec2 in_place;
layout(location = 4) flat in vec3 in_gain;
layout(location = 5) flat in float in_lowest;
layout(location = 6) flat in vec4 in_conic;
layout(location = 7) flat in vec4 in_screen;
layout(location = 8) flat in vec3 in_shade;
layout(location = 9) flat in vec2 in_lean;
layout(location = 0) out vec4 out_color;

const float LOG2_E = 1.44269504089;

void main() {
    vec2 at = gl_FragCoord.xy * in_screen.xy;
    vec2 ray = vec2(at.x - in_screen.z, in_screen.w - at.y);
    // b^2 = |c x d|^2/|d|^2 with c = z (s, 1) and d = (s + delta, 1). Only the subtraction for
    // delta can cancel.
    vec2 s = in_blob.xy;
    vec2 delta = ray - s;
    float twist = s.x * delta.y - s.y * delta.x;
    // -b^2/(2 sigma^2), in powers of two.
    float exponent = in_blob.z * (dot(delta, delta) + twist * twist) / (1.0 + dot(ray, ray));
    float lowest = in_lowest, tau = in_blob.w;
    if (ELLIPSOIDS == 2) {
        float across = in_conic.x * delta.x * delta.x + in_conic.y * delta.x * delta.y
                       + in_conic.z * delta.y * delta.y;
        float along = 1.0 + dot(in_lean, delta);
        float white = in_conic.w * along * along + across / (in_blob.z * in_conic.w);
        exponent = across / white;
        tau *= sqrt((1.0 + dot(ray, ray)) / white);
    } else if (ELLIPSOIDS != 0) {
        // |M d|^2, and |d|/|M d|: the ray's length in the scene over that in the ball's
        // coordinates.
        vec3 d = vec3(ray, 1.0),
             y = vec3(push.camera.right.y, push.camera.up.y, push.camera.forward.y);
        float up = dot(y, d);
        vec3 across = d - up * y;
        float rest = dot(across, across), white = rest + in_conic.w * up * up;
        exponent = (in_conic.x * delta.x * delta.x + in_conic.y * delta.x * delta.y
                    + in_conic.z * delta.y * delta.y)
                   / white;
        tau *= sqrt((rest + up * up) / white);
    }
    if (ELLIPSOIDS != 0 && THRESHOLD != 0) {
        float cut = max(log(tau * push.inv_threshold), push.least_cut);
        lowest = max(lowest, -LOG2_E * cut);
    }
    float alpha = 0.0;
    vec3 radiance = in_radiance;
    vec4 sums = vec4(0.0);
    if (exponent >= lowest) {
        if (TEXTURED != 0) {
            exponent += LOG2_E * texture_exponent(delta, in_turn, in_place, in_gain);
        }
        tau *= exp2(exponent);
        alpha = THIN != 0 ? thin_opacity(tau) : one_minus_exp(tau);
        if (SHADED != 0) {
            float seen = min(tau, DEEPEST_SEEN);
            seen *= SEEN_BEFORE.x + SEEN_BEFORE.y * seen;
            radiance *= max(1.0 + dot(in_shade, vec3(delta, seen)), 0.0);
            radiance = in_target(radiance);
        }
        if (SUMS != 0) {
            sums = vec4(tau, 1.0, 0.0, gl_FragCoord.z);
        }
    }
    out_color = SUMS != 0 ? sums : vec4(radiance * alpha, alpha);
}
