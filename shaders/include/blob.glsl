// A blob as the camera sees it (docs/model.md §11 "sprites"): what both draw paths start from.

const float SQRT_TAU = 2.50662827463;
// What is drawn of a blob is taken to be this much larger than its silhouette, so that rounding never cuts a pixel that
// the pixel's own test would keep; that test decides.
const float GROWTH = 1.0 + 1e-4;

// Pixels that rounding may move an edge by. Vulkan promises vertices 4 bits below the pixel: a corner may move by as much when it
// is snapped.
const float SNAP = 1.0 / 16.0;

// Along the camera's right, up and forward.
vec3 along_camera(Camera camera, vec3 from_eye) {
    return vec3(dot(camera.right, from_eye), dot(camera.up, from_eye), dot(camera.forward, from_eye));
}

// Slopes of the two tangents from the eye to a circle of radius r at (a, z). Where the circle reaches beside the eye,
// lines of either sign meet it, before the eye or behind: no bounds.
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

// The first pixel and the one after the last whose centres lie within [low, high], in pixels from the first one's edge.
uvec2 pixels_within(float low, float high, uint n) {
    vec2 at = vec2(ceil(low - 0.5 - SNAP), floor(high + 0.5 + SNAP));
    uvec2 range = uvec2(clamp(at, vec2(0.0), vec2(float(n))));
    return uvec2(min(range.x, range.y), range.y);
}

// (first, end) of columns and of rows whose centres lie in the rectangle around a circle of radius r about v (along_camera);
// none in either where the rectangle holds no centre.
uvec4 silhouette(Camera camera, vec2 pixel, vec3 v, float r, uvec2 size) {
    vec2 x = (tangents(v.x, v.z, r) + camera.tan_x) / pixel.x;
    vec2 y = (camera.tan_y - tangents(v.y, v.z, r).yx) / pixel.y;
    return uvec4(pixels_within(x.x, x.y, size.x), pixels_within(y.x, y.y, size.y));
}
