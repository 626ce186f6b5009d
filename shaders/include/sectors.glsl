// Sectors of the sphere around the directions of bounces, without edges (model.md §18). Needs
// directions.glsl.

// Numbers of a patch: irradiance, and pi times the radiance of each sector.
const uint OF_PATCH = 1u + N_DIRECTIONS;

// Returns by axis the share of a direction that counts as positive, before a face of the box.
vec3 positive_of(vec3 d, uint axis, uint side) {
    vec3 positive = clamp(0.5 + 2.0 * d, 0.0, 1.0);
    // Behind the face is nothing.
    positive[axis] = float(side);
    return positive;
}

// Returns the share of a direction in sector k. All shares add up to 1.
float share_in(uint k, vec3 d, vec3 positive) {
    vec3 shares = mix(positive, 1.0 - positive, notEqual(uvec3(k, k >> 1, k >> 2) & 1u, uvec3(0u)));
    return shares.x * shares.y * shares.z * (d[k >> 3] * d[k >> 3]);
}
