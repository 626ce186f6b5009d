// Composition near to far of splats that overlap, by slices: shells of one thickness about the eye
// (passes.md "slices"). A splat's optical depth is dealt among OPEN slices by the share of a
// Gaussian in each: the two beside the boundary that is nearest to its centre, and those before
// them. All that is nearer belongs to the first, all that is farther to the last. A slice is
// composed as the mixture it is: C += (1 - A) (1 - e^-t) q/t, A += (1 - A)(1 - e^-t), t the slice's
// optical depth and q the sum of depths times radiances. Needs the row of tiles.comp.

// Fours of a pixel's state: colour and opacity, the open slices, their place.
const uint STATE_FOURS = 2 + OPEN;

// Middle of the nearest open slice, from the boundary between the last two.
const float NEAREST_MIDDLE = 1.5 - float(OPEN);

// q (xyz) and t (w) of the slices that splats not yet composed may reach, near to far.
vec4 open[OPEN][RUN];
// The boundary between the last two open slices, counted from the eye.
int i_boundary;
#if BEHIND
// Distance of the surface, in those of the near plane.
float wall[RUN];
#endif

// Starts pixel j of the row, number p of the picture, without splats or as the last round left it.
void start_slices(uint j, uint p) {
#if ROUNDS
    [[unroll]] for (uint m = 0; m < OPEN; ++m) { open[m][j] = state[STATE_FOURS * p + 1 + m]; }
    // The same for all pixels of a tile.
    i_boundary = int(state[STATE_FOURS * p + 1 + OPEN].x);
#else
    [[unroll]] for (uint m = 0; m < OPEN; ++m) { open[m][j] = vec4(0.0); }
    i_boundary = 0;
#endif
#if BEHIND
    wall[j] = length_of_ray(j) / depth_of[j];
#endif
}

#if ROUNDS
// Keeps what is in the open slices of pixel j, number p of the picture, for the next round.
void keep_slices(uint j, uint p) {
    [[unroll]] for (uint m = 0; m < OPEN; ++m) { state[STATE_FOURS * p + 1 + m] = open[m][j]; }
    state[STATE_FOURS * p + 1 + OPEN] = vec4(float(i_boundary), 0.0, 0.0, 0.0);
}
#endif

// Returns the share of a unit normal distribution below u.
float below(float u) { return 0.5 + 0.5 * erf_approx(0.707106781187 * u); }

// Returns the density of a unit normal distribution at u.
float density(float u) { return 0.398942280401 * exp(-0.5 * min(u * u, 200.0)); }

// Returns the number of the boundary nearest to the splat's centre, but not before an earlier
// splat's: two keys of the sort may be equal, or rounded.
int boundary_after(int own, uint t) {
    int all = max(own, i_boundary);
    [[unroll]] for (uint apart = 1; apart < INVOCATIONS; apart *= 2) {
#if ONE_SUBGROUP
        int before = subgroupShuffle(all, max(t, apart) - apart);
#else
        shared_boundary[t] = all;
        barrier();
        int before = shared_boundary[max(t, apart) - apart];
        barrier();
#endif
        all = max(all, before);
    }
    return all;
}

// Finds where the splat of invocation t lies among the slices, as far as that is the same for all
// pixels. For a ball its own share of a slice is taken along the ray through its centre.
void find_shares(inout Loaded splat, uint t, bool is_splat) {
    vec2 s = uintBitsToFloat(splat.fours[0].xy);
    float near_over_z = uintBitsToFloat(splat.fours[1].w);
    splat.distance = sqrt(1.0 + dot(s, s)) / near_over_z;
    // z/sigma from the scale z^2/(2 sigma^2 ln 2).
    splat.near_in_sigmas =
        sqrt(1.38629436112 * uintBitsToFloat(splat.fours[0].z)) * near_over_z;
    // Beyond 2^24 slices are not told apart.
    float at = min(splat.distance * push.near_in_slices, 16777216.0);
    splat.boundary = boundary_after(is_splat ? int(roundEven(at)) : 0, t);
#if !ELLIPSOIDS
    float slice_in_sigmas = splat.near_in_sigmas / push.near_in_slices;
    [[unroll]] for (uint m = 0; m < OPEN - 1u; ++m) {
        float u = (float(splat.boundary + int(m) + 2 - int(OPEN)) - at) * slice_in_sigmas;
        splat.within[m] = below(u);
#if SHADED
        splat.density[m] = density(u);
#endif
    }
#endif
}

