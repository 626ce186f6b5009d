#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "target.glsl"
#include "camera.glsl"

// 1: ground hides blobs and is not seen.
layout(constant_id = 0) const uint DEPTH_ONLY = 0;

// Intersects the pixel's ray with a triangle's plane, no farther out than the triangle reaches
// (model.md §16).
// In: the triangle from terrain.vert. Out: depth near/z, and the radiance there, interpolated
// between the corners.

layout(push_constant) uniform Push {
    Camera camera;
    vec2 pixel;
    uint i_region;
    uint i_first_ground;
} push;

layout(location = 0) flat in vec4 in_plane;
layout(location = 1) flat in vec4 in_s;
layout(location = 2) flat in vec4 in_t;
layout(location = 3) flat in vec2 in_depths;
layout(location = 4) flat in vec3 in_corner;
layout(location = 5) flat in vec3 in_along;
layout(location = 6) flat in vec3 in_across;
layout(location = 0) out vec4 out_color;

// Below this a ray runs along the plane: all of the triangle lies in one row of pixels.
const float LEAST = 1e-30;

void main() {
    // Edge-on, or a back that cannot be seen.
    if (in_plane.w == 0.0) {
        discard;
    }
    vec3 ray = ray_through(push.camera, gl_FragCoord.xy, push.pixel);
    // z ray = C + s u + t v by Cramer's rule.
    float d = dot(ray, in_plane.xyz);
    float inverse = 1.0 / (abs(d) > LEAST ? d : LEAST);
    float z = clamp(
        in_plane.w * inverse, max(in_depths.x, push.camera.near), max(in_depths.y, push.camera.near)
    );
    gl_FragDepth = min(push.camera.near / z, 1.0);
    if (DEPTH_ONLY != 0) {
        out_color = vec4(0.0);
        return;
    }
    vec3 radiance = vec3(0.0);
    // The front faces the eye.
    if (in_plane.w > 0.0) {
        float s = clamp(dot(ray, in_s.xyz) * inverse / in_s.w, 0.0, 1.0);
        float t = clamp(dot(ray, in_t.xyz) * inverse / in_t.w, 0.0, 1.0 - s);
        radiance = in_corner * (1.0 - s - t) + in_along * s + in_across * t;
    }
    out_color = vec4(in_target(radiance), 1.0);
}
