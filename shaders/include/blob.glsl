// A blob as the camera sees it; both draw paths start from it (passes.md
// "sprites"). Needs records.glsl.

#include "camera.glsl"
#include "variants.glsl"
#include "turn.glsl"

const float SQRT_TAU = 2.50662827463;
// Silhouettes are drawn this much larger, so that rounding never cuts a pixel that the pixel's own
// test would keep.
const float GROWTH = 1.0 + 1e-4;
// The square of a flat ellipsoid's width, seen edge on, is a difference of terms up to a million
// times as large. It is off by at most this share of their sum: six products and sums, each rounded
// by 2^-24.
const float FLAT = 1e-6;

// Returns the slopes of the two tangents from the eye to a circle of radius r at (a, z). Where the
// circle reaches beside the eye, lines in front of it and behind it meet the circle, and there are
// no bounds.
vec2 tangents(float a, float z, float r) {
    float t2 = a * a + z * z - r * r;
    if (t2 > 0.0) {
        float t = sqrt(t2);
        float low = z * t + a * r, high = z * t - a * r;
        if (min(low, high) > 0.0) {
            return vec2((a * t - z * r) / low, (a * t + z * r) / high);
        }
    }
    return vec2(-1e9, 1e9);
}

// Returns the factor on kappa of particle i, which its group draws.
float weight_of(Drawn group, uint i) {
    return group.kappa_scale * (i + 1u == group.end ? group.last_weight : 1.0);
}

// An ellipsoid: values that follow from its shape and the camera (model.md §14). Its axes have the
// lengths 1, a and b over sigma.
struct Shape {
    // The second axis along the camera's right, up and forward: of an upright one the scene's y.
    vec3 y;
    // a^2 and 1/a^2.
    float square, inverse;
    // Greatest depth of a line through the centre over kappa sigma. Also the widest sigma over
    // that along the first axis.
    float wider;
    // The third axis, b^2 and 1/b^2. Used where ellipsoids are turned.
    vec3 z;
    float square_z, inverse_z;
};

// Returns an upright one. A ball has aspect 1.
Shape upright_shape(Camera camera, float aspect) {
    return Shape(
        vec3(camera.right.y, camera.up.y, camera.forward.y), aspect * aspect,
        1.0 / (aspect * aspect), max(aspect, 1.0), vec3(0.0), 1.0, 1.0
    );
}

Shape shape_of(Camera camera, float aspect, float aspect_z, uvec2 turn) {
    Shape shape = upright_shape(camera, aspect);
    if (ELLIPSOIDS == 2) {
        vec3 y, z;
        axes_of(turn, y, z);
        shape.y = along_camera(camera, y);
        shape.z = along_camera(camera, z);
        shape.square_z = aspect_z * aspect_z;
        shape.inverse_z = 1.0 / shape.square_z;
        shape.wider = max(shape.wider, aspect_z);
    }
    return shape;
}

// Returns |M v|^2 of v along the camera's axes; M divides by the lengths of the axes. The parts
// along the axes are kept apart, as they may differ by orders of magnitude.
float white_square(Shape shape, vec3 v) {
    float up = dot(shape.y, v);
    vec3 across = v - up * shape.y;
    float rest = 0.0;
    if (ELLIPSOIDS == 2) {
        float side = dot(shape.z, v);
        across -= side * shape.z;
        rest = shape.inverse_z * side * side;
    }
    return dot(across, across) + shape.inverse * up * up + rest;
}

// |M d|^2 of the rays d = (s + delta, 1) through a turned ellipsoid: it is white ((1 +
// lean.delta)^2 + E/(scale white^2)), with E of conic_of(). No terms cancel.
struct Lean {
    float white;
    vec2 lean;
};

Lean lean_of(Shape shape, vec2 s) {
    vec3 d = vec3(s, 1.0);
    // M^2 d.
    float up = dot(shape.y, d), side = dot(shape.z, d);
    vec3 along = d - up * shape.y - side * shape.z + shape.inverse * up * shape.y
                 + shape.inverse_z * side * shape.z;
    float white = white_square(shape, d);
    return Lean(white, along.xy / white);
}