#if CELLS
// A slice's thickness along the rays through x = 0 of the row, in cells.
vec3 along_row;

// Returns the light that cells scatter toward the eye in the middle of a slice at pixel j, as a
// mean over the channels.
float light_at(uint j, float middle) {
    ivec3 n = ivec3(push.n_x, push.n_y, push.n_z);
    vec3 ray = along_row + x_of[j] * push.right_in_cells;
    Weights of = weights_among(n, push.eye_in_cells + middle / length_of_ray(j) * ray);
    float sum = 0.0;
    [[unroll]] for (int corner = 0; corner < 8; ++corner) {
        Corner to = corner_of(n, of, corner);
        vec4 here = uintBitsToFloat(TEXEL(seen_cells, to.i_cell));
        sum += to.share * dot(here.rgb, vec3(1.0 / 3.0));
    }
    return sum;
}
#endif

// Composes the nearest open slice of all pixels, if `is_on`. Its middle is so many slices from the
// eye.
void close_slice(bool is_on, float middle) {
    float t[RUN], here[RUN];
    // Step by step for all pixels, as in find_depths().
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        t[j] = open[0][j].w;
        here[j] = is_on ? one_minus_exp(t[j]) : 0.0;
    }
#if CELLS
    // Light of the first and the last pixel; between them it is linear.
    float first = 0.0, last = 0.0;
    // The same for all pixels: where nothing is composed, nothing is fetched.
    if (is_on) {
        first = light_at(0, middle);
        last = light_at(RUN - 1u, middle);
    }
#endif
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        float passed = 1.0 - alpha[j];
        // Each pixel decides by itself, so that it does not depend on which others are drawn.
        here[j] *= passed < saturated ? 0.0 : passed;
        alpha[j] += here[j];
#if CELLS
        float light = mix(first, last, float(j) / float(RUN - 1u));
        color[j] += here[j] / max(t[j], 1e-30) * open[0][j].xyz * light;
#else
        color[j] += here[j] / max(t[j], 1e-30) * open[0][j].xyz;
#endif
    }
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        [[unroll]] for (uint m = 1; m < OPEN; ++m) {
            open[m - 1][j] = is_on ? open[m][j] : open[m - 1][j];
        }
        open[OPEN - 1][j] = is_on ? vec4(0.0) : open[OPEN - 1][j];
    }
}

// Composes the slices before those that a splat at `boundary` reaches.
void close_before(int boundary) {
    int n = clamp(boundary - i_boundary, 0, int(OPEN));
    float middle = float(i_boundary) + NEAREST_MIDDLE;
    i_boundary = boundary;
    // Where n is 0 there is one turn that does nothing: llvmpipe would run it, too, if the loop
    // tested first.
    do {
        close_slice(n > 0, middle);
        middle += 1.0;
        --n;
    } while (n > 0);
}

void close_all() {
    float middle = float(i_boundary) + NEAREST_MIDDLE;
    [[unroll]] for (uint m = 0; m < OPEN; ++m) { close_slice(true, middle + float(m)); }
}

#if SHADED
// Light of a splat along the rays through its middle, and its change by sigma toward the eye.
float across_blob[RUN];
float nearer;
#endif

// Adds a part of a splat's optical depth t to slice m of pixel j. `middle` is the mean of z over
// the part, sigma behind the centre, times its share.
void add_part(uint m, uint j, float t, float share, float middle, vec3 radiance) {
#if SHADED
    float light = max(share * across_blob[j] - nearer * middle, 0.0);
    open[m][j] += t * vec4(light * radiance, share);
#else
    open[m][j] += t * share * vec4(radiance, 1.0);
#endif
}

// Adds a splat to the open slices.
void compose(Loaded splat, float y) {
    vec3 radiance = uintBitsToFloat(splat.fours[1].xyz);
    vec2 s = uintBitsToFloat(splat.fours[0].xy);
    float tau[RUN];
    bool shows[RUN];
    [[unroll]] for (uint j = 0; j < RUN; ++j) { shows[j] = true; }
    find_depths(splat, y, shows, tau);
    // Nothing shows through so much, and sums with radiances of 1e15 stay finite.
    [[unroll]] for (uint j = 0; j < RUN; ++j) { tau[j] = min(tau[j], 1e15); }
#if SHADED
    vec3 shade = uintBitsToFloat(splat.fours[I_SHADE].xyz);
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        across_blob[j] = 1.0 + shade.y * (y - s.y) + shade.x * (x_of[j] - s.x);
    }
    nearer = shade.z;
