#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Keys of a Morton order, regions one after the other (docs/model.md §7, §11 "morton").

// 0: facets; 1: placed particles.
#ifndef POINTS
#define POINTS 0
#endif

layout(local_size_x = 64) in;

layout(push_constant) uniform Push { uint n_points; uint region_bits; uint axis_bits; } push;
#if POINTS == 0
layout(std430, binding = 0) readonly buffer Facets { Facet facets[]; };
layout(std430, binding = 1) readonly buffer Bounds { RegionBounds bounds[]; };
// (key, facet)
layout(std430, binding = 2) writeonly buffer Entries { uvec2 entries[]; };

vec3 position_of(uint i) { return facets[i].position; }
uint region_of(uint i) { return facets[i].i_region; }
#else
layout(std430, binding = 0) readonly buffer PlacedParticles { Placed placed[]; };
layout(std430, binding = 1) readonly buffer GroupOf { uint i_group[]; };
layout(std430, binding = 2) readonly buffer Groups { Group groups[]; };
layout(std430, binding = 3) readonly buffer Bounds { RegionBounds bounds[]; };
// (key, particle)
layout(std430, binding = 4) writeonly buffer Entries { uvec2 entries[]; };

vec3 position_of(uint i) { return placed[i].position; }
uint region_of(uint i) { return groups[i_group[i]].i_region; }
#endif

// What is no number goes to cell 0: told by its bits, since comparisons with it may be optimised
// away.
uint cell_of(float x) {
    bool is_number = (floatBitsToUint(x) & 0x7FFFFFFFu) <= 0x7F800000u;
    return is_number ? uint(clamp(x, 0.0, float((1u << push.axis_bits) - 1u))) : 0u;
}

// Two zeros before every bit of ten.
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
        uint code = spread(cell_of(x.x)) | (spread(cell_of(x.y)) << 1) | (spread(cell_of(x.z)) << 2);
        // One region has no bits, and a shift by 32 no result.
        uint high = push.region_bits > 0u ? region << (32u - push.region_bits) : 0u;
        entries[i] = uvec2(high | code, i);
    }
}
