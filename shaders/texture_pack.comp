#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "philox.glsl"
#include "functions.glsl"
#include "texture.glsl"
#include "each.glsl"

// Packs the fields into the pool that splats read (passes.md "texture").
// In: the fields' values. Out: texels with n at their four corners, of their own level and of the
// next, 16 bits each, so that one fetch serves bilinear interpolation. Error: half a quantum,
// 2^-13.

layout(push_constant) uniform Push { uint n_texels; } push;
// Real and imaginary parts.
FLOATS(0, work)
WRITES(1, uvec4, pool)

float field_at(uint part, uint level, uvec2 at) {
    uint log_side = 8u - level;
    uvec2 within = at & ((1u << log_side) - 1u);
    uint i = part + 2u * (level_offset(level) + (within.y << log_side) + within.x);
    return FLOAT(work, int(i));
}

// Returns the field at the texel's four corners.
vec4 corners_at(uint part, uint level, uvec2 at) {
    return vec4(
        field_at(part, level, at), field_at(part, level, at + uvec2(1, 0)),
        field_at(part, level, at + uvec2(0, 1)), field_at(part, level, at + uvec2(1, 1))
    );
}

uint quanta(float low, float high) {
    ivec2 q = ivec2(round(clamp(QUANTA * vec2(low, high), -32767.0, 32767.0)));
    return uint(q.x & 0xFFFF) | (uint(q.y) << 16);
}

void main() {
    FOR_EACH(i, push.n_texels) {
        uint i_field = i / FIELD_TEXELS, rest = i % FIELD_TEXELS;
        // The inverse of level_offset(): 4^9 - 3 rest is above 4^(8 - l) and at most 4^(9 - l).
        uint level = 8u - uint(findMSB(262144u - 3u * rest - 1u)) / 2u;
        uint within = rest - level_offset(level), log_side = 8u - level;
        uvec2 at = uvec2(within & ((1u << log_side) - 1u), within >> log_side);
        uint part = 2u * (i_field / 2u) * FIELD_TEXELS + (i_field & 1u);
        vec4 own = corners_at(part, level, at);
        vec4 above = vec4(0.0);
        if (level < uint(LAST_LEVEL)) {
            // The texel lies in one quarter of a texel of the next level. Its corners are that
            // one's corner, the middles of two edges, and the middle.
            vec4 of = corners_at(part, level + 1u, at >> 1);
            vec4 share = 0.5 * vec4(at.x & 1u, (at.x & 1u) + 1u, at.y & 1u, (at.y & 1u) + 1u);
            vec2 near = of.xy + share.z * (of.zw - of.xy), far = of.xy + share.w * (of.zw - of.xy);
            above = vec4(mix(near.xx, near.yy, share.xy), mix(far.xx, far.yy, share.xy));
        }
        pool[i] = uvec4(
            quanta(own.x, own.y), quanta(own.z, own.w), quanta(above.x, above.y),
            quanta(above.z, above.w)
        );
    }
}
