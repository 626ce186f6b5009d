#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "each.glsl"

// Computes the colours of particles that change with the direction of view (model.md §14, passes.md
// "harmonics"). In: places, coefficients of real spherical harmonics. Out: the particles' colours.
// Law: the mean colour and the sum of c Y over degree 1 to 3, at least 0. Source: Kerbl et al.
// 2023.

// n_texels: of a particle's coefficients.
layout(push_constant) uniform Push {
    vec3 eye;
    uint degree;
    uint i_first;
    uint n_particles;
    uint i_texel;
    uint n_texels;
} push;
TEXELS(0, placed)
// By particle: mean colour and kappa, then three numbers for each harmonic.
TEXELS(1, coefficients)
TEXEL_STORES(2, particles)

// Returns number k of those of harmonics.
float number(int first, int k) {
    return uintBitsToFloat(TEXEL(coefficients, first + 1 + k / 4)[k % 4]);
}

vec3 rest(int first, int harmonic) {
    int k = 3 * (harmonic - 1);
    return vec3(number(first, k), number(first, k + 1), number(first, k + 2));
}

void main() {
    FOR_EACH(k, push.n_particles) {
        uint i = push.i_first + k;
        int first = int(push.i_texel + k * push.n_texels);
        vec4 mean = uintBitsToFloat(TEXEL(coefficients, first));
        vec3 d = PLACED_AT(i).position - push.eye;
        float far = length(d);
        d = far > 0.0 ? d / far : vec3(0.0);
        float x = d.x, y = d.y, z = d.z;
        float xx = x * x, yy = y * y, zz = z * z;
        vec3 sum = 0.488602511903 * (-y * rest(first, 1) + z * rest(first, 2) - x * rest(first, 3));
        if (push.degree > 1u) {
            sum += 1.09254843059 * (x * y * rest(first, 4) - y * z * rest(first, 5))
                   + 0.315391565253 * (2.0 * zz - xx - yy) * rest(first, 6)
                   - 1.09254843059 * x * z * rest(first, 7)
                   + 0.546274215296 * (xx - yy) * rest(first, 8);
        }
        if (push.degree > 2u) {
            sum += -0.590043589927 * y * (3.0 * xx - yy) * rest(first, 9)
                   + 2.89061144264 * x * y * z * rest(first, 10)
                   - 0.457045799464 * y * (4.0 * zz - xx - yy) * rest(first, 11)
                   + 0.37317633259 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy) * rest(first, 12)
                   - 0.457045799464 * x * (4.0 * zz - xx - yy) * rest(first, 13)
                   + 1.44530572132 * z * (xx - yy) * rest(first, 14)
                   - 0.590043589927 * x * (xx - 3.0 * yy) * rest(first, 15);
        }
        vec3 color = max(mean.rgb + sum, 0.0);
        STORE_TEXEL(particles, int(3u * i + 1u), floatBitsToUint(vec4(color, mean.w)));
    }
}
