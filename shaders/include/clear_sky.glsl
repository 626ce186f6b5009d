// The clear sky, and the air before things of the scene (model.md §19, src/model/sky/). Needs
// records.glsl and angle.glsl.

// Least sine of an elevation: below it the air to space is opaque.
const float LEAST_UP = 1e-6;

// Returns the radiance of the dome from a unit direction (Hosek and Wilkie 2012, eq. 8). Below the
// horizon the height counts as above it.
vec3 dome_radiance(Sky sky, vec3 direction) {
    float cos_sun = dot(direction, sky.toward_sun);
    float from_sun = angle_between(direction, sky.toward_sun, cos_sun);
    float up = abs(direction.y);
    float square = cos_sun * cos_sun;
    // 1 + i^2 - 2 i cos, without the difference of near numbers close to the sun.
    vec3 chord = direction - sky.toward_sun;
    vec3 around = (1.0 - sky.i) * (1.0 - sky.i) + sky.i * dot(chord, chord);
    vec3 halo = (1.0 + square) / (around * sqrt(around));
    vec3 of_height = 1.0 + sky.a * exp(sky.b / (up + 0.01));
    vec3 of_sun = sky.c + sky.d * exp(sky.e * from_sun) + sky.f * square + sky.g * halo
                  + sky.h * sqrt(up);
    return max(sky.scale * of_height * of_sun, 0.0);
}

// Returns (1 - e^-x)/x. Below 1e-2, where the difference loses digits, it is the series; its next
// term is 1e-10.
float mean_decay(float x) {
    return x < 1e-2 ? 1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0)) : (1.0 - exp(-x)) / x;
}

// Returns the share of light that air of an optical depth takes.
vec3 taken_by(vec3 depth) {
    return depth * vec3(mean_decay(depth.r), mean_decay(depth.g), mean_decay(depth.b));
}

// Returns the optical depth from a height to space.
vec3 depth_to_space(Sky sky, float height, float up) {
    float low = max(height, 0.0);
    vec3 all = sky.molecules * exp(-low * sky.inv_molecules)
               + sky.aerosol * exp(-low * sky.inv_aerosol);
    return all / max(up, LEAST_UP);
}

// Returns the mean of e^(-h/H) between two heights.
float mean_density(float low, float high, float inverse) {
    return exp(-low * inverse) * mean_decay((high - low) * inverse);
}

// Returns the optical depth of a straight way from one height to another.
vec3 depth_between(Sky sky, float from, float to, float way) {
    float low = max(min(from, to), 0.0), high = max(max(from, to), 0.0);
    return way
           * (sky.molecules * (sky.inv_molecules * mean_density(low, high, sky.inv_molecules))
              + sky.aerosol * (sky.inv_aerosol * mean_density(low, high, sky.inv_aerosol)));
}

// Returns the radiance of opaque air in a unit direction.
vec3 radiance_of_air(Sky sky, vec3 direction) {
    return dome_radiance(sky, direction) / taken_by(depth_to_space(sky, 0.0, abs(direction.y)));
}

struct Haze {
    vec3 through;
    vec3 added;
};

// Returns the air before a place that is `far` scene units away in a unit direction.
Haze haze_before(Sky sky, vec3 direction, float far) {
    // The squares of far ways have no number.
    vec3 flat_direction = direction * vec3(1.0, sky.flatness, 1.0);
    float metres = far * sky.unit;
    float to = sky.height + metres * flat_direction.y;
    vec3 depth =
        sky.haze * depth_between(sky, sky.height, to, metres * length(flat_direction));
    vec3 taken = taken_by(depth);
    return Haze(1.0 - taken, taken * radiance_of_air(sky, direction));
}

// Returns the share of the sun's disc that a direction sees.
float share_of_disc(Sky sky, vec3 direction) {
    float off = length(cross(direction, sky.toward_sun)) * sky.inv_sun;
    return dot(direction, sky.toward_sun) < 0.0 ? 0.0 : clamp((1.05 - off) * 10.0, 0.0, 1.0);
}
