// Light of the skies of a scene (model.md §18, §19). Needs angle.glsl, the buffer `lights` and
// push.n_lights.

// All skies: pi times their radiance from a direction w above the horizon is
// all + above + tilt_x w.x + tilt_y w.y + tilt_z w.z, and from below it is `all`.
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

// Returns the irradiance on a facet of unit normal n.
vec3 sky_on(Skies of, vec3 n) {
    const float PI = 3.14159265359;
    float across = length(n.xz);
    // Of directions, over the lune above the horizon and the facet.
    vec3 mean = (PI - angle_between(n, vec3(0.0, 1.0, 0.0), n.y)) * n;
    mean = (MEAN_UP / PI) * (mean + vec3(0.0, across, 0.0));
    return of.all + of.above * (0.5 + 0.5 * n.y) + of.tilt_x * mean.x + of.tilt_y * mean.y
           + of.tilt_z * mean.z;
}
