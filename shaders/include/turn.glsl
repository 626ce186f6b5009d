// The rotation of an ellipsoid's axes, as its record holds it (src/model/shape.rs): of a unit
// quaternion, the three components other than the greatest, 20 bits each.

const float TURN_STEP = 0.70710678118654752 / 524287.0;

// Returns the second and the third axis in the scene.
void axes_of(uvec2 turn, out vec3 y, out vec3 z) {
    int low = int(turn.x), high = int(turn.y);
    int thirds = bitfieldExtract(high, 20, 8) << 12 | int(turn.x >> 20);
    vec3 of = TURN_STEP
              * vec3(
                  float(bitfieldExtract(low, 0, 20)), float(bitfieldExtract(high, 0, 20)),
                  float(thirds)
              );
    float rest = sqrt(1.0 - dot(of, of));
    uint greatest = bitfieldExtract(turn.y, 28, 2);
    // (w, x, y, z)
    vec4 q = greatest == 0u   ? vec4(rest, of)
             : greatest == 1u ? vec4(of.x, rest, of.yz)
             : greatest == 2u ? vec4(of.xy, rest, of.z)
                              : vec4(of, rest);
    y = vec3(
        2.0 * (q.y * q.z - q.x * q.w), 1.0 - 2.0 * (q.y * q.y + q.w * q.w),
        2.0 * (q.z * q.w + q.x * q.y)
    );
    z = vec3(
        2.0 * (q.y * q.w + q.x * q.z), 2.0 * (q.z * q.w - q.x * q.y),
        1.0 - 2.0 * (q.y * q.y + q.z * q.z)
    );
}
