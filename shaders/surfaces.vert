#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "camera.glsl"
#include "plane.glsl"
#include "strip.glsl"

// Draws a screen-aligned quad around the visible part of each rectangle (passes.md
// "surfaces"). The fragment shader's own test decides which pixels the rectangle covers, so that
// clipping and snapping of far corners do not.
// In: regions, the camera. Out: the quad, and the rectangle's plane for surfaces.frag.
// Bound: the quad is widened by ROUNDING and SNAP, more than its corners can err.

layout(push_constant) uniform Push {
    Camera camera;
    vec2 pixel;
    vec2 unused;
} push;
READS(0, Region, regions)

layout(location = 0) flat out uint out_i;
layout(location = 1) flat out vec4 out_plane;
layout(location = 2) flat out vec4 out_s;
layout(location = 3) flat out vec4 out_t;

// A corner's coordinate errs by less than this share of |C|_1 + |u|_1 + |v|_1. Roundings in units
// of 2^-24 of that sum: 1 for C's subtraction, 6 for dividing u and v by their lengths and
// multiplying again, 3 for the dot product, 2 for the sums. A crossing of the near plane adds 13:
// two differences, a quotient of 5, product, sum, and those of both ends. Together 25, 1.5e-6.
const float ROUNDING = 2e-6;

// Widens low and high to the slopes of p, which errs by at most e < z/2 along each axis.
void widen(inout vec2 low, inout vec2 high, vec3 p, float e) {
    vec2 slope = p.xy / p.z;
    vec2 pad = (1.0 + abs(slope)) * (2.0 * e / p.z) + SNAP * push.pixel;
    low = min(low, slope - pad);
    high = max(high, slope + pad);
}

void main() {
    Region region = regions[gl_InstanceIndex];
    vec3 from_eye = region.center - push.camera.eye;
    float length_u = greatest(region.u), length_v = greatest(region.v);
    vec3 c = along_camera(push.camera, from_eye),
         u = along_camera(push.camera, region.u / length_u),
         v = along_camera(push.camera, region.v / length_v);
    out_i = gl_InstanceIndex;
    RayPlane plane = ray_plane(c, u, v, length_u, length_v);
    out_plane = plane.normal;
    out_s = plane.s;
    out_t = plane.t;

    vec2 tangents = vec2(push.camera.tan_x, push.camera.tan_y);
    vec2 low = tangents, high = -tangents;
    float e = ROUNDING * dot(abs(from_eye) + abs(region.u) + abs(region.v), vec3(1.0));
    float near = push.camera.near - e;
    if (e < 0.25 * push.camera.near) {
        // The corners before the plane, and the points where the sides cross it.
        u *= length_u;
        v *= length_v;
        for (int k = 0; k < 4; ++k) {
            vec3 a = c + (k == 0 || k == 3 ? -u : u) + (k < 2 ? -v : v);
            vec3 b = c + (k >= 2 ? -u : u) + (k == 0 || k == 3 ? -v : v);
            if (a.z >= near) {
                widen(low, high, a, e);
            }
            if ((a.z >= near) != (b.z >= near)) {
                widen(low, high, vec3(mix(a.xy, b.xy, (near - a.z) / (b.z - a.z)), near), e);
            }
        }
    } else {
        // The near plane lies within the error: the whole screen.
        low = -tangents;
        high = tangents;
    }
    low = clamp(low / tangents, -1.0, 1.0);
    high = clamp(high / tangents, -1.0, 1.0);
    vec2 corner = corner_of_strip(low, high);
    gl_Position = vec4(corner.x, -corner.y, 0.0, 1.0);
    if (!all(lessThan(low, high))) {
        // Draws nothing: a quad without area.
        gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
    }
}
