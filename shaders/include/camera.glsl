// A camera's axes, and the ray through a pixel. Needs records.glsl.

// Vulkan promises 4 bits of a pixel for vertices, so snapping moves a corner by at most this many
// pixels.
const float SNAP = 1.0 / 16.0;

// Returns the components along the camera's right, up and forward.
vec3 along_camera(Camera camera, vec3 v) {
    return vec3(dot(camera.right, v), dot(camera.up, v), dot(camera.forward, v));
}

// Returns the ray (x, y, 1) through a place on the screen; pixel = (2 tan_x/W, 2 tan_y/H).
vec3 ray_through(Camera camera, vec2 place, vec2 pixel) {
    vec2 at = place * pixel;
    return vec3(at.x - camera.tan_x, camera.tan_y - at.y, 1.0);
}
