// Textured splats, for every path that draws them (model.md §9, passes.md "texture").
// texture_sample_of() computes what a splat needs, once; texture_exponent() returns ln of the
// factor on tau in a pixel. Needs records, functions and philox; pixels need SAMPLES_TEXTURE and
// `TEXELS pool`.

// "text": the stream's counters differ from those of particles.
const uint TEXTURE_STREAM = 0x74657874u;

// Side of level 0 in texels; level l has 2^-l of it.
const uint TEXTURE_SIDE = 256;
const int LAST_LEVEL = 5;
// Texels of all levels of one field. Levels before l have 4^8 + ... = (4^9 - 4^(9 - l))/3 texels.
const uint FIELD_TEXELS = 87360;
uint level_offset(uint level) { return (262144u - (262144u >> (2u * level))) / 3u; }

// A period of the field in sigma.
const float PERIOD_SIGMA = 6.0;
// Quanta of n in the pool, 16 bits each.
const float QUANTA = 4096.0;
// The same in words whose upper half they are: pixels read them there, which takes one operation
// less for a sign and rounds nothing.
const float UPPER_QUANTA = 65536.0 * QUANTA;

// By level the mean squares, over all places, of n_l, of n_l n_l+1 and of n_l+1, as bilinear
// interpolation has them.
const vec3 MEAN_SQUARES[6] = vec3[](
    vec3(0.9947730937451398, 0.9811503327856939, 0.9765335236418375),
    vec3(0.9765335236418375, 0.9418785995344559, 0.9311588081134532),
    vec3(0.9311588081134532, 0.8447946249367331, 0.8223410488849066),
    vec3(0.8223410488849066, 0.6166847013743091, 0.579927630240152),
    vec3(0.579927630240152, 0.14228647888238133, 0.12315655986123047),
    vec3(0.12315655986123047, 0.0, 0.0)
);

struct TextureSample {
    // From a difference of slopes d to texels (a d.x - b d.y + c, b d.x + a d.y + d): a, b, c, d.
    vec4 turn;
    // The level's first texel in the pool; log2 of the level's side.
    uvec2 place;
    // Factors on n_l and n_l+1 in quanta of a word; the subtrahend that gives the factor mean one.
    vec3 gain;
};

// Returns the texture's place and level for particle i_particle at a view depth of z_in_sigma
// sigma. pixel: change of slopes from a pixel to the next.
TextureSample texture_sample_of(Textured textured, uint i_particle, float z_in_sigma, float pixel) {
    uvec4 words = philox4x32_10(
        uvec2(textured.seed, textured.i_box),
        uvec4(i_particle - textured.i_first, 0u, 0u, TEXTURE_STREAM)
    );
    vec3 u = uniforms(words).xyz;
    // Texels of level 0 in a pixel; from 2^6 on no wave is left that a pixel could show.
    float dense = clamp(float(TEXTURE_SIDE) / PERIOD_SIGMA * (z_in_sigma * pixel), 1.0, 64.0);
    int level = min(int(floatBitsToUint(dense) >> 23) - 127, LAST_LEVEL);
    // 2^-level.
    float scale = uintBitsToFloat(uint(127 - level) << 23);
    float fade = min(dense * scale - 1.0, 1.0);
    float side = float(TEXTURE_SIDE) * scale;
    float stretch = side / PERIOD_SIGMA * z_in_sigma;
    vec2 turn = stretch * unit_at(u.x - 0.5);
    vec3 squares = MEAN_SQUARES[level];
    float s = textured.strength, own = 1.0 - fade;
    float square = own * own * squares.x + 2.0 * own * fade * squares.y + fade * fade * squares.z;
    return TextureSample(
        vec4(turn, side * u.yz),
        uvec2(textured.i_field * FIELD_TEXELS + level_offset(uint(level)), 8u - uint(level)),
        vec3(s * own * (1.0 / UPPER_QUANTA), s * fade * (1.0 / UPPER_QUANTA), 0.5 * s * s * square)
    );
}

#ifdef SAMPLES_TEXTURE
// Returns n_l and n_l+1, weighted, at the two corners of a word: its lower and its upper half.
vec2 weighted(uint own, uint above, vec3 gain) {
    ivec2 a = ivec2(own << 16, own & 0xffff0000u), b = ivec2(above << 16, above & 0xffff0000u);
    return gain.x * vec2(a) + gain.y * vec2(b);
}

// Returns s n - s^2 <n^2>/2 where the ray's slopes are delta from the centre's. One texel holds all
// four corners of both levels.
float texture_exponent(vec2 delta, vec4 turn, uvec2 place, vec3 gain) {
    vec2 at =
        vec2(turn.x * delta.x - turn.y * delta.y, turn.y * delta.x + turn.x * delta.y) + turn.zw;
    vec2 low = floor(at), share = at - low;
    // Two's complement: the lowest bits are the remainder, of negative numbers too.
    uvec2 corner = uvec2(ivec2(low)) & ((1u << place.y) - 1u);
    uvec4 words = TEXEL(pool, int(place.x + (corner.y << place.y) + corner.x));
    vec2 near = weighted(words.x, words.z, gain), far = weighted(words.y, words.w, gain);
    vec2 along = near + share.y * (far - near);
    return along.x + share.x * (along.y - along.x) - gain.z;
}
#endif
