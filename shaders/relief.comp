#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Tells which lights ground hides from its own points (model.md §16, passes.md "relief").
// In: the points relative to their ground's origin, lights, regions, boxes over the cells. Out:
// [point][light] 1 where a triangle lies between.
// Law: the way from a point meets a triangle, or dives below one whose corner the point is. Error:
// a way within EDGE of a triangle's side counts as meeting it.

layout(push_constant) uniform Push {
    uint n_points;
    uint n_lights;
    uint n_grounds;
    // Region of the first ground, and facet of its first point.
    uint i_first_region;
    uint i_first_ground;
} push;
READS(0, Facet, ground)
READS(1, Light, lights)
TEXELS(2, regions)
#include "regions.glsl"
READS(3, ReliefNode, nodes)
// [point][light]
WRITES(4, uint, hidden)

// Rounding of a place and of a way to a box, over the ground's extent: ten times the three
// roundings of 2^-24 that each takes, so that no way passes between two triangles. And its greatest
// share of a triangle's side.
const float EDGE = 2e-6;
const float MOST = 0.05;
// The same of a direction beside a triangle's side, radians.
const float ASIDE = 1e-5;
const uint NO_CELL = 0xFFFFFFFFu;

float greatest(vec3 v) {
    v = abs(v);
    return max(max(v.x, v.y), v.z);
}

struct Way {
    vec3 origin;
    vec3 direction;
    float distance;
    // Rounding of its places over the ground's extent: more where the way begins far from it.
    float rounding;
};

bool meets_box(Way way, vec3 low, vec3 high) {
    low -= way.rounding;
    high += way.rounding;
    float enter = 0.0, leave = way.distance;
    for (int axis = 0; axis < 3; ++axis) {
        float from = way.origin[axis], along = way.direction[axis];
        float a = (low[axis] - from) / along, b = (high[axis] - from) / along;
        bool is_level = along == 0.0, is_beside = from < low[axis] || from > high[axis];
        enter = is_level ? enter : max(enter, min(a, b));
        leave = is_level ? (is_beside ? -1.0 : leave) : min(leave, max(a, b));
    }
    return enter <= leave;
}

// Whether the way meets c + s u + t v with s, t >= 0 and s + t <= 1 (Moeller and Trumbore 1997).
bool meets_triangle(Way way, vec3 c, vec3 u, vec3 v) {
    float slack = min(way.rounding / max(greatest(u), greatest(v)), MOST);
    vec3 across = cross(way.direction, v);
    float inverse = 1.0 / dot(u, across);
    vec3 from = way.origin - c;
    float s = inverse * dot(from, across);
    vec3 q = cross(from, u);
    float t = inverse * dot(way.direction, q), z = inverse * dot(v, q);
    return s >= -slack && t >= -slack && s + t <= 1.0 + slack && z > 0.0 && z < way.distance;
}

// Returns point k of a cell: bit 0 along the row, bit 1 to the next row.
uint point_of(Region region, uint i_cell, uint k) {
    uint n = region.n_u - 1u;
    return (i_cell / n + (k >> 1)) * region.n_u + i_cell % n + (k & 1u);
}

// Whether a direction leads below a triangle from the corner where its sides u and v meet.
bool dives(vec3 d, vec3 u, vec3 v) {
    float inverse = 1.0 / (u.x * v.z - u.z * v.x);
    float s = inverse * (d.x * v.z - d.z * v.x), t = inverse * (u.x * d.z - u.z * d.x);
    float slack = ASIDE / max(greatest(u), greatest(v));
    return s >= -slack && t >= -slack && d.y < s * u.y + t * v.y;
}

// Whether the half of corners `i` hides: it lies on the way, or the way dives below it from point
// `i_own`, one of its corners.
bool is_barred_by(Way way, uvec3 i, uint i_own, vec3 a, vec3 b, vec3 c) {
    vec3 d = way.direction;
    if (i_own == i.x) {
        return dives(d, b - a, c - a);
    }
    if (i_own == i.y) {
        return dives(d, c - b, a - b);
    }
    if (i_own == i.z) {
        return dives(d, a - c, b - c);
    }
    return meets_triangle(way, a, b - a, c - a);
}

// Whether a half of the cell hides the light from point `i_own` of the ground.
bool is_barred_by_cell(Way way, Region region, uint i_cell, uint i_own, float inverse_extent) {
    uint first = region.i_first_facet - push.i_first_ground;
    uvec4 i = uvec4(
        point_of(region, i_cell, 0u), point_of(region, i_cell, 1u), point_of(region, i_cell, 2u),
        point_of(region, i_cell, 3u)
    );
    vec3 a = ground[first + i.x].position * inverse_extent;
    vec3 b = ground[first + i.y].position * inverse_extent;
    vec3 c = ground[first + i.z].position * inverse_extent;
    vec3 d = ground[first + i.w].position * inverse_extent;
    return is_barred_by(way, i.xyz, i_own, a, b, c) || is_barred_by(way, i.wzy, i_own, d, c, b);
}

void main() {
    FOR_EACH(k, push.n_points * push.n_lights) {
        uint i_point = k / push.n_lights;
        Facet own = ground[i_point];
        Light light = lights[k % push.n_lights];
        vec3 center = region_at(own.i_region).center;
        bool is_lamp = light.kind == LIGHT_POINT;
        bool is_asked = light.kind != LIGHT_SKY && any(notEqual(light.energy, vec3(0.0)));
        vec3 offset = light.position - center - own.position;
        float distance = is_lamp ? length(offset) : 3.4e38;
        Way way;
        way.direction = is_lamp ? offset / max(distance, 1e-30) : light.toward;
        bool is_hidden = false;
        uint node = 0u;
        for (uint g = 0u; g < push.n_grounds && is_asked; ++g) {
            uint i_region = push.i_first_region + g;
            Region region = region_at(i_region);
            float inverse_extent = 1.0 / max(greatest(region.u), 1e-30);
            way.origin = (own.position + (center - region.center)) * inverse_extent;
            way.distance = is_lamp ? distance * inverse_extent : distance;
            way.rounding = EDGE * max(greatest(way.origin), 1.0);
            uint first = region.i_first_facet - push.i_first_ground;
            uint i_own = own.i_region == i_region ? i_point - first : 0xFFFFFFFFu;
            uint end = nodes[node].end;
            while (node < end) {
                ReliefNode box = nodes[node];
                bool is_met = !is_hidden && meets_box(way, box.low, box.high);
                if (is_met && box.i_cell != NO_CELL) {
                    is_hidden = is_barred_by_cell(way, region, box.i_cell, i_own, inverse_extent);
                }
                node = is_hidden ? end : is_met ? node + 1u : box.end;
            }
        }
        hidden[k] = is_hidden ? 1u : 0u;
    }
}
