#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "light.glsl"
#include "occlude.glsl"
#include "functions.glsl"
#include "tensor.glsl"

// T2 of one light: the second reflection by basis of the receiver and column of the emitters, without energies and
// materials (docs/model.md §7, §11 "contract"). Blocks, pairings and cells are those of second_gather.comp.

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
// N_b.
#ifndef N_BASES
#define N_BASES 8
#endif

// Sources, and cells of them, of one invocation in one dispatch.
#ifndef STEPS
#define STEPS 1024
#endif
#ifndef CELLS
#define CELLS 1024
#endif

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
    uint begins;
    uint ends;
    uint is_first_light;
} push;
layout(std430, binding = 0) readonly buffer Blocks { Block blocks[]; };
layout(std430, binding = 1) readonly buffer Pairings { Pairing pairings[]; };
layout(std430, binding = 2) readonly buffer Occluders { uint occluders[]; };
layout(std430, binding = 3) readonly buffer Order { uint order[]; };
layout(std430, binding = 4) readonly buffer Facets { Facet facets[]; };
layout(std430, binding = 5) readonly buffer Regions { Region regions[]; };
layout(std430, binding = 6) readonly buffer Lights { Light lights[]; };
layout(std430, binding = 7) readonly buffer Sources { Source sources[]; };
layout(std430, binding = 8) readonly buffer Fluxes { vec4 fluxes[]; };
layout(std430, binding = 9) readonly buffer Table { float table[]; };
layout(std430, binding = 10) readonly buffer Density { float density[]; };
layout(std430, binding = 11) buffer LitFacets { Lit lit[]; };
// As tensor.glsl has it.
layout(std430, binding = 12) buffer Second { float t2[]; };
layout(std430, binding = 13) buffer Reached { uint reached[]; };

#include "lobe.glsl"
#if MARCH
#include "density.glsl"
#endif
#include "veil.glsl"
#include "reach.glsl"
#include "gather.glsl"
#include "cells.glsl"

#if GLOSSY
const uint N_RESPONSES = N_BASES;
#else
const uint N_RESPONSES = 1u;
#endif
const uint N_VECTORS = N_BASES - 1u;

// Sums of one receiver and pairing, by basis of the receiver: of the emitter's diffuse basis (by channel where it has
// colours, else in x) and of its lobe's bases.
vec3 plain[N_RESPONSES];
#if N_BASES > 1
float shiny[N_RESPONSES * N_VECTORS];
#endif
float n_unresolved;

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

// Adds what a cell at q sends: `share` of `flux`, its source's as if all of it were as the cell is, toward the receiver's lobe at `gap`.
void add(vec4 flux, Region emitter, vec3 q, vec3 normal, vec3 outgoing, float share, float gap) {
    Light light = lights[push.i_light];
    float response[N_RESPONSES];
    response[0] = share * PI_INVERSE;
#if GLOSSY && N_BASES > 1
    Knot knot = knot_at(gap);
    [[unroll]] for (uint b = 0u; b < N_VECTORS; ++b) {
        response[b + 1u] = share * value_at(push.i_vectors + b, knot);
    }
#endif
    vec3 diffuse = PI_INVERSE * (emitter.kind == REGION_COLORED ? flux.rgb : vec3(flux.w, 0.0, 0.0));
    [[unroll]] for (uint r = 0u; r < N_RESPONSES; ++r) {
        plain[r] += response[r] * diffuse;
    }
#if N_BASES > 1
    uint n_shiny = emitter.i_lobe != NO_LOBE && light.kind != LIGHT_SKY ? 1u : 0u;
    for (uint k = 0u; k < n_shiny; ++k) {
        Knot from = knot_at(half_vector_gap(normal, arrival_at(light, q).toward, outgoing));
        [[unroll]] for (uint b = 0u; b < N_VECTORS; ++b) {
            float e = flux.w * value_at(push.i_vectors + b, from);
            [[unroll]] for (uint r = 0u; r < N_RESPONSES; ++r) {
                shiny[b * N_RESPONSES + r] += response[r] * e;
            }
        }
    }
#endif
}

// As second_gather.comp has it.
// The facets that were set aside, cell by cell: one step is one cell, so that neighbouring invocations need not wait for
// each other's facets.
void gather_cells(
    Pairing pairing, Region emitter, Taker taker, Veil veil, const bool veiled, Pane pane,
    uint aside[MAX_ASIDE], uint n_aside) {
    Walk walk = start_walk(0u);
    while (walk.s < n_aside) {
        uint i = aside[walk.s];
        Source source = sources[i];
        View view = look(source, i, 1u, walk, pane, emitter, taker);
        float share = view.split ? 0.0 : view.share;
        float radius = torn_radius(source, walk, view, 1u);
        if (veiled) {
            bvec2 veiling = veils_ball(pairing, veil, taker.position, view.position, radius, share > 0.0);
            view.split = view.split || (radius > 0.0 && veiling.y);
            share = view.split || veiling.x ? 0.0 : share;
        }
        view.split = view.split || is_lit_in_part(i, pairing.i_region, view.position, radius, share > 0.0 && source.in_part > 0.0);
        share = view.split ? 0.0 : share;
#if MARCH
        share *= attenuation(taker.position, view.position, share > 0.0);
#endif
        // A loop and not a condition: a device that runs both sides of a condition then leaves it out.
        uint n_arriving = share > 0.0 ? 1u : 0u;
        for (uint k = 0u; k < n_arriving; ++k) {
            vec4 flux = fluxes[i * push.n_lights + push.i_light];
            // A part of a facet has light of its own.
            flux.w = walk.level > 0u ? cell_share(i, source, pairing.i_region, view.position, push.i_light) : flux.w;
            add(flux, emitter, view.position, source.normal, -view.way, share, view.taker_gap);
        }
        n_unresolved += view.wide && !view.split ? 1.0 : 0.0;
        n_cells_left -= min(n_cells_left, 1u);
        walk = advance(walk, view.split, 1u);
    }
    n_cut += float(n_aside - walk.s);
}

