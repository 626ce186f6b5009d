#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "camera.glsl"
#include "plane.glsl"

// Draws a cell of the ground: a strip of two triangles over four points (model.md
// §16). The rasteriser decides which pixels they cover. The fragment shader intersects the pixel's
// ray with the triangle's plane, which the first vertex of each triangle passes on. In: ground
// facets relative to their origin, radiance. Out: the strip, and a plane and three radiances a
// triangle.

layout(push_constant) uniform Push {
    Camera camera;
    vec2 pixel;
    uint i_region;
    uint i_first_ground;
} push;
READS(0, Region, regions)
READS(1, Facet, ground)
READS(2, Lit, lit)

layout(location = 0) flat out vec4 out_plane;
layout(location = 1) flat out vec4 out_s;
layout(location = 2) flat out vec4 out_t;
// Depths of the nearest and the farthest corner.
layout(location = 3) flat out vec2 out_depths;
// At the corner, at the end of u, at the end of v.
layout(location = 4) flat out vec3 out_corner;
layout(location = 5) flat out vec3 out_along;
layout(location = 6) flat out vec3 out_across;

vec3 radiance_of(uint i) { return lit[i].first + lit[i].second; }

// Returns point k of the cell at row and column `at`: bit 0 along the row, bit 1 to the next row.
uint point_of(uint n_u, uvec2 at, uint k) { return (at.y + (k >> 1)) * n_u + at.x + (k & 1u); }

void main() {
    Region region = regions[push.i_region];
    uint n = region.n_u - 1u, i_cell = gl_InstanceIndex;
    uvec2 at = uvec2(i_cell % n, i_cell / n);
    // Flat values come from vertices 0 and 1, the first of the strip's triangles 0 1 2 and 1 3 2.
    bool second = gl_VertexIndex == 1;
    uint a = point_of(region.n_u, at, second ? 3u : 0u);
    uint b = point_of(region.n_u, at, second ? 2u : 1u);
    uint d = point_of(region.n_u, at, second ? 1u : 2u);
    uint first = region.i_first_facet - push.i_first_ground;
    vec3 from_eye = region.center - push.camera.eye;
    vec3 p = ground[first + a].position;
    vec3 u = ground[first + b].position - p, v = ground[first + d].position - p;
    vec3 c = along_camera(push.camera, p + from_eye);
    float length_u = max(greatest(u), 1e-30), length_v = max(greatest(v), 1e-30);
    u = along_camera(push.camera, u / length_u);
    v = along_camera(push.camera, v / length_v);
    RayPlane plane = ray_plane(c, u, v, length_u, length_v);
    // From over the ground and above all of it, a back shows only where the rasteriser rounds a
    // ridge, unless the near plane cuts the ground.
    vec3 over = abs(push.camera.eye - region.center);
    float cut = push.camera.near * length(vec3(push.camera.tan_x, push.camera.tan_y, 1.0));
    bool is_above = push.camera.eye.y > region.center.y + region.u.y + cut
                    && over.x < region.u.x && over.z < region.u.z;
    plane.normal.w = is_above ? max(plane.normal.w, 0.0) : plane.normal.w;
    out_plane = plane.normal;
    out_s = plane.s;
    out_t = plane.t;
    vec3 z = vec3(c.z, c.z + u.z * length_u, c.z + v.z * length_v);
    out_depths = vec2(min(min(z.x, z.y), z.z), max(max(z.x, z.y), z.z));
    out_corner = radiance_of(region.i_first_facet + a);
    out_along = radiance_of(region.i_first_facet + b);
    out_across = radiance_of(region.i_first_facet + d);

    uint own = point_of(region.n_u, at, gl_VertexIndex);
    vec3 seen = along_camera(push.camera, ground[first + own].position + from_eye);
    // Depth near/z; before the near plane it is above 1 and clipped.
    gl_Position =
        vec4(seen.x / push.camera.tan_x, -seen.y / push.camera.tan_y, push.camera.near, seen.z);
}
