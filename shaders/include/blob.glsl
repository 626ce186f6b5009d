// A blob as the camera sees it (docs/model.md §11 "sprites"): what both draw paths start from.

const float SQRT_TAU = 2.50662827463;
// What is drawn of a blob is taken to be this much larger than its silhouette, so that rounding never cuts a pixel that
// the pixel's own test would keep; that test decides.
const float GROWTH = 1.0 + 1e-4;

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
