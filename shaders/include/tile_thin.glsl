// Composition near to far of splats that are thin: C += (1 - A) a L, A += (1 - A) a, a the opacity
// of the whole splat, at its centre (passes.md "tiles"). Needs the row of tiles.comp.

float opacity(float t) {
#if THIN
    return HALVES ? thin_opacity_16(t) : thin_opacity(t);
#else
    return HALVES ? one_minus_exp_16(t) : one_minus_exp(t);
#endif
}

void compose(Loaded splat, float y) {
    // Radiance, near/z.
    vec4 light = uintBitsToFloat(splat.fours[1]);
    float tau[RUN], passed[RUN];
    bool shows[RUN];
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        // Each pixel decides by itself, so that it does not depend on which others are drawn.
        passed[j] = 1.0 - alpha[j];
        shows[j] = !(passed[j] < saturated);
#if BEHIND
        shows[j] = shows[j] && light.w >= depth_of[j];
#endif
    }
    find_depths(splat, y, shows, tau);
#if SHADED
    vec2 s = uintBitsToFloat(splat.fours[0].xy);
    vec3 shade = uintBitsToFloat(splat.fours[I_SHADE].xyz);
    float middle = 1.0 + shade.y * (y - s.y);
    vec2 nearer = shade.z * SEEN_BEFORE;
    float tint[RUN];
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        float seen = min(tau[j], DEEPEST_SEEN);
        float across = middle + shade.x * (x_of[j] - s.x);
        tint[j] = max(across + seen * (nearer.x + nearer.y * seen), 0.0);
    }
#endif
    [[unroll]] for (uint j = 0; j < RUN; ++j) { tau[j] = opacity(tau[j]); }
    [[unroll]] for (uint j = 0; j < RUN; ++j) {
        float here = passed[j] * tau[j];
        alpha[j] += here;
#if SHADED
        color[j] += here * tint[j] * light.xyz;
#else
        color[j] += here * light.xyz;
#endif
    }
}

// Composes the `end` first splats that the invocations have loaded.
void compose_loaded(Loaded splat, uint end, float y) {
    // A loop writes its carried values again in each iteration, and the number of iterations bounds
    // the splats of a round (passes.md "tiles").
#if QUEUE && INVOCATIONS <= 8
    // Every batch but a tile's last is full.
    [[unroll]] for (uint m = 0; m < INVOCATIONS; ++m) { compose(of_invocation(splat, m), y); }
#else
    uint m = 0;
    do {
        compose(of_invocation(splat, m), y);
        compose(of_invocation(splat, m + 1), y);
        m += 2;
    } while (m < end);
#endif
}
