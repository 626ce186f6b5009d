// Particles, and their places in this frame, by texels: a device may take more of them than a
// storage buffer holds. A Placed is one texel, a Particle three. The names of the buffers are
// `placed` and `particles`. Needs records.glsl.

Placed placed_of(uvec4 words) {
    vec4 v = uintBitsToFloat(words);
    return Placed(v.xyz, v.w);
}

// A caller that uses some members alone fetches no other texels.
Particle particle_of(uvec4 place, uvec4 shade, uvec4 shape) {
    vec4 p = uintBitsToFloat(place), s = uintBitsToFloat(shade);
    vec2 aspects = uintBitsToFloat(shape.xy);
    return Particle(p.xyz, p.w, s.xyz, s.w, aspects.x, aspects.y, shape.zw);
}

#define PLACED_AT(i) placed_of(TEXEL(placed, int(i)))
#define PARTICLE_AT(i)                                                                             \
    particle_of(                                                                                   \
        TEXEL(particles, int(3u * (i))), TEXEL(particles, int(3u * (i) + 1u)),                     \
        TEXEL(particles, int(3u * (i) + 2u))                                                       \
    )

// Writes the place of particle i.
#define STORE_PLACED(i, position, sigma)                                                           \
    STORE_TEXEL(placed, int(i), floatBitsToUint(vec4(position, sigma)))
// Writes particle i, a ball of its own colour.
#define STORE_BALL(i, position, sigma, kappa)                                                      \
    STORE_TEXEL(particles, int(3u * (i)), floatBitsToUint(vec4(position, sigma)));                 \
    STORE_TEXEL(particles, int(3u * (i) + 1u), floatBitsToUint(vec4(1.0, 1.0, 1.0, kappa)));       \
    STORE_TEXEL(particles, int(3u * (i) + 2u), uvec4(floatBitsToUint(vec2(1.0)), 0u, 0u))