// Returns the slopes of the two tangents, as tangents() does, along right (k = 0) or up (k = 1). A
// plane through the eye touches where (n.c)^2 = r^2 n.S n, S the ellipsoid's matrix and n = (1,
// -slope).
vec2 tangents_of(Shape shape, vec3 v, int k, float r) {
    float more = shape.square - 1.0;
    float s_xx = 1.0 + more * shape.y[k] * shape.y[k], s_zz = 1.0 + more * shape.y.z * shape.y.z;
    float s_xz = more * shape.y[k] * shape.y.z;
    if (ELLIPSOIDS == 2) {
        more = shape.square_z - 1.0;
        s_xx += more * shape.z[k] * shape.z[k];
        s_zz += more * shape.z.z * shape.z.z;
        s_xz += more * shape.z[k] * shape.z.z;
    }
    // Scaled to depth 1, so that squares of lengths stay within f32's range.
    float s = v[k] / v.z, q = r / v.z, q2 = q * q;
    float a = 1.0 - q2 * s_zz;
    if (v.z > 0.0 && a > 0.0) {
        float b = s - q2 * s_xz;
        // b^2 - a c over q^2, without the terms that cancel.
        float whole = s_xx + s_zz * s * s;
        float square = whole - 2.0 * s_xz * s - q2 * (s_xx * s_zz - s_xz * s_xz);
        float root = q * sqrt(max(square, 0.0) + FLAT * whole);
        return vec2((b - root) / a, (b + root) / a);
    }
    return vec2(-1e9, 1e9);
}

// Returns the same of a blob of any form; r is its reach across y.
vec2 tangents_along(Shape shape, vec3 v, int k, float r) {
    if (ELLIPSOIDS != 0) {
        return tangents_of(shape, v, k, r);
    }
    return tangents(v[k], v.z, r);
}

// Returns the first pixel and the one after the last whose centres lie within [low, high], in
// pixels from the first one's edge.
uvec2 pixels_within(float low, float high, uint n) {
    vec2 at = vec2(ceil(low - 0.5 - SNAP), floor(high + 0.5 + SNAP));
    uvec2 range = uvec2(clamp(at, vec2(0.0), vec2(float(n))));
    return uvec2(min(range.x, range.y), range.y);
}

// Returns (first, end) of the columns and of the rows whose centres lie in the rectangle around a
// blob at v (along_camera) that reaches r across y. Both are empty where the rectangle holds no
// centre.
uvec4 silhouette(Shape shape, Camera camera, vec2 pixel, vec3 v, float r, uvec2 size) {
    vec2 x = (tangents_along(shape, v, 0, r) + camera.tan_x) / pixel.x;
    vec2 y = (camera.tan_y - tangents_along(shape, v, 1, r).yx) / pixel.y;
    return uvec4(pixels_within(x.x, x.y, size.x), pixels_within(y.x, y.y, size.y));
}

// Returns the quadratic form of a ray's offset delta from the centre's slopes s, as the
// coefficients of (x^2, x y, y^2).
// The form is scale |M' (delta.y, -delta.x, s.x delta.y - s.y delta.x)|^2, M' the cofactors of M.
// With scale = z^2/(2 sigma^2) it is b^2/(2 sigma^2) |M ray|^2, b the distance where the ellipsoid
// is made a ball of sigma.
vec3 conic_of(Shape shape, vec2 s, float scale) {
    // The cross product of centre and ray for a unit of delta along each axis.
    vec3 x = vec3(0.0, 1.0, -s.y), y = vec3(-1.0, 0.0, s.x);
    float up_x = dot(shape.y, x), up_y = dot(shape.y, y);
    vec3 across_x = x - up_x * shape.y, across_y = y - up_y * shape.y;
    if (ELLIPSOIDS == 2) {
        float side_x = dot(shape.z, x), side_y = dot(shape.z, y);
        across_x -= side_x * shape.z;
        across_y -= side_y * shape.z;
        // Cofactors are products of the other two inverses.
        vec3 of_across = vec3(
            dot(across_x, across_x), 2.0 * dot(across_x, across_y), dot(across_y, across_y)
        );
        vec3 of_up = vec3(up_x * up_x, 2.0 * up_x * up_y, up_y * up_y);
        vec3 of_side = vec3(side_x * side_x, 2.0 * side_x * side_y, side_y * side_y);
        return scale
               * (shape.inverse_z * (shape.inverse * of_across + of_up) + shape.inverse * of_side);
    }
    return scale
           * vec3(
               shape.inverse * dot(across_x, across_x) + up_x * up_x,
               2.0 * (shape.inverse * dot(across_x, across_y) + up_x * up_y),
               shape.inverse * dot(across_y, across_y) + up_y * up_y
           );
}
