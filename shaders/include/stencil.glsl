// A cell of a surface's facet seen point by point: 4 x 4 points, each the middle of a part whose
// share in light and shadow is found along straight edges (docs/model.md §11 "second"). Needs
// light.glsl and occlude.glsl.

// Points along each half axis.
const vec4 ALONG = vec4(-0.75, -0.25, 0.25, 0.75);

// A number at every point: rows along v, components along u. Rows are named: a device that keeps an
// indexed array in memory would gather and scatter it.
struct Stencil { vec4 a; vec4 b; vec4 c; vec4 d; };

// A cell: middle, half axes.
struct Cell { vec3 middle; vec3 u; vec3 v; };

// Linear over the cell: middle + ALONG u + ALONG v.
struct Plane { float middle; float u; float v; };

vec4 on_row(Plane plane, float along) { return (plane.middle + along * plane.v) + ALONG * plane.u; }

// For how much of each point's part is where the plane is positive: as a ramp as long as the part,
// with its middle on the edge; exact for edges along the axes.
Plane ramp(Plane plane) {
    float steep = 2.0 * inversesqrt(max(plane.u * plane.u + plane.v * plane.v, 1e-30));
    return Plane(0.5 + steep * plane.middle, steep * plane.u, steep * plane.v);
}

vec4 inside(Plane ramp, float along) { return clamp(on_row(ramp, along), 0.0, 1.0); }

// cos cos/d^2 over one row of parts, but for the source's cosine times d: the means over the parts
// as rectangle_form has them, of half axes u/4 and v/4; of parts wider than their distance a
// disc's. `o` the row's middle from the receiver.
vec4 row_of_forms(vec3 o, vec3 u, vec3 v, vec3 receiver_normal, float part) {
    float uu = 0.0625 * dot(u, u), vv = 0.0625 * dot(v, v);
    float nu = dot(receiver_normal, u), nv = dot(receiver_normal, v);
    vec4 facing = dot(receiver_normal, o) + ALONG * nu;
    // Axes are perpendicular.
    float ou = dot(o, u), ov = dot(o, v);
    vec4 d2 = max(dot(o, o) + ALONG * (2.0 * ou) + ALONG * ALONG * (16.0 * uu), 1e-30);
    vec4 inverse = 1.0 / d2;
    vec4 along_u = 0.25 * (ou + ALONG * (16.0 * uu));
    float along_v = 0.25 * ov;
    vec4 bent = facing * (6.0 * inverse * (along_u * along_u + along_v * along_v) - (uu + vv)) - 0.5 * (nu * along_u + nv * along_v);
    vec4 mean = max(facing + bent * inverse * (2.0 / 3.0), 0.0) * inverse * inverse;
    vec4 disc = facing * inverse / (d2 + part);
    bvec4 near = lessThan(d2, vec4(4.0 * max(uu, vv)));
    return mix(mix(mean, disc, near), vec4(0.0), lessThanEqual(facing, vec4(0.0)));
}

// cos cos/d^2 at each point of a cell of area A to a receiver at p.
Stencil forms(Cell cell, vec3 normal, vec3 receiver_normal, vec3 p, float area) {
    vec3 o = cell.middle - p;
    float part = area * (0.0625 * 0.318309886183791);
    float height = max(-dot(normal, o), 0.0);
    return Stencil(
        height * row_of_forms(o + ALONG.x * cell.v, cell.u, cell.v, receiver_normal, part),
        height * row_of_forms(o + ALONG.y * cell.v, cell.u, cell.v, receiver_normal, part),
        height * row_of_forms(o + ALONG.z * cell.v, cell.u, cell.v, receiver_normal, part),
        height * row_of_forms(o + ALONG.w * cell.v, cell.u, cell.v, receiver_normal, part));
}

// A rectangle's shadow as four ramps, and one for what is beyond its plane.
struct Edges { Plane left; Plane right; Plane below; Plane above; Plane beyond; };

// What of each part of one row it leaves. Of opposite edges the shadow is what both have.
vec4 left_of_row(Edges e, float along) {
    vec4 across = max(inside(e.left, along) + inside(e.right, along) - 1.0, 0.0);
    vec4 up = max(inside(e.below, along) + inside(e.above, along) - 1.0, 0.0);
    return 1.0 - across * up * inside(e.beyond, along);
}

Plane combined(float a, Plane x, float b, Plane y) {
    return Plane(a * x.middle + b * y.middle, a * x.u + b * y.u, a * x.v + b * y.v);
}

