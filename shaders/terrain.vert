#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"

// A cell of the ground: a strip of two triangles over four points (docs/model.md §16). The
// rasteriser says which pixels they cover; what is seen in one follows from its own ray and the
// triangle's plane, which the first vertex of each hands on.

layout(push_constant) uniform Push { Camera camera; vec2 pixel; uint i_region; uint i_first_ground; } push;
layout(std430, binding = 0) readonly buffer Regions { Region regions[]; };
layout(std430, binding = 1) readonly buffer Ground { Facet ground[]; };
layout(std430, binding = 2) readonly buffer LitFacets { Lit lit[]; };

// U x V, C.(U x V); V x C, |u|; C x U, |v|: corner C from the eye, U = u/|u|, V = v/|v|, all along
// (right, up, forward), where |.| is the greatest component.
layout(location = 0) flat out vec4 out_plane;
layout(location = 1) flat out vec4 out_s;
layout(location = 2) flat out vec4 out_t;
// Depths of the nearest and the farthest corner.
layout(location = 3) flat out vec2 out_depths;
// At the corner, at the end of u, at the end of v.
layout(location = 4) flat out vec3 out_corner;
layout(location = 5) flat out vec3 out_along;
layout(location = 6) flat out vec3 out_across;

vec3 along_view(vec3 v) {
    return vec3(dot(push.camera.right, v), dot(push.camera.up, v), dot(push.camera.forward, v));
}

float greatest(vec3 v) {
    v = abs(v);
    return max(max(v.x, v.y), v.z);
}

vec3 radiance_of(uint i) {
    return lit[i].first + lit[i].second;
}

// Point `k` of the cell at row and column `at`: bit 0 along the row, bit 1 to the next.
uint point_of(uint n_u, uvec2 at, uint k) {
    return (at.y + (k >> 1)) * n_u + at.x + (k & 1u);
}

void main() {
    Region region = regions[push.i_region];
    uint n = region.n_u - 1u, i_cell = gl_InstanceIndex;
    uvec2 at = uvec2(i_cell % n, i_cell / n);
    // Of the strip's triangles 0 1 2 and 1 3 2 vertices 0 and 1 are the ones that flat values are
    // taken from.
    bool second = gl_VertexIndex == 1;
    uint a = point_of(region.n_u, at, second ? 3u : 0u);
    uint b = point_of(region.n_u, at, second ? 2u : 1u);
    uint d = point_of(region.n_u, at, second ? 1u : 2u);
    uint first = region.i_first_facet - push.i_first_ground;
    vec3 from_eye = region.center - push.camera.eye;
    vec3 p = ground[first + a].position;
    vec3 u = ground[first + b].position - p, v = ground[first + d].position - p;
    vec3 c = along_view(p + from_eye);
    float length_u = max(greatest(u), 1e-30), length_v = max(greatest(v), 1e-30);
    u = along_view(u / length_u);
    v = along_view(v / length_v);
    vec3 normal = cross(u, v);
    out_plane = vec4(normal, dot(c, normal));
    out_s = vec4(cross(v, c), length_u);
    out_t = vec4(cross(c, u), length_v);
    vec3 z = vec3(c.z, c.z + u.z * length_u, c.z + v.z * length_v);
    out_depths = vec2(min(min(z.x, z.y), z.z), max(max(z.x, z.y), z.z));
    out_corner = radiance_of(region.i_first_facet + a);
    out_along = radiance_of(region.i_first_facet + b);
    out_across = radiance_of(region.i_first_facet + d);

    uint own = point_of(region.n_u, at, gl_VertexIndex);
    vec3 seen = along_view(ground[first + own].position + from_eye);
    // Depth near/z; before the near plane it is above 1 and cut off.
    gl_Position = vec4(seen.x / push.camera.tan_x, -seen.y / push.camera.tan_y, push.camera.near, seen.z);
}
