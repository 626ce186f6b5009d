#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "each.glsl"
#include "philox.glsl"
#include "functions.glsl"

// Computes the particles of a disc at a frame's time, each in closed form of (seed, slot, time)
// (model.md §2).
// In: the disc's record. Out: particles relative to their group's centre. Source: C §2.3.

layout(push_constant) uniform Push {
    uint i_disc;
    uint n_particles;
} push;
READS(0, Disc, discs)
TEXEL_STORES(1, particles)

// "disc", as in src/model/disc.rs.
const uint STREAM = 0x64697363u;
// The step of the numbers, an exact 2^-24: it keeps the root off 1/0, and 0 stays 0.
const float LEAST_SHARE = 1.0 / 16777216.0;

// Returns a place on the disc of radius 1, uniform over its area.
vec2 on_disc(float u, float turns) {
    return u * inversesqrt(max(u, LEAST_SHARE)) * -unit_at(turns - 0.5);
}

float smooth_rise(float v) {
    float w = clamp(v, 0.0, 1.0);
    return w * w * (3.0 - 2.0 * w);
}

vec4 draw(Disc d, uint slot, uint generation, uint k) {
    return uniforms(philox4x32_10(uvec2(d.seed, STREAM), uvec4(slot, generation, k, STREAM)));
}

void main() {
    FOR_EACH(slot, push.n_particles) {
        Disc d = discs[push.i_disc];
        // Integers decide which generation lives, so that host and device never differ by a birth.
        uint phase = d.phase + bitfieldReverse(slot);
        uint generation = d.generation + (phase < d.phase ? 1u : 0u);
        vec4 u = draw(d, slot, generation, 0), v = draw(d, slot, generation, 1);

        // Shares of the period: the lifetime, and the time lived. The sum is the only rounding.
        float life = 1.0 - d.life_spread * v.x;
        float spent =
            min(float(phase >> 8) * (1.0 / 16777216.0) + float(phase & 255u) * (1.0 / 4294967296.0),
                life);
        float cooled = one_minus_exp(spent * d.cooling);
        float warm = (1.0 + d.warmth_spread * (2.0 * u.w - 1.0)) * (1.0 - d.core * u.x);
        float rise = d.rise * warm * cooled;
        vec2 place = d.radius * on_disc(u.x, u.y) + d.outflow * cooled * on_disc(v.y, v.z);
        vec3 position = spent * d.drift + vec3(place.x, rise, place.y);

        float born = d.sigma * (1.0 + d.sigma_spread * (2.0 * u.z - 1.0));
        float sigma = born + d.growth * rise;
        float thinner = born / sigma;
        float diluted = d.dilution == 3   ? thinner * thinner * thinner
                        : d.dilution == 1 ? thinner
                                          : 1.0;
        float lived = spent / life;
        float faded =
            smooth_rise(lived * d.inv_fade_in) * smooth_rise((1.0 - lived) * d.inv_fade_out);
        float above = position.y - d.base - d.lift * warm * (1.0 - cooled);
        float condensed = d.inv_over > 0.0 ? smooth_rise(above * d.inv_over) : 1.0;
        float kappa = d.kappa * diluted * faded * condensed;
        STORE_BALL(d.i_first + slot, position - d.center, sigma, kappa);
    }
}
