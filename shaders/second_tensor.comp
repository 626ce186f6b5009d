#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "records.glsl"
#include "light.glsl"
#include "occlude.glsl"
#include "functions.glsl"
#include "stencil.glsl"
#include "tensor.glsl"

// T2 of one light: the second reflection by basis of the receiver and column of the emitters,
// without energies and materials (docs/model.md §7, §11 "contract"). Blocks, pairings and cells are
// those of second_gather.comp.

#ifndef WORKGROUP
#define WORKGROUP 8
#endif
// 1: the scene has clouds that attenuate.
#ifndef MARCH
#define MARCH 1
#endif
// 1: the receivers have a lobe.
#ifndef GLOSSY
#define GLOSSY 1
#endif
// 1: some region has a lobe.
#define SHINY 1
// N_b.
#ifndef N_BASES
#define N_BASES 8
#endif

#include "turns.glsl"
layout(local_size_x = WORKGROUP) in;

layout(push_constant) uniform Push {
    Grid grid;
    vec3 eye;
    uint n_lights;
    float pair_size;
    uint pair_levels;
    float step_length;
    float backward;
    uint pair_steps;
    uint i_first_block;
    uint i_light;
    uint i_vectors;
    uint n_rows;
    uint n_columns;
    uint n_surfaces;
    // As second_gather.comp has them; and 1 for the first light that has energy.
    uint i_round;
    uint n_rounds;
    uint is_first_light;
} push;
layout(std430, binding = 0) readonly buffer Blocks { Block blocks[]; };
layout(std430, binding = 1) readonly buffer Pairings { Pairing pairings[]; };
layout(std430, binding = 2) readonly buffer Occluders { uint occluders[]; };
layout(std430, binding = 3) readonly buffer Order { uint order[]; };
layout(std430, binding = 4) readonly buffer Facets { Facet facets[]; };
layout(binding = 5) uniform usamplerBuffer regions;
#include "regions.glsl"
layout(std430, binding = 6) readonly buffer Lights { Light lights[]; };
layout(binding = 7) uniform usamplerBuffer sources;
layout(binding = 8) uniform usamplerBuffer fluxes;
layout(binding = 9) uniform samplerBuffer table;
layout(binding = 10) uniform samplerBuffer density;
layout(std430, binding = 11) buffer LitFacets { Lit lit[]; };
// As tensor.glsl has it.
layout(std430, binding = 12) buffer Second { float t2[]; };
layout(std430, binding = 13) buffer Reached { uint reached[]; };
// As second_sources.comp leaves them.
layout(binding = 14) uniform usamplerBuffer stencils;
// Workgroups of each round, three numbers a round: those of the next are counted where a receiver
// is not done.
layout(std430, binding = 15) buffer Rounds { uint rounds[]; };

#include "lobe.glsl"
#if MARCH
#include "density.glsl"
#endif
#include "veil.glsl"
#include "reach.glsl"
#include "arriving.glsl"
#include "gather.glsl"
#include "cells.glsl"

#if GLOSSY
const uint N_RESPONSES = N_BASES;
#else
const uint N_RESPONSES = 1u;
#endif
const uint N_VECTORS = N_BASES - 1u;

// Sums of one receiver and pairing, by basis of the receiver: of the emitter's diffuse basis (by
// channel where it has colours, else in x) and of its lobe's bases.
vec3 plain[N_RESPONSES];
#if N_BASES > 1
float shiny[N_RESPONSES * N_VECTORS];
#endif
float n_unresolved;
// The lobe is the front side's: 0 where the eye is behind the receiver.
float front;

void clear() {
    [[unroll]] for (uint r = 0u; r < N_RESPONSES; ++r) {
        plain[r] = vec3(0.0);
    }
#if N_BASES > 1
    [[unroll]] for (uint k = 0u; k < N_RESPONSES * N_VECTORS; ++k) {
        shiny[k] = 0.0;
    }
#endif
}

// Adds what comes along a way: `share` of the light's energy that a source or cell is lit with, by
// channel where it has colours.
void add(vec4 share, vec3 normal, vec3 position, vec3 way, float taker_gap, Region emitter) {
    Light light = LIGHT(push.i_light);
    float response[N_RESPONSES];
    response[0] = PI_INVERSE;
#if GLOSSY && N_BASES > 1
    Knot knot = knot_at(taker_gap);
    [[unroll]] for (uint b = 0u; b < N_VECTORS; ++b) {
        response[b + 1u] = front * value_at(push.i_vectors + b, knot);
    }
#endif
    vec3 diffuse = PI_INVERSE * (emitter.kind == REGION_COLORED ? share.rgb : vec3(share.w, 0.0, 0.0));
    [[unroll]] for (uint r = 0u; r < N_RESPONSES; ++r) {
        plain[r] += response[r] * diffuse;
    }
#if N_BASES > 1
    uint n_shiny = emitter.i_lobe != NO_LOBE && light.kind != LIGHT_SKY ? 1u : 0u;
    for (uint k = 0u; k < n_shiny; ++k) {
        Knot from = knot_at(half_vector_gap(normal, arrival_at(light, position).toward, -way));
        [[unroll]] for (uint b = 0u; b < N_VECTORS; ++b) {
            float e = share.w * value_at(push.i_vectors + b, from);
            [[unroll]] for (uint r = 0u; r < N_RESPONSES; ++r) {
                shiny[b * N_RESPONSES + r] += response[r] * e;
            }
        }
    }
#endif
}

