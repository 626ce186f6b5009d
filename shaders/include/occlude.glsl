// Whether a surface's rectangle lies between two points, or before a light (docs/model.md §7). Both sides occlude.

// A point nearer to a rectangle's plane than this share of its distance from the centre lies in it, but for the rounding
// of its coordinates (a few 2^-24), and what lies in it is not hidden by it.
const float IN_PLANE = 9.5367431640625e-7;

// Signed distance from the rectangle's plane; 0 within it.
float side_of(Region r, vec3 p) {
    vec3 o = p - r.center;
    float e = dot(r.normal, o);
    return abs(e) > IN_PLANE * (abs(o.x) + abs(o.y) + abs(o.z)) ? e : 0.0;
}

bool holds(Region r, vec3 x) {
    vec3 o = x - r.center;
    return abs(dot(o, r.u)) <= dot(r.u, r.u) && abs(dot(o, r.v)) <= dot(r.v, r.v);
}

// Between p and q.
bool hides(Region r, vec3 p, vec3 q) {
    float a = side_of(r, p), b = side_of(r, q);
    bool apart = (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0);
    return apart && holds(r, p + (q - p) * (a / (a - b)));
}

// Whether the rim of what r hides from p runs through the ball about q: some of it is hidden and some is not. The ball's
// size where the way crosses the plane is its own, shortened by the crossing's share of the way and lengthened by the
// way's slant.
bool tears(Region r, vec3 p, vec3 q, float radius) {
    float a = dot(r.normal, p - r.center), b = dot(r.normal, q - r.center);
    float near_q = abs(b) - radius;
    if (a * b > 0.0 && near_q > 0.0) {
        return false;
    }
    vec3 d = q - p;
    float part = abs(a) / max(abs(a - b), 1e-30);
    float slant = length(d) / max(abs(a - b), 1e-30);
    float reach = radius * min(part, 1.0) * max(slant, 1.0);
    vec3 o = p + d * min(part, 1.0) - r.center;
    float lu = length(r.u), lv = length(r.v);
    vec2 out_by = abs(vec2(dot(o, r.u) / lu, dot(o, r.v) / lv)) - vec2(lu, lv);
    float most = max(out_by.x, out_by.y);
    return abs(most) < reach || (near_q < 0.0 && most < reach);
}

// From p along d without end.
bool shades(Region r, vec3 p, vec3 d) {
    float a = side_of(r, p), b = dot(r.normal, d);
    bool toward = (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0);
    return toward && holds(r, p - d * (a / b));
}
