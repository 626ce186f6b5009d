#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "each.glsl"

// Computes keys of a Morton order, region after region (model.md §7, passes.md
// "morton"). In: facets or placed particles, and their regions' bounds. Out: entries (key, index);
// the region's number is in the highest bits. NaN goes to cell 0.

// 0: facets; 1: placed particles.
#ifndef POINTS
#define POINTS 0
#endif

layout(push_constant) uniform Push {
    uint n_points;
    uint region_bits;
    uint axis_bits;
} push;
#if POINTS == 0
READS(0, Facet, facets)
READS(1, RegionBounds, bounds)
// (key, facet)
WRITES(2, uvec2, entries)

vec3 position_of(uint i) { return facets[i].position; }
uint region_of(uint i) { return facets[i].i_region; }
#else
TEXELS(0, placed)
READS(1, uint, i_group)
READS(2, Group, groups)
READS(3, RegionBounds, bounds)
// (key, particle)
WRITES(4, uvec2, entries)

vec3 position_of(uint i) { return PLACED_AT(i).position; }
uint region_of(uint i) { return groups[i_group[i]].i_region; }
#endif

// NaN goes to cell 0. Its bits are tested, since comparisons with it may be optimised away.
uint cell_of(float x) {
    bool is_number = (floatBitsToUint(x) & 0x7FFFFFFFu) <= 0x7F800000u;
    return is_number ? uint(clamp(x, 0.0, float((1u << push.axis_bits) - 1u))) : 0u;
}

// Puts two zeros before every bit of ten.
uint spread(uint v) {
    v = (v | (v << 16)) & 0x030000FFu;
    v = (v | (v << 8)) & 0x0300F00Fu;
    v = (v | (v << 4)) & 0x030C30C3u;
    return (v | (v << 2)) & 0x09249249u;
}

void main() {
    FOR_EACH(i, push.n_points) {
        uint region = region_of(i);
        vec3 x = (position_of(i) - bounds[region].low) * bounds[region].scale;
        uint code =
            spread(cell_of(x.x)) | (spread(cell_of(x.y)) << 1) | (spread(cell_of(x.z)) << 2);
        // One region has no bits, and a shift by 32 has no result.
        uint high = push.region_bits > 0u ? region << (32u - push.region_bits) : 0u;
        entries[i] = uvec2(high | code, i);
    }
}
