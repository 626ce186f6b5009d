#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "target.glsl"
#include "camera.glsl"

// 1: surfaces hide blobs and are not seen.
layout(constant_id = 0) const uint DEPTH_ONLY = 0;

// Intersects the pixel's ray with a rectangle (passes.md "surfaces").
// In: the rectangle from surfaces.vert, radiance of facets. Out: depth near/z, and the radiance
// there, interpolated between facets.

layout(push_constant) uniform Push {
    Camera camera;
    vec2 pixel;
    vec2 unused;
} push;
READS(0, Region, regions)
READS(1, Lit, lit)

layout(location = 0) flat in uint in_i;
layout(location = 1) flat in vec4 in_plane;
layout(location = 2) flat in vec4 in_s;
layout(location = 3) flat in vec4 in_t;
layout(location = 0) out vec4 out_color;

vec3 radiance_of(uint i) { return lit[i].first + lit[i].second; }

// Returns the radiance between the centres of the facets around (s, t), both in [-1, 1].
vec3 interpolated(Region region, vec2 st) {
    uvec2 n = uvec2(region.n_u, region.n_v);
    vec2 at = clamp((0.5 * st + 0.5) * vec2(n) - 0.5, vec2(0.0), vec2(n - 1));
    uvec2 low = uvec2(at);
    uvec2 high = min(low + 1, n - 1);
    vec2 share = at - vec2(low);
    uint row = region.i_first_facet + low.y * n.x, next = region.i_first_facet + high.y * n.x;
    vec3 below = mix(radiance_of(row + low.x), radiance_of(row + high.x), share.x);
    vec3 above = mix(radiance_of(next + low.x), radiance_of(next + high.x), share.x);
    return mix(below, above, share.y);
}

void main() {
    vec3 ray = ray_through(push.camera, gl_FragCoord.xy, push.pixel);
    // z ray = C + s u + t v by Cramer's rule: z = q/d, s = (ray.(V x C))/(|u| d), t = (ray.(C x
    // U))/(|v| d).
    float d = dot(ray, in_plane.xyz), size = abs(d);
    float q = d < 0.0 ? -in_plane.w : in_plane.w;
    float s = dot(ray, in_s.xyz), t = dot(ray, in_t.xyz);
    // Without division a ray along the plane is no special case.
    bool is_hit = q > 0.0 && q >= push.camera.near * size && abs(s) <= in_s.w * size
                  && abs(t) <= in_t.w * size;
    if (!is_hit) {
        discard;
    }
    gl_FragDepth = min(push.camera.near * size / q, 1.0);
    // (right, up, forward) is left-handed: the triple product of the front side, which faces the
    // eye, is positive.
    if (DEPTH_ONLY != 0) {
        out_color = vec4(0.0);
        return;
    }
    vec3 radiance = vec3(0.0);
    if (in_plane.w > 0.0) {
        radiance = interpolated(regions[in_i], vec2(s, t) / (vec2(in_s.w, in_t.w) * d));
    }
    out_color = vec4(in_target(radiance), 1.0);
}
