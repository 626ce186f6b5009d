// Declares a storage buffer of T at a binding: one that the shader reads, writes, or does both to.
#define READS(i, T, name) \
    layout(std430, binding = i) readonly buffer Buffer##i { T name[]; };
#define WRITES(i, T, name) \
    layout(std430, binding = i) writeonly buffer Buffer##i { T name[]; };
#define UPDATES(i, T, name) \
    layout(std430, binding = i) buffer Buffer##i { T name[]; };

// Declares a buffer that the shader reads by four words (TEXEL) or by floats (FLOAT), or writes by
// four words (STORE_TEXEL). Of one that it does both to it reads by LOAD_TEXEL. llvmpipe loads
// texels for all invocations at once. It loads elements of a storage buffer one by one, and a
// storage buffer holds fewer bytes. The host turns texel buffers off on devices that have few
// texels (maxTexelBufferElements).
#ifndef TEXEL_BUFFERS
#define TEXEL_BUFFERS 1
#endif
#if TEXEL_BUFFERS
#define TEXELS(i, name) layout(binding = i) uniform usamplerBuffer name;
#define FLOATS(i, name) layout(binding = i) uniform samplerBuffer name;
#define TEXEL_STORES(i, name) layout(rgba32ui, binding = i) writeonly uniform uimageBuffer name;
#define TEXEL_UPDATES(i, name) layout(rgba32ui, binding = i) coherent uniform uimageBuffer name;
#define TEXEL(name, k) texelFetch(name, k)
#define FLOAT(name, k) texelFetch(name, k).x
#define LOAD_TEXEL(name, k) imageLoad(name, k)
#define STORE_TEXEL(name, k, words) imageStore(name, k, words)
#else
#define TEXELS(i, name) READS(i, uvec4, name)
#define FLOATS(i, name) READS(i, float, name)
#define TEXEL_STORES(i, name) WRITES(i, uvec4, name)
#define TEXEL_UPDATES(i, name) \
    layout(std430, binding = i) coherent buffer Buffer##i { uvec4 name[]; };
#define TEXEL(name, k) name[k]
#define FLOAT(name, k) name[k]
#define LOAD_TEXEL(name, k) name[k]
#define STORE_TEXEL(name, k, words) name[k] = words
#endif
