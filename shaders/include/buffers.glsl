// Declares a storage buffer of T at a binding: one that the shader reads, writes, or does both to.
#define READS(i, T, name) \
    layout(std430, binding = i) readonly buffer Buffer##i { T name[]; };
#define WRITES(i, T, name) \
    layout(std430, binding = i) writeonly buffer Buffer##i { T name[]; };
#define UPDATES(i, T, name) \
    layout(std430, binding = i) buffer Buffer##i { T name[]; };
