#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "philox.glsl"
#include "functions.glsl"
#include "texture.glsl"
#include "each.glsl"

// The pool as it is drawn from (docs/model.md §11 "texture"): a texel has n at its four corners, of
// its own level and of the one above, 16 bits each, so that one fetch gives all that bilinear
// interpolation needs.

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { uint n_texels; } push;
// Real and imaginary parts.
layout(binding = 0) uniform samplerBuffer work;
layout(std430, binding = 1) writeonly buffer Pool { uvec4 pool[]; };

float field_at(uint part, uint level, uvec2 at) {
    uint log_side = 8u - level;
    uvec2 within = at & ((1u << log_side) - 1u);
    return texelFetch(work, int(part + 2u * (level_offset(level) + (within.y << log_side) + within.x))).r;
}

uint quanta(float low, float high) {
    ivec2 q = ivec2(round(clamp(QUANTA * vec2(low, high), -32767.0, 32767.0)));
    return uint(q.x & 0xFFFF) | (uint(q.y) << 16);
}

void main() {
    FOR_EACH(i, push.n_texels) {
        uint i_field = i / FIELD_TEXELS, rest = i % FIELD_TEXELS;
        // level_offset the other way round: 4^9 - 3 rest is above 4^(8 - l) and at most 4^(9 - l).
        uint level = 8u - uint(findMSB(262144u - 3u * rest - 1u)) / 2u;
        uint within = rest - level_offset(level), log_side = 8u - level;
        uvec2 at = uvec2(within & ((1u << log_side) - 1u), within >> log_side);
        uint part = 2u * (i_field / 2u) * FIELD_TEXELS + (i_field & 1u);
        vec4 own = vec4(
            field_at(part, level, at), field_at(part, level, at + uvec2(1, 0)),
            field_at(part, level, at + uvec2(0, 1)), field_at(part, level, at + uvec2(1, 1)));
        vec4 above = vec4(0.0);
        if (level < uint(LAST_LEVEL)) {
            // The texel lies in one quarter of the level above's: its corners are that one's,
            // middles of edges, the middle.
            uvec2 c = at >> 1;
            vec2 a = vec2(field_at(part, level + 1u, c), field_at(part, level + 1u, c + uvec2(1, 0)));
            vec2 b = vec2(field_at(part, level + 1u, c + uvec2(0, 1)), field_at(part, level + 1u, c + uvec2(1, 1)));
            vec4 share = 0.5 * vec4(at.x & 1u, (at.x & 1u) + 1u, at.y & 1u, (at.y & 1u) + 1u);
            vec2 near = a + share.z * (b - a), far = a + share.w * (b - a);
            above = vec4(mix(near.xx, near.yy, share.xy), mix(far.xx, far.yy, share.xy));
        }
        pool[i] = uvec4(quanta(own.x, own.y), quanta(own.z, own.w), quanta(above.x, above.y), quanta(above.z, above.w));
    }
}
