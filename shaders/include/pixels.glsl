// A picture's pixels in buffers, row by row, and how they are stored. The includer defines PICTURE,
// the binding they are written to.

// Words of a pixel: 1 rgba8, 2 rgba16f, 4 rgba32f.
#ifndef PIXEL_WORDS
#define PIXEL_WORDS 2
#endif
// Pixels that are stored together as four words, where rows have a whole number of them.
#ifndef TOGETHER
#define TOGETHER 1
#endif
// 1: surfaces' depths are read; 2: and have 24 bits.
#ifndef BEHIND
#define BEHIND 0
#endif
// 1: the device has 64-bit words.
#ifndef WORDS_64
#define WORDS_64 0
#endif

#define TEXEL_PIXELS (4 / PIXEL_WORDS)
#define FOURS (TOGETHER * PIXEL_WORDS == 4)

// A device without vector stores makes one store an element: as few elements as possible.
#if FOURS && WORDS_64
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
layout(std430, binding = PICTURE) writeonly buffer Picture { u64vec2 picture[]; };
void store_words(uint i, uvec4 words) { picture[i] = u64vec2(pack64(words.xy), pack64(words.zw)); }
#elif FOURS
layout(std430, binding = PICTURE) writeonly buffer Picture { uvec4 picture[]; };
void store_words(uint i, uvec4 words) { picture[i] = words; }
#else
layout(std430, binding = PICTURE) writeonly buffer Picture { uint picture[]; };
#endif

// Returns pixel m of a texel.
vec4 pixel_of(uvec4 words, uint m) {
#if PIXEL_WORDS == 1
    return unpackUnorm4x8(words[m]);
#elif PIXEL_WORDS == 2
    return vec4(unpackHalf2x16(words[2 * m]), unpackHalf2x16(words[2 * m + 1]));
#else
    return uintBitsToFloat(words);
#endif
}

// Returns depths near/z of surfaces.
vec4 depths_of(uvec4 words) {
#if BEHIND == 2
    return vec4(words & 0xffffffu) / 16777215.0;
#else
    return uintBitsToFloat(words);
#endif
}

uvec4 packed(vec4 value) {
#if PIXEL_WORDS == 2
    // The device may round greater values to infinity.
    value = mix(value, vec4(65504.0), greaterThan(value, vec4(65504.0)));
#endif
#if PIXEL_WORDS == 1
    return uvec4(packUnorm4x8(value));
#elif PIXEL_WORDS == 2
    return uvec2(packHalf2x16(value.xy), packHalf2x16(value.zw)).xyxy;
#else
    return floatBitsToUint(value);
#endif
}

// Stores pixels p and on, TOGETHER of them.
void store_together(uint p, vec4 values[TOGETHER]) {
#if TOGETHER == 4
    store_words(
        p / 4,
        uvec4(packed(values[0]).x, packed(values[1]).x, packed(values[2]).x, packed(values[3]).x)
    );
#elif TOGETHER == 2
    store_words(p / 2, uvec4(packed(values[0]).xy, packed(values[1]).xy));
#elif FOURS
    store_words(p, packed(values[0]));
#else
    uvec4 words = packed(values[0]);
    [[unroll]] for (uint k = 0; k < PIXEL_WORDS; ++k) { picture[PIXEL_WORDS * p + k] = words[k]; }
#endif
}
