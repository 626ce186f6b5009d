// The light inside a blob (model.md §18, src/model/shade.rs). Needs blob.glsl.

// 1: the light changes linearly across a blob.
layout(constant_id = 12) const uint SHADED = 0;

// Greatest change over a σ, and greatest light of a blob over that of its facet.
const float STEEPEST = 0.25;
const float MOST_OF_FACET = 2.0;

// Factor at the centre; change by the ray's offset from the centre's slopes and by σ toward the
// eye.
struct Shade {
    float base;
    vec3 seen;
};

// Returns the shade of a blob at `position` and at v (along_camera), whose facet has the slope
// `facet`.
Shade shade_of(Camera camera, Slope facet, Shape shape, vec3 position, vec3 v, float sigma) {
    vec3 slope = facet.relative;
    float base = 1.0;
    if (GROUPED != 0) {
        base = clamp(1.0 + dot(slope, position - facet.position), 0.0, MOST_OF_FACET);
        slope = base > 0.0 ? slope / base : vec3(0.0);
    }
    vec3 toward = normalize(v), w = toward;
    float white_square = 1.0, steep = dot(slope, slope);
    if (ELLIPSOIDS != 0) {
        float up = dot(shape.y, toward);
        w += (shape.inverse - 1.0) * up * shape.y;
        white_square += (shape.inverse - 1.0) * up * up;
        if (ELLIPSOIDS == 2) {
            vec3 along_axes = along_camera(camera, slope);
            float side = dot(shape.z, toward);
            w += (shape.inverse_z - 1.0) * side * shape.z;
            white_square += (shape.inverse_z - 1.0) * side * side;
            float of_y = dot(shape.y, along_axes), of_z = dot(shape.z, along_axes);
            steep += (shape.square - 1.0) * of_y * of_y + (shape.square_z - 1.0) * of_z * of_z;
        } else {
            steep += (shape.square - 1.0) * slope.y * slope.y;
        }
    }
    steep = sigma * sqrt(max(steep, 0.0));
    slope *= steep > STEEPEST ? STEEPEST / steep : 1.0;
    vec3 seen = along_camera(camera, slope);
    float along = dot(seen, toward);
    vec2 lateral = v.z * (seen.xy - along / white_square * w.xy);
    return Shade(base, vec3(lateral, -along * sigma * inversesqrt(white_square)));
}