#endif
#if ELLIPSOIDS || BEHIND
    // Distance and size along the ray, where they differ from pixel to pixel.
    float distance = splat.distance, in_sigmas = splat.near_in_sigmas;
#if ELLIPSOIDS == 2
    vec4 conic = uintBitsToFloat(splat.fours[N_FOURS - 2]);
    vec3 lean = uintBitsToFloat(splat.fours[N_FOURS - 1].xyz);
#elif ELLIPSOIDS
    vec3 vertical = vec3(push.y_right, push.y_up, push.y_forward);
    float inverse = uintBitsToFloat(splat.fours[N_FOURS - 1]).w;
    float flatness = (inverse - 1.0) * dot(vertical, vec3(s, 1.0));
#endif
#if ELLIPSOIDS
    float inv_depth = splat.distance / sqrt(1.0 + dot(s, s));
    float slice = 1.0 / push.near_in_slices;
#endif
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
#if ELLIPSOIDS == 2
        // A ball lies as along the ray through its centre.
        if (lean.z == 0.0) {
            float dx = x_of[j] - s.x, dy = y - s.y, norm = 1.0 / inv_norm[j];
            float along = 1.0 + lean.x * dx + lean.y * dy;
            float form = (conic.x * dx + conic.y * dy) * dx + conic.z * dy * dy;
            float scale = uintBitsToFloat(splat.fours[0].z);
            float white = conic.w * along * along + form / (scale * conic.w);
            distance = inv_depth * sqrt(norm) * conic.w * along / white;
            in_sigmas = splat.near_in_sigmas * sqrt(white / norm);
        }
#elif ELLIPSOIDS
        // A ball lies as along the ray through its centre.
        if (inverse != 1.0) {
            float norm = across[j] + along[j], white = across[j] + inverse * along[j];
            float foot = 1.0 + dot(s, vec2(x_of[j], y)) + flatness * upward[j];
            distance = inv_depth * sqrt(norm) * foot / white;
            in_sigmas = splat.near_in_sigmas * sqrt(white / norm);
        }
#endif
#if BEHIND
        float to_wall = (wall[j] - distance) * in_sigmas;
        float all = below(to_wall);
#else
        float all = 1.0;
#endif
        float before = 0.0, density_before = 0.0;
        [[unroll]] for (uint m = 0; m < OPEN; ++m) {
            float within = all, density_here = 0.0;
#if SHADED && BEHIND
            density_here = density(to_wall);
#endif
            if (m + 1u < OPEN) {
#if ELLIPSOIDS
                float at = float(splat.boundary + int(m) + 2 - int(OPEN)) * slice;
                float u = (at - distance) * in_sigmas;
                within = min(all, below(u));
#else
                within = min(all, splat.within[m]);
#endif
#if SHADED
                if (within < all) {
#if ELLIPSOIDS
                    density_here = density(u);
#else
                    density_here = splat.density[m];
#endif
                }
#endif
            }
            // A division that is not monotone would make a share negative.
            within = max(within, before);
            add_part(m, j, tau[j], within - before, density_before - density_here, radiance);
            before = within;
            density_before = density_here;
        }
    }
#else
    float before = 0.0, density_before = 0.0;
    [[unroll]] for (uint m = 0; m < OPEN; ++m) {
        // A division that is not monotone would make a share negative.
        float within = max(m + 1u < OPEN ? splat.within[m] : 1.0, before);
        float share = within - before, middle = 0.0;
#if SHADED
        float density_here = m + 1u < OPEN ? splat.density[m] : 0.0;
        middle = density_before - density_here;
        density_before = density_here;
#endif
        before = within;
#if SHADED
        [[unroll]] for (uint j = 0; j < RUN; ++j) {
            add_part(m, j, tau[j], share, middle, radiance);
        }
#else
        // The same for all pixels.
        vec4 part = share * vec4(radiance, 1.0);
        [[unroll]] for (uint j = 0; j < RUN; ++j) { open[m][j] += tau[j] * part; }
#endif
    }
#endif
}

// Adds the `end` first splats that the invocations have loaded.
void compose_loaded(Loaded splat, uint end, float y) {
    uint m = 0;
    int boundary = boundary_of(splat, 0);
    do {
        close_before(boundary);
        do {
            compose(of_invocation(splat, m), y);
            ++m;
            boundary = boundary_of(splat, min(m, INVOCATIONS - 1u));
        } while (m < end && boundary == i_boundary);
    } while (m < end);
}
