// Light of the skies of a scene (model.md §18, §19). Needs angle.glsl, the buffer `lights` and
// push.n_lights.

// All skies together. From below the horizon, pi times their radiance is `all`. From a direction w
// above it, above + tilt_x w.x + tilt_y w.y + tilt_z w.z comes in addition.
struct Skies {
    vec3 all;
    vec3 above;
    vec3 tilt_x;
    vec3 tilt_y;
    vec3 tilt_z;
};

// Mean of the sine of the elevation by the light on a level plane.
const float MEAN_UP = 2.0 / 3.0;

Skies all_skies() {
    vec3 none = vec3(0.0);
    Skies sum = Skies(none, none, none, none, none);
    for (uint l = 0; l < push.n_lights; ++l) {
        Light light = lights[l];
        if (light.kind == LIGHT_SKY) {
            sum.all += light.energy * light.constant;
            sum.above += light.energy * (1.0 - MEAN_UP * light.tilt_y);
            sum.tilt_x += light.energy * light.tilt_x;
            sum.tilt_y += light.energy * light.tilt_y;
            sum.tilt_z += light.energy * light.tilt_z;
        }
    }
    return sum;
}

// Returns pi times the radiance from the unit direction w, of which the share `above` comes from
// above the horizon.
vec3 sky_along(Skies of, vec3 w, float above) {
    return of.all
           + above * (of.above + of.tilt_x * w.x + of.tilt_y * max(w.y, 0.0) + of.tilt_z * w.z);
}

// Returns the integral of w (n.w)/pi over the directions w above the horizon and above a facet of
// unit normal n.
vec3 mean_above(vec3 n) {
    const float PI = 3.14159265359;
    float across = length(n.xz);
    vec3 mean = (PI - angle_between(n, vec3(0.0, 1.0, 0.0), n.y)) * n;
    return (MEAN_UP / PI) * (mean + vec3(0.0, across, 0.0));
}

// Returns the irradiance on a facet of unit normal n.
vec3 sky_on(Skies of, vec3 n) {
    vec3 mean = mean_above(n);
    return of.all + of.above * (0.5 + 0.5 * n.y) + of.tilt_x * mean.x + of.tilt_y * mean.y
           + of.tilt_z * mean.z;
}

// Returns the same of one sky over its energy; v is the transmittance toward the zenith.
vec3 share_of_sky(Light sky, vec3 n, float v) {
    vec3 mean = mean_above(n);
    vec3 above = (0.5 + 0.5 * n.y) * (1.0 - MEAN_UP * sky.tilt_y);
    return v * (above + sky.tilt_x * mean.x + sky.tilt_y * mean.y + sky.tilt_z * mean.z)
           + sky.constant;
}
