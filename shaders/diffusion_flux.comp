#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "each.glsl"
#include "diffusion.glsl"
#include "second_order.glsl"
#include "medium.glsl"

// Writes fluence and flux of the diffuse light (model.md §18, passes.md "diffusion").
// In: the density grid, phi. In, out: by cell Q0 and q, then phi and F = q - D grad phi; what
// stands beside Q0 stays. The slope is that between the cells on both sides. At the faces of the
// box it is one-sided. With FACES F is the mean of what flows through the two faces along an axis;
// those on the box do not count. With BOUNCES also what each cell sends out in each direction,
// beside its extinction. With CHANGE phi and F, of the change by a bounce, are added to those of
// the bounce.

// 1: F is the mean of what flows through the faces of a cell.
#ifndef FACES
#define FACES 0
#endif

// 1: bounces follow.
#ifndef BOUNCES
#define BOUNCES 0
#endif

layout(push_constant) uniform Push {
    Grid grid;
    // 1 - albedo g
    vec3 kept;
    float inverse_chord;
    // albedo', and 3 albedo' g'
    vec3 even;
    float densest;
    vec3 forward;
    // g'
    float g;
} push;
FLOATS(0, density)
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(1, phi)
UPDATES(2, vec4, field)
#if FACES
// Q0 and q, also of a change.
TEXELS(3, carried)
#endif
#if BOUNCES
TEXELS(4, arrived)
// [direction][cell]
TEXEL_STORES(5, sent)
#if CHANGE && SECOND
TEXELS(6, of_second)
#endif
#endif

vec3 phi_at(int c) { return uintBitsToFloat(TEXEL(phi, c).rgb); }

#include "diffusivity.glsl"

#if FACES
vec3 carried_at(int c, int axis) { return uintBitsToFloat(TEXEL(carried, 4 * c + 1 + axis).rgb); }

// Returns what flows along an axis from cell c to the next one, `edge` away.
vec3 flow(int c, int next, int axis, float edge) {
    vec3 own = reach_of(c), other = reach_of(next);
    vec3 q = carried_at(c, axis), next_q = carried_at(next, axis);
    vec3 slope = (phi_at(next) - phi_at(c)) / edge;
    return at_face(q, own, next_q, other) - 2.0 * own * other / (own + other) * slope;
}
#endif

#if BOUNCES
#include "directions.glsl"
#include "of_suns.glsl"

// The lobe of suns and lamps over the directions of bounces: its mean is 1, and its mean times the
// direction g' times the way, unless it would be below 0.
struct Lobe {
    // 1 over the mean of the plain lobe.
    float factor;
    // Times the direction, it makes up for the rest of the mean times the direction.
    vec3 slope;
};

Lobe lobe_of(OfSuns suns) {
    float mean = 0.0;
    vec3 along = vec3(0.0);
    for (uint k = 0; k < N_DIRECTIONS; ++k) {
        float l = lobe(suns, push.g, direction(k));
        mean += l / float(N_DIRECTIONS);
        along += l / float(N_DIRECTIONS) * direction(k);
    }
    vec3 slope = 3.0 * (push.g * suns.way - along / mean);
    // The share of the slope with which all directions stay at or above 0.
    float share = 1.0;
    for (uint k = 0; k < N_DIRECTIONS; ++k) {
        vec3 w = direction(k);
        float fall = -dot(slope, w), l = lobe(suns, push.g, w) / mean;
        share = fall > l ? min(share, l / fall) : share;
    }
    return Lobe(1.0 / mean, share * slope);
}
#endif

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    FOR_EACH(i, n_total(level)) {
        int c = int(i);
        ivec3 at = place_of(level, i), stride = strides_of(level);
        vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
        vec3 fluence = phi_at(c);
#if CHANGE
        fluence += field[4 * c].rgb;
#endif
        field[4 * c].rgb = fluence;
#if BOUNCES
        vec3 even = push.even * fluence, forward[3];
#endif
        for (int axis = 0; axis < 3; ++axis) {
            int after = at[axis] + 1 < int(level.n_cells[axis]) ? c + stride[axis] : c;
            int prior = at[axis] > 0 ? c - stride[axis] : c;
            int n_steps = (after - prior) / stride[axis];
            int k = 4 * c + 1 + axis;
#if FACES
            vec3 flux = n_steps > 0 ? vec3(0.0) : carried_at(c, axis);
            if (after > c) {
                flux += flow(c, after, axis, edges[axis]) / float(n_steps);
            }
            if (prior < c) {
                flux += flow(prior, c, axis, edges[axis]) / float(n_steps);
            }
#else
            vec3 rise = phi_at(after) - phi_at(prior);
            vec3 slope = n_steps > 0 ? rise / (float(n_steps) * edges[axis]) : vec3(0.0);
            vec3 flux = field[k].rgb - reach_of(c) * slope;
#endif
#if CHANGE
            flux += field[k].rgb;
#endif
            field[k].rgb = flux;
#if BOUNCES
            forward[axis] = push.forward * flux;
#endif
        }
#if BOUNCES
#if CHANGE && SECOND
        vec3 second[N_SECOND];
        [[unroll]] for (int m = 0; m < N_SECOND; ++m) {
            second[m] = uintBitsToFloat(TEXEL(of_second, N_SECOND * c + m).rgb);
        }
#endif
        OfSuns suns = of_suns(c);
        Lobe of = lobe_of(suns);
        for (uint k = 0; k < N_DIRECTIONS; ++k) {
            vec3 w = direction(k);
            vec3 all = even + w.x * forward[0] + w.y * forward[1] + w.z * forward[2];
#if CHANGE && SECOND
            float y[N_SECOND] = second_order(w);
            [[unroll]] for (int m = 0; m < N_SECOND; ++m) { all += y[m] * second[m]; }
#endif
            float once = of.factor * lobe(suns, push.g, w) + dot(of.slope, w);
            all += suns.all * mix(1.0, once, suns.directed);
            uvec4 words = floatBitsToUint(vec4(all, extinction_of(c)));
            STORE_TEXEL(sent, int(k * n_total(level) + i), words);
        }
#endif
    }
}
