// A cell of a surface's facet seen at 4 x 4 points. Each point is the middle of a part, whose share
// in light and shadow is found along straight edges (passes.md "second"). Needs
// light.glsl and occlude.glsl.

// Places of the points along each half axis.
const vec4 ALONG = vec4(-0.75, -0.25, 0.25, 0.75);

// A number at every point: rows along v, components along u. The rows have names, since a device
// that keeps an indexed array in memory would gather and scatter it.
struct CellSamples {
    vec4 a;
    vec4 b;
    vec4 c;
    vec4 d;
};

// A cell: its middle and half axes.
struct Cell {
    vec3 middle;
    vec3 u;
    vec3 v;
};

// A linear function over the cell: middle + ALONG u + ALONG v.
struct Plane {
    float middle;
    float u;
    float v;
};

vec4 on_row(Plane plane, float along) { return (plane.middle + along * plane.v) + ALONG * plane.u; }

// Returns the function as a ramp that gives, cut to [0, 1], the share of each point's part where
// the function is positive. The ramp is as long as the part and has its middle on the edge; it is
// exact for edges along the axes.
Plane ramp(Plane plane) {
    float steep = 2.0 * inversesqrt(max(plane.u * plane.u + plane.v * plane.v, 1e-30));
    return Plane(0.5 + steep * plane.middle, steep * plane.u, steep * plane.v);
}

vec4 inside(Plane ramp, float along) { return clamp(on_row(ramp, along), 0.0, 1.0); }

// Returns cos cos/d^2 over one row of parts, without the source's cosine times d. The value is the
// mean over the part as in rectangle_form(), of half axes u/4 and v/4. Parts wider than their
// distance count as discs. o: the row's middle from the receiver.
vec4 row_of_forms(vec3 o, vec3 u, vec3 v, vec3 receiver_normal, float part) {
    float uu = 0.0625 * dot(u, u), vv = 0.0625 * dot(v, v);
    float nu = dot(receiver_normal, u), nv = dot(receiver_normal, v);
    vec4 facing = dot(receiver_normal, o) + ALONG * nu;
    // The axes are perpendicular.
    float ou = dot(o, u), ov = dot(o, v);
    vec4 d2 = max(dot(o, o) + ALONG * (2.0 * ou) + ALONG * ALONG * (16.0 * uu), 1e-30);
    vec4 inverse = 1.0 / d2;
    vec4 along_u = 0.25 * (ou + ALONG * (16.0 * uu));
    float along_v = 0.25 * ov;
    vec4 bent = facing * (6.0 * inverse * (along_u * along_u + along_v * along_v) - (uu + vv))
                - 0.5 * (nu * along_u + nv * along_v);
    vec4 mean = max(facing + bent * inverse * (2.0 / 3.0), 0.0) * inverse * inverse;
    vec4 disc = facing * inverse / (d2 + part);
    bvec4 near = lessThan(d2, vec4(4.0 * max(uu, vv)));
    return mix(mix(mean, disc, near), vec4(0.0), lessThanEqual(facing, vec4(0.0)));
}

// Returns cos cos/d^2 from each point of a cell of the given area to a receiver at p.
CellSamples forms(Cell cell, vec3 normal, vec3 receiver_normal, vec3 p, float area) {
    vec3 o = cell.middle - p;
    float part = area * (0.0625 * 0.318309886183791);
    float height = max(-dot(normal, o), 0.0);
    return CellSamples(
        height * row_of_forms(o + ALONG.x * cell.v, cell.u, cell.v, receiver_normal, part),
        height * row_of_forms(o + ALONG.y * cell.v, cell.u, cell.v, receiver_normal, part),
        height * row_of_forms(o + ALONG.z * cell.v, cell.u, cell.v, receiver_normal, part),
        height * row_of_forms(o + ALONG.w * cell.v, cell.u, cell.v, receiver_normal, part)
    );
}

// A rectangle's shadow: four ramps, and a fifth for what lies beyond its plane.
struct Edges {
    Plane left;
    Plane right;
    Plane below;
    Plane above;
    Plane beyond;
};

// Returns the share of each part of one row that the shadow leaves lit. Of two opposite edges the
// shadow is the part inside both.
vec4 left_of_row(Edges e, float along) {
    vec4 across = max(inside(e.left, along) + inside(e.right, along) - 1.0, 0.0);
    vec4 up = max(inside(e.below, along) + inside(e.above, along) - 1.0, 0.0);
    return 1.0 - across * up * inside(e.beyond, along);
}

Plane combined(float a, Plane x, float b, Plane y) {
    return Plane(a * x.middle + b * y.middle, a * x.u + b * y.u, a * x.v + b * y.v);
}