// The edges of the shadow that a rectangle throws onto a cell, seen from p, or in direction p where
// `at` is 0.
Edges edges_of(Region r, vec3 p, float at, Cell cell) {
    float a = at > 0.0 ? side_of(r, p) : dot(r.normal, p);
    float toward = -sign(a), reach = abs(a);
    vec3 o = cell.middle - r.center;
    vec3 way = p - at * r.center;
    // Distance from the rectangle's plane, positive beyond it.
    Plane e = Plane(toward * dot(r.normal, o), toward * dot(r.normal, cell.u), toward * dot(r.normal, cell.v));
    // The crossing's place along each axis, times `d`, which is positive beyond.
    Plane d = Plane(reach + at * e.middle, at * e.u, at * e.v);
    Plane x = combined(reach, Plane(dot(r.u, o), dot(r.u, cell.u), dot(r.u, cell.v)), dot(r.u, way), e);
    Plane y = combined(reach, Plane(dot(r.v, o), dot(r.v, cell.u), dot(r.v, cell.v)), dot(r.v, way), e);
    float uu = dot(r.u, r.u), vv = dot(r.v, r.v);
    Plane beyond = e;
    beyond.middle -= IN_PLANE * (abs(o.x) + abs(o.y) + abs(o.z));
    beyond = ramp(beyond);
    // What lies in a rectangle's plane sees past it.
    beyond.middle = a == 0.0 ? -1e30 : beyond.middle;
    return Edges(ramp(combined(uu, d, 1.0, x)), ramp(combined(uu, d, -1.0, x)), ramp(combined(vv, d, 1.0, y)), ramp(combined(vv, d, -1.0, y)), beyond);
}

// Takes from each point what a rectangle hides of its part.
void shade(inout Stencil s, Region r, vec3 p, float at, Cell cell) {
    Edges e = edges_of(r, p, at, cell);
    s.a *= left_of_row(e, ALONG.x);
    s.b *= left_of_row(e, ALONG.y);
    s.c *= left_of_row(e, ALONG.z);
    s.d *= left_of_row(e, ALONG.w);
}

float total(Stencil s) {
    vec4 sum = (s.a + s.b) + (s.c + s.d);
    return (sum.x + sum.y) + (sum.z + sum.w);
}

// Sums over the points of each quarter of the cell, u first, of one stencil weighted by another.
vec4 quarters(Stencil s, Stencil by) {
    vec4 low = s.a * by.a + s.b * by.b, high = s.c * by.c + s.d * by.d;
    return vec4(low.x + low.y, low.z + low.w, high.x + high.y, high.z + high.w);
}

// The middle of quarter q.
vec3 quarter_at(Cell cell, uint q) {
    return cell.middle + ((q & 1u) == 0u ? -0.5 : 0.5) * cell.u + ((q & 2u) == 0u ? -0.5 : 0.5) * cell.v;
}

// Of numbers from 0 to 1, sixteen bits each.
uvec2 packed_row(vec4 row) { return uvec2(packUnorm2x16(row.xy), packUnorm2x16(row.zw)); }

Packed packed(Stencil s) { return Packed(uvec4(packed_row(s.a), packed_row(s.b)), uvec4(packed_row(s.c), packed_row(s.d))); }

vec4 unpacked_row(uvec2 row) { return vec4(unpackUnorm2x16(row.x), unpackUnorm2x16(row.y)); }

Stencil unpacked(Packed p) {
    return Stencil(unpacked_row(p.ab.xy), unpacked_row(p.ab.zw), unpacked_row(p.cd.xy), unpacked_row(p.cd.zw));
}

vec4 picked(vec4 a, vec4 b, vec4 c, vec4 d, uint k) {
    return (k & 2u) == 0u ? ((k & 1u) == 0u ? a : b) : ((k & 1u) == 0u ? c : d);
}

vec4 columns(vec4 row, uvec4 k) {
    vec4 low = mix(row.xxxx, row.yyyy, notEqual(k & 1u, uvec4(0u))), high = mix(row.zzzz, row.wwww, notEqual(k & 1u, uvec4(0u)));
    return mix(low, high, notEqual(k & 2u, uvec4(0u)));
}

// What a cell `at` of the 4^level of a facet has of the facet's: its points take the number of the
// part that they lie in.
Stencil part_of(Stencil s, uvec2 at, uint level) {
    uvec4 u = (at.x * 4u + uvec4(0u, 1u, 2u, 3u)) >> level, v = (at.y * 4u + uvec4(0u, 1u, 2u, 3u)) >> level;
    vec4 a = columns(s.a, u), b = columns(s.b, u), c = columns(s.c, u), d = columns(s.d, u);
    return Stencil(picked(a, b, c, d, v.x), picked(a, b, c, d, v.y), picked(a, b, c, d, v.z), picked(a, b, c, d, v.w));
}
