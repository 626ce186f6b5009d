// Clouds as a medium that scatters (model.md §18, src/model/medium.rs).

const float INV_FOUR_PI = 0.0795774715459477;
// Optical depth beyond which nothing is left in a float.
const float OPAQUE_DEPTH = 110.0;

// e^-depth by channel. Vulkan's exp(0) may be three ulp off 1.
vec3 through(vec3 depth) {
    vec3 passed = exp(-min(depth, vec3(OPAQUE_DEPTH)));
    return mix(passed, vec3(1.0), equal(depth, vec3(0.0)));
}

// Returns the albedo of a half space that reflects `reflected` of diffuse light (van de Hulst).
vec3 albedo_of(vec3 reflected, float g) {
    vec3 r = clamp(reflected, 0.0, 1.0);
    vec3 b = 1.139 + 1.17 * r;
    vec3 s = 2.0 * (1.0 - r) / (b + sqrt(max(b * b - 0.556 * (1.0 - r), 0.0)));
    vec3 squared = min(s * s, vec3(1.0));
    // Where nothing is reflected and all goes forward, 0/0 is 0.
    return (1.0 - squared) / max(1.0 - g * squared, vec3(1e-30));
}

// Albedo, and share of the depth that counts, of particles of one colour.
struct Law {
    vec3 albedo;
    vec3 depth;
};

Law law_of(Medium m, vec3 color) {
    vec3 given = min(m.reflected * color, vec3(1.0));
    vec3 albedo = m.is_given != 0u ? given : albedo_of(m.reflected * color, m.g);
    vec3 depth = 1.0 - albedo * m.straight;
    return Law(albedo * (1.0 - m.straight) / max(depth, vec3(1e-30)), depth);
}

// Henyey and Greenstein's phase function at 1 - cos = away.
float henyey_greenstein(float g, float away) {
    float back = 1.0 - g;
    float d = max(back * back + 2.0 * g * away, 1e-30);
    return INV_FOUR_PI * (1.0 - g * g) / (d * sqrt(d));
}

// The phase function of a medium, its mean cosines multiplied by c.
float phase_at(Medium m, float c, float away) {
    float plain = henyey_greenstein(c * m.lobe, away);
    if (m.draine_share == 0.0) {
        return plain;
    }
    float g = c * m.draine_lobe, cosine = 1.0 - away;
    float peaked = henyey_greenstein(g, away) * (1.0 + m.draine_alpha * cosine * cosine)
                   / (1.0 + m.draine_alpha * (1.0 + 2.0 * g * g) * (1.0 / 3.0));
    return mix(plain, peaked, m.draine_share);
}

// The share that Henyey and Greenstein's phase function scatters by less than 90 degrees.
float forward_half(float g) {
    float q = sqrt(1.0 + g * g);
    return (1.0 + g) / (q * (q + 1.0 - g));
}
