// Whether a surface's rectangle lies between two points, or before a light
// (model.md §7). Both of its sides occlude.

// A point lies in a rectangle's plane where its distance is below this share of its distance from
// the centre: the rounding of its coordinates (a few 2^-24). The rectangle does not hide such a
// point.
const float IN_PLANE = 9.5367431640625e-7;

// A ball stands for a square: half its side over its diagonal, halved.
const float SOFT = 0.70710678;

// Returns the signed distance from the rectangle's plane; 0 within the plane.
float side_of(Region r, vec3 p) {
    vec3 o = p - r.center;
    float e = dot(r.normal, o);
    return abs(e) > IN_PLANE * (abs(o.x) + abs(o.y) + abs(o.z)) ? e : 0.0;
}

bool holds(Region r, vec3 x) {
    vec3 o = x - r.center;
    return abs(dot(o, r.u)) <= dot(r.u, r.u) && abs(dot(o, r.v)) <= dot(r.v, r.v);
}

bool are_opposite(float a, float b) { return (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0); }

// Returns how far o, relative to the rectangle's centre, lies outside the rectangle along the axis
// where that is farthest; negative inside.
float outside_by(Region r, vec3 o) {
    vec2 squares = vec2(dot(r.u, r.u), dot(r.v, r.v));
    vec2 outside = (abs(vec2(dot(o, r.u), dot(o, r.v))) - squares) * inversesqrt(squares);
    return max(outside.x, outside.y);
}

// Whether the rectangle hides p and q from each other.
bool hides(Region r, vec3 p, vec3 q) {
    float a = side_of(r, p), b = side_of(r, q);
    bool apart = are_opposite(a, b);
    return apart && holds(r, p + (q - p) * (a / (a - b)));
}

// Returns x: the share of the ball about q that is hidden from p, as if the shadow's edge were
// straight; y: whether the edge crosses the ball. The ball's size in the rectangle's plane is its
// own, shortened by the crossing's share of the distance and lengthened by the direction's slant.
vec2 hides_ball(Region r, vec3 p, vec3 q, float radius) {
    float a = side_of(r, p), b = side_of(r, q);
    vec3 d = q - p;
    float across = 1.0 / max(abs(a - b), 1e-30);
    float part = a / (a - b);
    vec3 o = p + d * part - r.center;
    bool apart = are_opposite(a, b);
    float most = outside_by(r, o);
    float reach = radius * abs(part) * max(length(d) * across, 1.0);
    bool edge_facets = abs(b) < radius ? most < reach : apart && abs(most) < reach;
    float soft = clamp(0.5 - SOFT * most / max(reach, 1e-30), 0.0, 1.0);
    return vec2(apart ? soft : 0.0, a != 0.0 && edge_facets ? 1.0 : 0.0);
}

// Whether the rectangle meets the ray from p along d.
bool shades(Region r, vec3 p, vec3 d) {
    float a = side_of(r, p), b = dot(r.normal, d);
    bool toward = are_opposite(a, b);
    return toward && holds(r, p - d * (a / b));
}

// Returns x: whether the shadow along -d covers the middle of the ball about p; y: whether its edge
// crosses the ball, as in hides_ball().
bvec2 shades_ball(Region r, vec3 p, vec3 d, float radius) {
    float a = side_of(r, p), b = dot(r.normal, d);
    vec3 o = p - d * (a / b) - r.center;
    float most = outside_by(r, o);
    float reach = radius / max(abs(b), 1e-30);
    bool toward = are_opposite(a, b);
    return bvec2(
        toward && most <= 0.0, abs(a) < radius ? most < reach : toward && abs(most) < reach
    );
}