// Adds what the sources of a pairing from `s` on send to the receiver, and moves `s`. A step is a facet or cluster as a
// whole; facets too wide for their distance, or with a shadow's rim on them, follow cell by cell.
void gather(Pairing pairing, Region emitter, Taker taker, Veil veil, const bool veiled, inout uint s, uint end) {
    Pane pane = pane_of(emitter);
    uint aside[MAX_ASIDE];
    while (s < end && n_sources_left > 0u) {
        uint n_aside = 0u;
        while (s < end && n_sources_left > 0u && n_aside < MAX_ASIDE) {
            uint i = pairing.i_source + s;
            uint n_nodes = 1u;
            Source source = sources[i];
            Walk walk = start_walk(s);
            View view = look(source, i, n_nodes, walk, pane, emitter, taker);
            float share = view.split ? 0.0 : view.share;
            float radius = torn_radius(source, walk, view, n_nodes);
            if (veiled) {
                bvec2 veiling = veils_ball(pairing, veil, taker.position, view.position, radius, share > 0.0);
                view.split = view.split || (radius > 0.0 && veiling.y);
                share = view.split || veiling.x ? 0.0 : share;
            }
            bool is_facet = n_nodes == 1u;
            view.split = view.split || (is_facet && source.in_part > 0.0 && radius > 0.0 && share > 0.0);
            share = view.split ? 0.0 : share;
#if MARCH
            share *= attenuation(taker.position, view.position, share > 0.0);
#endif
            uint n_arriving = share > 0.0 ? 1u : 0u;
            for (uint k = 0u; k < n_arriving; ++k) {
                vec4 flux = fluxes[i * push.n_lights + push.i_light];
                add(flux, emitter, view.position, source.normal, -view.way, share, view.taker_gap);
            }
            n_unresolved += view.wide && !view.split ? 1.0 : 0.0;
            aside[n_aside] = i;
            n_aside += is_facet && view.split ? 1u : 0u;
            s += view.split && !is_facet ? 1u : n_nodes;
            n_sources_left -= 1u;
        }
        gather_cells(pairing, emitter, taker, veil, veiled, pane, aside, n_aside);
        // Without cells to spend the next facet would be looked at as a whole only: it waits for the next dispatch.
        n_sources_left = n_cells_left < CELLS / 4u ? 0u : n_sources_left;
    }
}

// The sums of receiver j as columns of its rows.
void store(uint j, Region own, Region emitter) {
    // Later dispatches add to what the first has left.
    float keep = push.begins != 0u ? 0.0 : 1.0;
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
    Facet facet = facets[j];
    Region own = regions[facet.i_region];
    Taker taker = Taker(facet.position, facet.normal, normalize(push.eye - facet.position), own);
    n_unresolved = 0.0;
    uint next = push.begins != 0u ? 0u : reached[j];
    uint last = 0u;
    for (uint k = 0u; k < block.n_pairings; ++k) {
        Pairing pairing = pairings[block.i_pairing + k];
        Region emitter = regions[pairing.i_region];
        last = pairing.i_source + pairing.n_sources;
        uint s = begin_of(pairing, next);
        uint n = n_sources_left > 0u ? pairing.n_sources : 0u;
        Veil veil = veil_of(pairing, emitter, facet.position);
        clear();
        gather(pairing, emitter, taker, veil, false, s, veil.n == 0u ? n : 0u);
        gather(pairing, emitter, taker, veil, true, s, veil.n > 0u && !veil.closed ? n : 0u);
        s = veil.closed && n > 0u ? pairing.n_sources : s;
        next = n > 0u ? max(next, pairing.i_source + s) : next;
        if (gl_LocalInvocationID.x < block.n_facets) {
            store(j, own, emitter);
        }
    }
    if (gl_LocalInvocationID.x < block.n_facets) {
        // Pairs are the same for every light.
        if (push.is_first_light != 0u) {
            lit[j].n_unresolved = (push.begins != 0u ? 0.0 : lit[j].n_unresolved) + n_unresolved;
        }
        lit[j].n_lost = (push.begins != 0u ? 0.0 : lit[j].n_lost) + n_cut + (push.ends != 0u ? float(last - min(next, last)) : 0.0);
        reached[j] = next;
    }
}
