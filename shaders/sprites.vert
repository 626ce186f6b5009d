#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "blob.glsl"
#include "philox.glsl"
#include "functions.glsl"
#include "texture.glsl"

// A screen-aligned quad around each blob's silhouette, far to near (docs/model.md §9).

// 0: particle colours as given; 1: the radiance of the particle's facet.
layout(constant_id = 0) const uint LIT = 1;
// 1: the quad has its centre's depth, near/z, and surfaces hide it.
layout(constant_id = 1) const uint BEHIND = 0;
// 0: a facet a particle; 1: i_facet names it.
layout(constant_id = 2) const uint GROUPED = 0;

// 1: not all particles of a group are drawn, and those that are have weights.
layout(constant_id = 3) const uint WEIGHTED = 0;
// 1: some have textures.
layout(constant_id = 4) const uint TEXTURED = 0;
// 1: a sprite ends where its optical depth falls under a threshold.
layout(constant_id = 5) const uint THRESHOLD = 0;
// 1: some blobs are ellipsoids.
layout(constant_id = 6) const uint ELLIPSOIDS = 0;

layout(push_constant) uniform Push { Camera camera; vec2 pixel; float cutoff; uint i_first_facet; float inv_threshold; uint i_first; } push;
layout(std430, binding = 0) readonly buffer Entries { uvec2 entries[]; };
layout(std430, binding = 1) readonly buffer PlacedParticles { Placed placed[]; };
layout(std430, binding = 2) readonly buffer Particles { Particle particles[]; };
layout(std430, binding = 3) readonly buffer LitFacets { Lit lit[]; };
layout(std430, binding = 4) readonly buffer FacetOf { uint i_facet[]; };
layout(std430, binding = 5) readonly buffer GroupOf { uint i_group[]; };
layout(std430, binding = 6) readonly buffer DrawnGroups { Drawn drawn[]; };
layout(std430, binding = 7) readonly buffer TexturedGroups { Textured textured[]; };

// Centre's slopes (x/z, y/z), z^2/(2 sigma^2), optical depth through the centre.
layout(location = 0) flat out vec4 out_blob;
layout(location = 1) flat out vec3 out_radiance;
layout(location = 2) flat out vec4 out_turn;
layout(location = 3) flat out uvec2 out_place;
layout(location = 4) flat out vec3 out_gain;
// b^2/(2 sigma^2) where it ends; only where there is a threshold.
layout(location = 5) flat out float out_cut;
// Its conic and 1/a^2; only of ellipsoids.
layout(location = 6) flat out vec4 out_conic;

void main() {
    uint i = entries[push.i_first + gl_InstanceIndex].y;
    if (i == NO_PARTICLE) {
        // Nothing to draw: a quad without area.
        gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
        return;
    }
    vec3 c = placed[i].position - push.camera.eye;
    float sigma = placed[i].sigma;
    vec3 v = along_camera(push.camera, c);
    float tau = SQRT_TAU * particles[i].kappa * sigma;
    if (WEIGHTED != 0) {
        Drawn group = drawn[i_group[i]];
        tau *= group.kappa_scale * (i + 1u == group.end ? group.last_weight : 1.0);
    }
    float scale = 0.5 * (v.z / sigma) * (v.z / sigma);
    out_blob = vec4(v.xy / v.z, scale, tau);
    Shape shape = shape_of(push.camera, ELLIPSOIDS != 0 ? particles[i].aspect : 1.0);
    if (ELLIPSOIDS != 0) {
        out_conic = vec4(conic_of(shape, v.xy / v.z, scale), shape.inverse);
        tau *= shape.wider;
    }
    Sheet sheet = Sheet(vec4(0.0), uvec2(0), vec3(0.0));
    if (TEXTURED != 0) {
        sheet = sheet_of(textured[i_group[i]], i, v.z / sigma, push.pixel.y);
    }
    out_turn = sheet.turn;
    out_place = sheet.place;
    out_gain = sheet.gain;
    uint facet = GROUPED != 0 ? i_facet[i] : push.i_first_facet + i;
    out_radiance = LIT != 0 ? lit[facet].first + lit[facet].second : particles[i].color;
    float reach = push.cutoff;
    bool empty = !(tau > 0.0);
    if (THRESHOLD != 0) {
        out_cut = min(0.5 * push.cutoff * push.cutoff, log(tau * push.inv_threshold));
        empty = empty || !(out_cut > 0.0);
        reach = sqrt(2.0 * max(out_cut, 0.0));
    }
    if (!(v.z >= push.camera.near) || empty) {
        // Nothing to draw: a quad without area.
        gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
        return;
    }
    float r = GROWTH * reach * sigma;
    vec2 across, upward;
    if (ELLIPSOIDS != 0) {
        across = tangents_of(shape, v, 0, r);
        upward = tangents_of(shape, v, 1, r);
    } else {
        across = tangents(v.x, v.z, r);
        upward = tangents(v.y, v.z, r);
    }
    vec2 x = (across + vec2(-SNAP, SNAP) * push.pixel.x) / push.camera.tan_x;
    vec2 y = (upward + vec2(-SNAP, SNAP) * push.pixel.y) / push.camera.tan_y;
    // Only what lies on the screen: huge quads cost the rasteriser its accuracy.
    x = clamp(x, -1.0, 1.0);
    y = clamp(y, -1.0, 1.0);
    bool right = (gl_VertexIndex & 1) != 0, top = (gl_VertexIndex & 2) != 0;
    // At most 1: rounded up, near/near would be clipped.
    float depth = BEHIND != 0 ? min(push.camera.near / v.z, 1.0) : 0.0;
    gl_Position = vec4(right ? x.y : x.x, -(top ? y.y : y.x), depth, 1.0);
}
