// Returns the angle between unit vectors whose cosine is `cosine`, to 1e-7 (Abramowitz and Stegun,
// 4.4.46). GLSL's atan may be off by 5e-4 of its value.
float angle_between(vec3 a, vec3 b, float cosine) {
    const float PI = 3.14159265359, SQRT_HALF = 0.70710678119;
    float x = min(abs(cosine), 1.0);
    // sqrt(1 - x), without the difference of near numbers.
    float root = SQRT_HALF * length(cosine < 0.0 ? a + b : a - b);
    float high = ((0.0308918810 - x * (0.0170881256 - x * (0.0066700901 - x * 0.0012624911))) * x
                  - 0.0501743046) * x + 0.0889789874;
    float angle = root * ((high * x - 0.2145988016) * x + 1.5707963050);
    return cosine < 0.0 ? PI - angle : angle;
}
