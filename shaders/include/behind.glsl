// The sky behind a scene, and the plane at sea level (model.md §19, src/model/sky/mod.rs). Needs
// angle.glsl, clear_sky.glsl and sea.glsl.

// Returns the radiance behind everything, in a unit direction.
vec3 sky_behind(Sky sky, vec3 direction) {
    if (direction.y >= 0.0) {
        vec3 depth = depth_to_space(sky, sky.height, direction.y);
        return taken_by(depth) * radiance_of_air(sky, direction)
               + sky.disc * share_of_disc(sky, direction);
    }
    if (sky.has_ground == 0u || !(sky.height > 0.0)) {
        return radiance_of_air(sky, direction);
    }
    float height = sky.height / (sky.unit * sky.flatness);
    Haze haze = haze_before(sky, direction, height / -direction.y);
    vec3 mirrored = vec3(0.0);
    if (sky.slopes > 0.0) {
        mirrored = of_sea(sky, sky.slopes, -direction, 1.0);
    }
    return haze.through * (sky.ground + mirrored) + haze.added;
}