// Returns the edges of the shadow that a rectangle casts onto a cell, seen from p, or in direction
// p where at is 0.
Edges edges_of(Region r, vec3 p, float at, Cell cell) {
    float a = at > 0.0 ? side_of(r, p) : dot(r.normal, p);
    float toward = -sign(a), reach = abs(a);
    vec3 o = cell.middle - r.center;
    vec3 direction = p - at * r.center;
    // Distance from the rectangle's plane, positive beyond it.
    Plane e = Plane(
        toward * dot(r.normal, o), toward * dot(r.normal, cell.u), toward * dot(r.normal, cell.v)
    );
    // The crossing's place along each axis, times d, which is positive beyond.
    Plane d = Plane(reach + at * e.middle, at * e.u, at * e.v);
    Plane x = combined(
        reach, Plane(dot(r.u, o), dot(r.u, cell.u), dot(r.u, cell.v)), dot(r.u, direction), e
    );
    Plane y = combined(
        reach, Plane(dot(r.v, o), dot(r.v, cell.u), dot(r.v, cell.v)), dot(r.v, direction), e
    );
    float uu = dot(r.u, r.u), vv = dot(r.v, r.v);
    Plane beyond = e;
    beyond.middle -= IN_PLANE * (abs(o.x) + abs(o.y) + abs(o.z));
    beyond = ramp(beyond);
    // A receiver in the rectangle's plane sees past it.
    beyond.middle = a == 0.0 ? -1e30 : beyond.middle;
    return Edges(
        ramp(combined(uu, d, 1.0, x)), ramp(combined(uu, d, -1.0, x)),
        ramp(combined(vv, d, 1.0, y)), ramp(combined(vv, d, -1.0, y)), beyond
    );
}

// Subtracts from each point the share of its part that a rectangle hides.
void subtract_shadow(inout CellSamples s, Region r, vec3 p, float at, Cell cell) {
    Edges e = edges_of(r, p, at, cell);
    s.a *= left_of_row(e, ALONG.x);
    s.b *= left_of_row(e, ALONG.y);
    s.c *= left_of_row(e, ALONG.z);
    s.d *= left_of_row(e, ALONG.w);
}

float total(CellSamples s) {
    vec4 sum = (s.a + s.b) + (s.c + s.d);
    return (sum.x + sum.y) + (sum.z + sum.w);
}

// Returns the sums over the points of each quarter of the cell, u first, of one number weighted by
// another.
vec4 quarters(CellSamples s, CellSamples by) {
    vec4 low = s.a * by.a + s.b * by.b, high = s.c * by.c + s.d * by.d;
    return vec4(low.x + low.y, low.z + low.w, high.x + high.y, high.z + high.w);
}

// Returns the middle of quarter q.
vec3 quarter_at(Cell cell, uint q) {
    return cell.middle + ((q & 1u) == 0u ? -0.5 : 0.5) * cell.u
           + ((q & 2u) == 0u ? -0.5 : 0.5) * cell.v;
}

// Packs numbers from 0 to 1 to sixteen bits each.
uvec2 packed_row(vec4 row) { return uvec2(packUnorm2x16(row.xy), packUnorm2x16(row.zw)); }

Packed packed(CellSamples s) {
    return Packed(uvec4(packed_row(s.a), packed_row(s.b)), uvec4(packed_row(s.c), packed_row(s.d)));
}

vec4 unpacked_row(uvec2 row) { return vec4(unpackUnorm2x16(row.x), unpackUnorm2x16(row.y)); }

CellSamples unpacked(Packed p) {
    return CellSamples(
        unpacked_row(p.ab.xy), unpacked_row(p.ab.zw), unpacked_row(p.cd.xy), unpacked_row(p.cd.zw)
    );
}

vec4 picked(vec4 a, vec4 b, vec4 c, vec4 d, uint k) {
    return (k & 2u) == 0u ? ((k & 1u) == 0u ? a : b) : ((k & 1u) == 0u ? c : d);
}

vec4 columns(vec4 row, uvec4 k) {
    vec4 low = mix(row.xxxx, row.yyyy, notEqual(k & 1u, uvec4(0u))),
         high = mix(row.zzzz, row.wwww, notEqual(k & 1u, uvec4(0u)));
    return mix(low, high, notEqual(k & 2u, uvec4(0u)));
}

// Returns the facet's numbers for a cell at `at` of its 4^level cells: each point takes the number
// of the facet's part that it lies in.
CellSamples part_of(CellSamples s, uvec2 at, uint level) {
    uvec4 u = (at.x * 4u + uvec4(0u, 1u, 2u, 3u)) >> level,
          v = (at.y * 4u + uvec4(0u, 1u, 2u, 3u)) >> level;
    vec4 a = columns(s.a, u), b = columns(s.b, u), c = columns(s.c, u), d = columns(s.d, u);
    return CellSamples(
        picked(a, b, c, d, v.x), picked(a, b, c, d, v.y), picked(a, b, c, d, v.z),
        picked(a, b, c, d, v.w)
    );
}