void take_whole(uint i, Sender source, View view, Region emitter, Taker taker, float share) {
    // A loop and not a condition: a device that runs both sides of a condition then leaves it out.
    for (uint k = 0u; k < (share > 0.0 ? 1u : 0u); ++k) {
        add(share * flux_at(i, push.i_light), source.normal, view.position, view.way, view.taker_gap, emitter);
    }
}

void take_cell(
    uint i, Sender source, View view, Region emitter, Taker taker, Stencil seen, Walk walk, Cell cell, float part, uint i_own,
    const bool own) {
    vec4 g = part * arriving_by(i, source, walk, cell, seen, i_own, own, push.i_light);
    // Lobes are met in each quarter.
    bool alike = N_BASES == 1 || (!bool(GLOSSY) && emitter.i_lobe == NO_LOBE);
    g.x = alike ? dot(g, vec4(1.0)) : g.x;
    for (uint q = 0u; q < (part > 0.0 ? (alike ? 1u : 4u) : 0u); ++q) {
        vec3 p = quarter_at(cell, q);
        vec3 way = unit(p - taker.position);
        // Only surfaces' facets have cells, and these no colours of their own.
        add(vec4(0.0, 0.0, 0.0, g[q]), source.normal, p, way, half_vector_gap(taker.normal, way, taker.outgoing), emitter);
        n_turns += 1u;
    }
}

void take_doubt(uint i, Sender source, View view, Region emitter, Taker taker, float area) {
    n_unresolved += 1.0;
}

#include "walk.glsl"

// The sums of receiver j as columns of its rows.
void store(uint j, Region own, Region emitter) {
    // Later dispatches add to what the first has left.
    float keep = push.i_round == 0u ? 0.0 : 1.0;
    uint n_plain = emitter.kind == REGION_COLORED ? 3u : 1u;
    uint n_vectors = emitter.i_lobe == NO_LOBE ? 0u : N_VECTORS;
    [[unroll]] for (uint r = 0u; r < N_RESPONSES; ++r) {
        uint row = own.i_row + r * own.n_facets + j - own.i_first_facet;
        uint k = second_at(push.i_light, row, push.n_rows, push.n_columns) + emitter.i_column * TILE;
        t2[k] = (keep > 0.0 ? t2[k] : 0.0) + plain[r].x;
        if (n_plain == 3u) {
            t2[k + TILE] = (keep > 0.0 ? t2[k + TILE] : 0.0) + plain[r].y;
            t2[k + 2u * TILE] = (keep > 0.0 ? t2[k + 2u * TILE] : 0.0) + plain[r].z;
        }
#if N_BASES > 1
        [[unroll]] for (uint b = 0u; b < N_VECTORS; ++b) {
            if (b < n_vectors) {
                t2[k + (n_plain + b) * TILE] = (keep > 0.0 ? t2[k + (n_plain + b) * TILE] : 0.0) + shiny[b * N_RESPONSES + r];
            }
        }
#endif
    }
}

void main() {
    Block block = blocks[push.i_first_block + gl_WorkGroupID.x];
    uint place = block.i_first + min(gl_LocalInvocationID.x, block.n_facets - 1u);
    uint j = order[place];
    uint next = push.i_round == 0u ? 0u : reached[j];
    if (next == DONE) {
        return;
    }
    KEEP_LIGHTS
    Facet facet = facets[j];
    Region own = region_at(facet.i_region);
    Taker taker = Taker(facet.position, facet.normal, normalize(push.eye - facet.position), vec3(0.0), own);
    n_unresolved = 0.0;
    front = dot(taker.outgoing, taker.normal) > 0.0 ? 1.0 : 0.0;
    uint last = 0u;
    for (uint k = 0u; k < block.n_pairings; ++k) {
        Pairing pairing = pairings[block.i_pairing + k];
        last = pairing.i_source + pairing.n_sources;
        bool open = n_turns < BATCH_TURNS && n_torn < MAX_TORN && next < last;
        Region emitter = region_at(pairing.i_region);
        uint s = begin_of(pairing, next);
        uint n = open ? pairing.n_sources : 0u;
        Veil veil = veil_of(pairing, emitter, facet.position, open);
        clear();
        gather(block.i_pairing + k, pairing, emitter, taker, veil, s, veil.closed ? 0u : n);
        // Its sums are this pairing's.
        gather_torn(taker);
        s = veil.closed && open ? pairing.n_sources : s;
        next = open ? pairing.i_source + s : next;
        n_turns += 4u;
        if (gl_LocalInvocationID.x < block.n_facets) {
            store(j, own, emitter);
        }
    }
    if (gl_LocalInvocationID.x < block.n_facets) {
        bool begins = push.i_round == 0u;
        float n_lost = n_cut + (push.i_round + 1u == push.n_rounds ? float(last - min(next, last)) : 0.0);
        // Pairs are the same for every light.
        if (push.is_first_light != 0u) {
            lit[j].n_unresolved = (begins ? 0.0 : lit[j].n_unresolved) + n_unresolved;
        }
        bool fresh = begins && push.is_first_light != 0u;
        n_lost += fresh ? 0.0 : lit[j].n_lost;
        lit[j].n_lost = n_lost;
        // What may be wrong hangs on materials and energies that tensors do not know: there is no
        // bound.
        lit[j].unresolved = n_lost > 0.0 || lit[j].n_unresolved > 0.0 ? uintBitsToFloat(0x7f800000u) : 0.0;
        reached[j] = next >= last ? DONE : next;
        if (next < last) {
            atomicMax(rounds[3u * (push.i_round + 1u)], gl_NumWorkGroups.x);
        }
    }
}
