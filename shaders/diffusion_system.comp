#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "diffusion.glsl"
#include "patches.glsl"

// Writes the equations of the finest cells (model.md §18, passes.md "diffusion").
// In: lights, the density grid, sources of "diffusion_sources". Out: operators, the right-hand
// sides, and phi after a sweep from phi = 0. Law: -div(D grad phi) + absorption phi = Q0 - div q,
// with Marshak's condition phi/4 + F/2 = J at the faces of the box, F inward. With SOLIDS J has the
// light of surfaces and ground, too. Error: some ulp.

// 1: the scene has surfaces or ground.
#ifndef SOLIDS
#define SOLIDS 0
#endif

layout(push_constant) uniform Push {
    Grid grid;
    vec3 absorbed;
    float inverse_chord;
    // 1 - albedo g
    vec3 kept;
    uint n_lights;
    uint n_all;
    float densest;
} push;
READS(0, Light, lights)
FLOATS(1, density)
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(2, field)
// [set][cell]
WRITES(3, vec4, operators)
WRITES(4, vec4, phi)
WRITES(5, vec4, source)
// By patch of the box: light of surfaces and ground, less that of the sky that they hide.
#if SOLIDS
READS(6, vec4, faces)
#endif

vec3 field_at(int k) { return uintBitsToFloat(TEXEL(field, k).rgb); }

#include "diffusivity.glsl"
#include "directions.glsl"
#include "sectors.glsl"
#include "faces.glsl"
#include "angle.glsl"
#include "sky.glsl"

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    Skies skies = all_skies();
    FOR_EACH(i, n_total(level)) {
        int c = int(i);
        ivec3 at = place_of(level, i), stride = strides_of(level);
        vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
        vec3 own = reach_of(c);
        vec3 sink = extinction_of(c) * push.absorbed, right = field_at(4 * c);
        vec3 prior_w = vec3(0.0);
        // w along each axis, by channel.
        vec3 next[3];
        [[unroll]] for (int axis = 0; axis < 3; ++axis) {
            float inverse = 1.0 / edges[axis];
            vec3 half_cell = 0.5 * edges[axis] / own;
            vec3 through = inverse / (2.0 + half_cell);
            vec3 carried = field_at(4 * c + 1 + axis);
            next[axis] = vec3(0.0);
            if (at[axis] + 1 < int(level.n_cells[axis])) {
                int after = c + stride[axis];
                vec3 other = reach_of(after);
                next[axis] = 2.0 * own * other / (own + other) * inverse * inverse;
                right -= inverse * at_face(carried, own, field_at(4 * after + 1 + axis), other);
            } else {
                sink += through;
                vec3 outward = vec3(0.0);
                outward[axis] = 1.0;
                vec3 j = sky_on(skies, outward) + of_solids(at, uint(axis), 1u);
                right += through * (4.0 * max(j, vec3(0.0)) - half_cell * carried);
            }
            if (at[axis] > 0) {
                int prior = c - stride[axis];
                vec3 other = reach_of(prior);
                prior_w += 2.0 * own * other / (own + other) * inverse * inverse;
                right += inverse * at_face(carried, own, field_at(4 * prior + 1 + axis), other);
            } else {
                sink += through;
                vec3 outward = vec3(0.0);
                outward[axis] = -1.0;
                vec3 j = sky_on(skies, outward) + of_solids(at, uint(axis), 0u);
                right += through * (4.0 * max(j, vec3(0.0)) + half_cell * carried);
            }
        }
        [[unroll]] for (int set = 0; set < N_SETS; ++set) {
            operators[c + set * int(push.n_all)] =
                vec4(next[0][set], next[1][set], next[2][set], sink[set]);
        }
        vec3 diagonal = next[0] + next[1] + next[2] + prior_w + sink;
        phi[c] = vec4(LONG_STEP * right / diagonal, 0.0);
        source[c] = vec4(right, 0.0);
    }
}
