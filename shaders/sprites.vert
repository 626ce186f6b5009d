#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "blob.glsl"
#include "strip.glsl"
#include "half.glsl"
#include "philox.glsl"
#include "functions.glsl"
#include "texture.glsl"

// Draws a screen-aligned quad around each blob's silhouette, far to near (model.md §9, passes.md
// "sprites"). In: sorted entries, placed particles, radiance of facets. Out: the quad, and the blob
// for sprites.frag. Bound: the quad is widened by more than its rounding; the pixel's own test
// decides.

#include "sprites.glsl"
READS(0, uvec2, entries)
READS(1, Placed, placed)
READS(2, Particle, particles)
READS(3, Lit, lit)
READS(4, uint, i_facet)
READS(5, uint, i_group)
READS(6, Drawn, drawn)
READS(7, Textured, textured)

// The centre's slopes (x/z, y/z), z^2/(2 sigma^2), optical depth through the centre.
layout(location = 0) flat out vec4 out_blob;
layout(location = 1) flat out vec3 out_radiance;
layout(location = 2) flat out vec4 out_turn;
layout(location = 3) flat out uvec2 out_place;
layout(location = 4) flat out vec3 out_gain;
// b^2/(2 sigma^2) at the sprite's end; only with a threshold.
layout(location = 5) flat out float out_cut;
// Conic and 1/a^2; only for ellipsoids.
layout(location = 6) flat out vec4 out_conic;

void main() {
    uint i = entries[push.i_first + gl_InstanceIndex].y;
    if (i == NO_PARTICLE) {
        // Draws nothing: a quad without area.
        gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
        return;
    }
    vec3 c = placed[i].position - push.camera.eye;
    float sigma = placed[i].sigma;
    vec3 v = along_camera(push.camera, c);
    float tau = SQRT_TAU * particles[i].kappa * sigma;
    if (WEIGHTED != 0) {
        tau *= weight_of(drawn[i_group[i]], i);
    }
    float scale = 0.5 * (v.z / sigma) * (v.z / sigma);
    out_blob = vec4(v.xy / v.z, scale, tau);
    Shape shape = shape_of(push.camera, ELLIPSOIDS != 0 ? particles[i].aspect : 1.0);
    if (ELLIPSOIDS != 0) {
        out_conic = vec4(conic_of(shape, v.xy / v.z, scale), shape.inverse);
        tau *= shape.wider;
    }
    TextureSample texture_sample = TextureSample(vec4(0.0), uvec2(0), vec3(0.0));
    if (TEXTURED != 0) {
        texture_sample = texture_sample_of(textured[i_group[i]], i, v.z / sigma, push.pixel.y);
    }
    out_turn = texture_sample.turn;
    out_place = texture_sample.place;
    out_gain = texture_sample.gain;
    uint facet = GROUPED != 0 ? i_facet[i] : push.i_first_facet + i;
    out_radiance = in_target(LIT != 0 ? lit[facet].first + lit[facet].second : particles[i].color);
    float reach = push.cutoff;
    bool empty = !(tau > 0.0);
    if (THRESHOLD != 0) {
        out_cut = max(log(tau * push.inv_threshold), push.least_cut);
        out_cut = min(0.5 * push.cutoff * push.cutoff, out_cut);
        empty = empty || !(out_cut > 0.0);
        reach = sqrt(2.0 * max(out_cut, 0.0));
    }
    if (!(v.z >= push.camera.near) || empty) {
        // Draws nothing: a quad without area.
        gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
        return;
    }
    float r = GROWTH * reach * sigma;
    vec2 across = tangents_along(shape, v, 0, r), upward = tangents_along(shape, v, 1, r);
    vec2 x = (across + vec2(-SNAP, SNAP) * push.pixel.x) / push.camera.tan_x;
    vec2 y = (upward + vec2(-SNAP, SNAP) * push.pixel.y) / push.camera.tan_y;
    // Clamped to the screen: huge quads cost the rasteriser its accuracy.
    x = clamp(x, -1.0, 1.0);
    y = clamp(y, -1.0, 1.0);
    vec2 corner = corner_of_strip(vec2(x.x, y.x), vec2(x.y, y.y));
    // At most 1: near/near, rounded up, would be clipped.
    float depth = BEHIND != 0 ? min(push.camera.near / v.z, 1.0) : 0.0;
    gl_Position = vec4(corner.x, -corner.y, depth, 1.0);
}
