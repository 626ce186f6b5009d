// Functions whose accuracy Vulkan does not promise where nimbus needs it.

const float PI = 3.14159265358979;

// Returns sin x to 3.5 ulp after the reduction x - k pi. Pi is in four parts of few bits
// (Cody-Waite), so that k times each part is exact for |k| < 2^14; beyond, the argument's own
// rounding error outgrows the reduction's. The built-in sin promises 2^-11 absolute inside [-pi,
// pi] only. Coefficients: minimax on [-pi/2, pi/2] (as published in SLEEF).
float sine(float x) {
    float k = round(x * 0.318309886183790672);
    float r = x - k * 3.140625;
    r -= k * 0.0009670257568359375;
    r -= k * 6.2771141529083251953e-07;
    r -= k * 1.2154201256553420e-10;
    // k is off by one where x is nearer to a half than its rounding, and r is then beyond pi/2 by
    // up to 2 u |x| = 0.0062. A huge argument reduces to anything; the cut keeps the result a sine.
    r = clamp(r, -1.58, 1.58);
    float s = r * r;
    float u = 2.6083159809786593541503e-06;
    u = u * s - 0.0001981069071916863322258;
    u = u * s + 0.00833307858556509017944336;
    u = u * s - 0.166666597127914428710938;
    float value = s * (u * r) + r;
    // Parity in floats is exact for every k; int(k) is undefined where k has no int.
    return k - 2.0 * floor(k * 0.5) == 0.0 ? value : -value;
}

// Returns (cos, sin) of 2 pi x for |x| <= 1/2, x a multiple of 2^-24, so that the differences are
// exact and no argument is above pi/2. Each is within 10 u, u = 2^-24.
vec2 unit_at(float turns) {
    float a = abs(turns);
    float s = sine(2.0 * PI * min(a, 0.5 - a));
    return vec2(sine(2.0 * PI * (0.25 - a)), turns < 0.0 ? -s : s);
}

// Returns erf x by Abramowitz and Stegun 7.1.28, whose own error is at most 3e-7, with exact sign
// symmetry. In f32 the 16th power multiplies d's rounding: |error| <= 2.5e-6 near 0, falling to
// 4e-7 where the result is near 1.
float erf_approx(float x) {
    float a = abs(x);
    float d =
        1.0
        + a
              * (0.0705230784
                 + a
                       * (0.0422820123
                          + a
                                * (0.0092705272
                                   + a * (0.0001520143 + a * (0.0002765672 + a * 0.0000430638)))));
    d *= d;
    d *= d;
    d *= d;
    d *= d;
    return sign(x) * (1.0 - 1.0 / d);
}

// Returns 2^n p for whole n and p from 1/2 to 2, where that is a normal number.
float times_power_of_two(float p, float n) {
    return intBitsToFloat(floatBitsToInt(p) + (int(n) << 23));
}

// Returns 2^x for |x| <= 125 with a relative error below 3e-7. The built-in exp2 promises 3 + 2|x|
// ulp and takes some 10 operations more for all x. The polynomial of degree 5 errs by 7.5e-8 of 2^f
// on [-1/2, 1/2] (minimax).
float power_of_two(float x) {
    float n = roundEven(x);
    float f = x - n;
    float p = 0.00132764718749 * f + 0.00967554133354;
    p = ((p * f + 0.0555071327386) * f + 0.240221197239) * f + 0.693146967065;
    p = p * f + 1.00000007166;
    return times_power_of_two(p, n);
}

// Returns 1 - e^-t for t in [0, 1/8]: t times the cubic through (1 - e^-t)/t at Chebyshev's points,
// within 1.6e-8 of it.
float thin_opacity(float t) {
    return t
           * ((0.999999984752 - t * 0.499996093888)
              + t * t * (0.166509869621 - t * 0.039641773912));
}

// Returns 1 - 2^n (1 + d) for whole n from -126 to 0; nothing cancels where n is 0.
float one_minus_power(float n, float d) {
    float scale = intBitsToFloat((int(n) + 127) << 23);
    return (1.0 - scale) - scale * d;
}

// Returns 1 - e^-t for t >= 0 with a relative error below 3.5e-7. Here e^-t = 2^n (1 + f p(f)), n a
// whole number and |f| <= 1/2. Where the result is small n is 0, and nothing cancels. p is within
// 1.1e-8 of (2^f - 1)/f (minimax, relative).
float one_minus_exp(float t) {
    // Beyond 87, 2^n is below the normal numbers, and the result 1.
    float x = -1.44269504089 * min(t, 87.0);
    float n = roundEven(x);
    float f = x - n;
    float p = (0.000154035126507 * f + 0.00133907354775) * f + 0.00961823749407;
    p = ((p * f + 0.0555035743364) * f + 0.24022649795) * f + 0.693147187927;
    return one_minus_power(n, f * p);
}

// The next three serve pictures of 16 bits a channel or fewer, which round by up to 2^-11 of a
// value. Their polynomials are minimax, relative.

// power_of_two() with a relative error below 3e-6. The polynomial errs by 2.6e-6.
float power_of_two_16(float x) {
    float n = roundEven(x);
    float f = x - n;
    float p = 0.00957010191116 * f + 0.0559178603194;
    p = ((p * f + 0.240247448279) * f + 0.693121814737) * f + 0.999999261446;
    return times_power_of_two(p, n);
}

// thin_opacity() with a relative error below 3e-6. The polynomial errs by 2.5e-6.
float thin_opacity_16(float t) {
    return t * (0.999997504566 + t * (t * 0.159046454904 - 0.499643842651));
}

// one_minus_exp() with a relative error below 1.6e-5. The polynomial errs by 1.5e-5.
float one_minus_exp_16(float t) {
    float x = -1.44269504089 * min(t, 87.0);
    float n = roundEven(x);
    float f = x - n;
    float p = 0.00961811077637 * f + 0.0558372882603;
    p = (p * f + 0.24023252162) * f + 0.69313685778;
    return one_minus_power(n, f * p);
}

// Returns the unit vector along o, and 0 where o is 0.
vec3 unit(vec3 o) { return o * inversesqrt(max(dot(o, o), 1e-30)); }
