// Colours in the formats of a render target.

// 1: the target holds 16-bit floats.
layout(constant_id = 7) const uint HALF = 0;
// The largest number that they hold.
const float MAX_HALF = 65504.0;
// 1: the target holds bytes, for numbers from 0 to 1.
layout(constant_id = 11) const uint BYTES = 0;

// Returns a radiance that the target can hold. The device may round a greater one to infinity, and
// the next opaque layer's infinity times 0 would be NaN. The radiance is limited before it is
// multiplied by alpha: then every sum alpha L + (1 - alpha) C stays in range. NaN stays NaN.
vec3 in_target(vec3 radiance) {
    return HALF != 0 ? mix(radiance, vec3(MAX_HALF), greaterThan(radiance, vec3(MAX_HALF)))
                     : radiance;
}

// Returns the number n for which a layer in a target of bytes changes no pixel where its opacity is
// below 1/n. It changes a number C of the target by alpha (L - C), and the opacity by at most
// alpha. That is below half a byte's step, and a device that rounds to nearest rounds it away.
float inv_least_shown(vec3 radiance) {
    return 510.0 * max(max(radiance.x, radiance.y), max(radiance.z, 1.0));
}
