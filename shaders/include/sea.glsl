// The mirror of a sea under wind (model.md §19, src/model/sky/sea.rs). Needs angle.glsl
// and clear_sky.glsl.

const float MIRRORED_FROM_ABOVE = 0.02;
// Least sine of the elevations of the sun and of a wave's normal.
const float LEAST_WAVE_UP = 1e-4;

float fresnel(float cosine) {
    float away = 1.0 - min(cosine, 1.0), square = away * away;
    return MIRRORED_FROM_ABOVE + (1.0 - MIRRORED_FROM_ABOVE) * (square * square * away);
}

// Returns the share of the normal distribution below c >= 0, to 7.5e-8 (Abramowitz and Stegun,
// 26.2.17), and its density there.
vec2 normal_at(float c) {
    float density = 0.39894228 * exp(-0.5 * c * c), t = 1.0 / (1.0 + 0.2316419 * c);
    float tail = t * (0.319381530 + t * (-0.356563782
                 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))));
    return vec2(1.0 - density * tail, density);
}

struct Waves {
    // Area of the waves that a direction sees, over that of the level sea.
    float seen;
    // Share of the slopes that face it.
    float share;
};

Waves waves_at(float deviation, vec3 direction) {
    float up = direction.y, across = length(direction.xz);
    // Beyond 20 deviations nothing changes.
    vec2 normal = normal_at(min(up / max(deviation * across, 1e-12), 20.0));
    return Waves(up * normal.x + deviation * across * normal.y, normal.x);
}

// Returns the radiance that a level sea mirrors: sky, and `sunlit` of the sun. slopes: mean square
// of the waves' slopes.
vec3 of_sea(Sky sky, float slopes, vec3 toward_eye, float sunlit) {
    float deviation = sqrt(0.5 * slopes);
    Waves eye = waves_at(deviation, toward_eye);
    float tilt = deviation * deviation * eye.share / eye.seen;
    vec3 normal = normalize(vec3(tilt * toward_eye.x, 1.0, tilt * toward_eye.z));
    float cosine = dot(normal, toward_eye);
    vec3 mirrored = normalize(2.0 * cosine * normal - toward_eye);
    vec3 of_sky = fresnel(cosine) * dome_radiance(sky, mirrored);

    vec3 half_way = sky.toward_sun + toward_eye;
    float size = length(half_way);
    vec3 facet = size > 0.0 ? half_way / size : vec3(0.0, 1.0, 0.0);
    float sun_up = max(sky.toward_sun.y, LEAST_WAVE_UP);
    vec3 sun = vec3(sky.toward_sun.x, sun_up, sky.toward_sun.z);
    float shadowed = eye.seen + toward_eye.y * (waves_at(deviation, sun).seen / sun_up - 1.0);
    float facet_up = max(facet.y, LEAST_WAVE_UP), square = facet_up * facet_up;
    float exponent = dot(facet.xz, facet.xz) / (square * slopes);
    float density = exp(-exponent) / (3.14159265 * slopes);
    float glitter = fresnel(dot(facet, toward_eye)) * density / (4.0 * square * square * shadowed);
    return of_sky + sunlit * glitter * sky.sun;
}
