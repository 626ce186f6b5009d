#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "blob.glsl"
#include "shade.glsl"
#include "strip.glsl"
#include "target.glsl"
#include "philox.glsl"
#include "functions.glsl"
#include "texture.glsl"

// Draws a screen-aligned quad or point around each blob's silhouette, far to near (model.md §9,
// passes.md "sprites"). In: sorted entries, placed particles, radiance of facets. Out: the quad
// or point, and the blob for sprites.frag. Bound: it is widened by more than its rounding; the
// pixel's own test decides.

#include "sprites.glsl"
READS(0, uvec2, entries)
TEXELS(1, placed)
TEXELS(2, particles)
READS(3, Lit, lit)
READS(4, uint, i_facet)
READS(5, uint, i_group)
READS(6, Drawn, drawn)
READS(7, Textured, textured)
READS(9, Slope, slopes)

// 0: a quad a blob, a strip of four vertices; 1: a point, which is a square.
layout(constant_id = 10) const uint POINTS = 0;

const float LOG2_E = 1.44269504089;
// Greatest radiance of a part of a blob over that of its centre. The light changes by 1/4 over a
// sigma. A part is up to 8 sigma to the side, which the angle of view may double, and before it.
const float BRIGHTER = 5.5;
// A device may round the side of a point. The host takes points only where it rounds by no more
// than this (max_point_size).
const float POINT_STEP = 1.0 / 8.0;

// All that the fragments of balls need: llvmpipe fetches a push constant again for each of them.
// The centre's slopes (x/z, y/z), -z^2/(2 sigma^2) in powers of two, optical depth through the
// centre.
layout(location = 0) flat out vec4 out_blob;
layout(location = 1) flat out vec3 out_radiance;
layout(location = 2) flat out vec4 out_turn;
layout(location = 3) flat out uvec2 out_place;
layout(location = 4) flat out vec3 out_gain;
// The exponent at the sprite's end, in powers of two.
layout(location = 5) flat out float out_lowest;
// Conic and 1/a^2; only for ellipsoids.
layout(location = 6) flat out vec4 out_conic;
// Sides of a pixel, as slopes, and the camera's tangents.
layout(location = 7) flat out vec4 out_screen;
// Changes of the light; only where blobs are shaded.
layout(location = 8) flat out vec3 out_shade;
layout(location = 9) flat out vec2 out_lean;

// Draws nothing: a place that is clipped.
void draw_nothing() {
    gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
    gl_PointSize = 1.0;
}

void main() {
    uint i = entries[push.i_first + (POINTS != 0 ? gl_VertexIndex : gl_InstanceIndex)].y;
    if (i == NO_PARTICLE) {
        draw_nothing();
        return;
    }
    Placed blob = PLACED_AT(i);
    Particle particle = PARTICLE_AT(i);
    vec3 c = blob.position - push.camera.eye;
    float sigma = blob.sigma;
    vec3 v = along_camera(push.camera, c);
    float tau = SQRT_TAU * particle.kappa * sigma;
    if (WEIGHTED != 0) {
        tau *= weight_of(drawn[i_group[i]], i);
    }
    float scale = -0.5 * LOG2_E * (v.z / sigma) * (v.z / sigma);
    out_blob = vec4(v.xy / v.z, scale, tau);
    Shape shape = upright_shape(push.camera, 1.0);
    out_lean = vec2(0.0);
    if (ELLIPSOIDS != 0) {
        shape = shape_of(push.camera, particle.aspect, particle.aspect_z, particle.turn);
        out_conic = vec4(conic_of(shape, v.xy / v.z, scale), shape.inverse);
        tau *= shape.wider;
    }
    if (ELLIPSOIDS == 2) {
        Lean lean = lean_of(shape, v.xy / v.z);
        out_conic.w = lean.white;
        out_lean = lean.lean;
    }
    TextureSample texture_sample = TextureSample(vec4(0.0), uvec2(0), vec3(0.0));
    if (TEXTURED != 0) {
        texture_sample = texture_sample_of(textured[i_group[i]], i, v.z / sigma, push.pixel.y);
    }
    out_turn = texture_sample.turn;
    out_place = texture_sample.place;
    out_gain = texture_sample.gain;
    uint facet = GROUPED != 0 ? i_facet[i] : push.i_first_facet + i;
    vec3 radiance = LIT != 0 ? lit[facet].first + lit[facet].second : particle.color;
    float most = 1.0;
    out_shade = vec3(0.0);
    if (SHADED != 0) {
        Shade shade =
            shade_of(push.camera, slopes[facet], shape, blob.position, v, sigma);
        radiance *= shade.base;
        out_shade = shade.seen;
        most = BRIGHTER;
    }
    out_radiance = in_target(radiance);
    float cut = 0.5 * push.cutoff * push.cutoff;
    if (THRESHOLD != 0) {
        cut = min(cut, max(log(tau * push.inv_threshold), push.least_cut));
    }
    if (BYTES != 0 && TEXTURED == 0) {
        cut = min(cut, log(tau * inv_least_shown(most * out_radiance)));
    }
    out_lowest = -LOG2_E * cut;
    out_screen = vec4(push.pixel, push.camera.tan_x, push.camera.tan_y);
    if (!(v.z >= push.camera.near) || !(tau > 0.0) || !(cut > 0.0)) {
        draw_nothing();
        return;
    }
    float r = GROWTH * sqrt(2.0 * cut) * sigma;
    vec2 across = tangents_along(shape, v, 0, r), upward = tangents_along(shape, v, 1, r);
    vec2 x = (across + vec2(-SNAP, SNAP) * push.pixel.x) / push.camera.tan_x;
    vec2 y = (upward + vec2(-SNAP, SNAP) * push.pixel.y) / push.camera.tan_y;
    // Clamped to the screen: huge quads cost the rasteriser its accuracy.
    x = clamp(x, -1.0, 1.0);
    y = clamp(y, -1.0, 1.0);
    // At most 1: near/near, rounded up, would be clipped.
    float depth = BEHIND != 0 ? min(push.camera.near / v.z, 1.0) : 0.0;
    if (POINTS != 0) {
        // From -1 to 1 there are 2 tan/pixel pixels.
        vec2 sides = vec2(x.y - x.x, y.y - y.x) * vec2(push.camera.tan_x, push.camera.tan_y)
                     / push.pixel;
        if (!(min(sides.x, sides.y) > 0.0)) {
            draw_nothing();
            return;
        }
        gl_Position = vec4(0.5 * (x.x + x.y), -0.5 * (y.x + y.y), depth, 1.0);
        gl_PointSize = max(sides.x, sides.y) + POINT_STEP;
        return;
    }
    vec2 corner = corner_of_strip(vec2(x.x, y.x), vec2(x.y, y.y));
    gl_Position = vec4(corner.x, -corner.y, depth, 1.0);
    gl_PointSize = 1.0;
}
