// Light of the sky on the box of the grid (model.md §18). Needs the buffer `lights` and
// push.n_lights.

// Returns the light of the sky that comes in through a face: `share` of a horizontal plane's.
vec3 of_sky(float share) {
    vec3 sum = vec3(0.0);
    for (uint l = 0; l < push.n_lights; ++l) {
        if (lights[l].kind == LIGHT_SKY) {
            sum += lights[l].energy * (share + lights[l].constant);
        }
    }
    return sum;
}
