// Colours in a render target of 16-bit floats.

// 1: the target holds 16-bit floats.
layout(constant_id = 7) const uint HALF = 0;
// The largest number that they hold.
const float MAX_HALF = 65504.0;

// Returns a radiance that the target can hold. The device may round a greater one to infinity, and
// the next opaque layer's infinity times 0 would be NaN. The radiance is limited before it is
// multiplied by alpha: then every sum alpha L + (1 - alpha) C stays in range. NaN stays NaN.
vec3 in_target(vec3 radiance) {
    return HALF != 0 ? mix(radiance, vec3(MAX_HALF), greaterThan(radiance, vec3(MAX_HALF)))
                     : radiance;
}
