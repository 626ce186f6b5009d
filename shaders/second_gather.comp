#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "light.glsl"
#include "occlude.glsl"
#include "functions.glsl"

// The second reflection, C (16), gathered fused: radiance at once, no tensor (docs/model.md §7, §11 "second"). A
// workgroup takes a block of receivers of one region, and goes through the regions that it can receive light from.

#ifndef WORKGROUP
#define WORKGROUP 8
#endif
// 1: the scene has clouds that attenuate.
#ifndef MARCH
#define MARCH 1
#endif
// 1: sources are the nodes of a tree, 0: facets.
#ifndef TREE
#define TREE 1
#endif
// 1: the receivers have a lobe.
#ifndef GLOSSY
#define GLOSSY 1
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
    float theta;
    uint n_surfaces;
    // 1 in the first of the dispatches that make up a gather, and in the last.
    uint begins;
    uint ends;
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
layout(std430, binding = 11) readonly buffer Nodes { Node nodes[]; };
layout(std430, binding = 12) buffer LitFacets { Lit lit[]; };
// By facet: the first source that is still to be looked at.
layout(std430, binding = 13) buffer Reached { uint reached[]; };

#include "lobe.glsl"
#if MARCH
#include "density.glsl"
#endif
#include "veil.glsl"
#include "reach.glsl"
#include "gather.glsl"
#include "cells.glsl"

uint nodes_of(uint i) {
#if TREE
    return nodes[i].n_nodes;
#else
    return 1u;
#endif
}

struct Sum {
    vec3 indirect;
    vec3 glossy;
    // Cells that stayed wider than asked for, and a bound on what they may change of L2's greatest channel.
    float n_unresolved;
    float unresolved;
};

// Adds what a cell sends along its way.
void take(inout Sum sum, View view, vec3 e, Taker taker) {
    sum.indirect += e;
#if GLOSSY
    sum.glossy += e * lobe_at(taker.region.i_lobe, view.taker_gap);
#endif
}

// The facets that were set aside, cell by cell: one step is one cell, so that neighbouring invocations need not wait for
// each other's facets.
void gather_cells(
    inout Sum sum, Pairing pairing, Region emitter, Taker taker, Veil veil, const bool veiled, Pane pane,
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
        // A part of a facet has light of its own.
        uint n_own = share > 0.0 && walk.level > 0u ? push.n_lights : 0u;
        vec3 leaving = n_own > 0u ? vec3(0.0) : view.leaving;
        for (uint l = 0u; l < n_own; ++l) {
            float g = cell_share(i, source, pairing.i_region, view.position, l);
            leaving += cell_flux(g, source, emitter, view.position, -view.way, l);
        }
        take(sum, view, leaving * share, taker);
        // Without cells to spend nobody looks for rims: what may have one stays open, too.
        bool blind = n_cells_left == 0u && share > 0.0 && walk.level < push.pair_levels && view.width > push.pair_size * RIM;
        sum.n_unresolved += (view.wide && !view.split) || blind ? 1.0 : 0.0;
        n_cells_left -= min(n_cells_left, 1u);
        walk = advance(walk, view.split, 1u);
    }
    n_cut += float(n_aside - walk.s);
}

// Adds what the sources of a pairing from `s` on send to the receiver, and moves `s`. A step is a facet or cluster as a
// whole; facets too wide for their distance, or with a shadow's rim on them, follow cell by cell.
void gather(inout Sum sum, Pairing pairing, Region emitter, Taker taker, Veil veil, const bool veiled, inout uint s, uint end) {
    Pane pane = pane_of(emitter);
    uint aside[MAX_ASIDE];
    while (s < end && n_sources_left > 0u) {
        uint n_aside = 0u;
        while (s < end && n_sources_left > 0u && n_aside < MAX_ASIDE) {
            uint i = pairing.i_source + s;
            uint n_nodes = nodes_of(i);
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
            take(sum, view, view.leaving * share, taker);
            sum.n_unresolved += view.wide && !view.split ? 1.0 : 0.0;
            aside[n_aside] = i;
            n_aside += is_facet && view.split ? 1u : 0u;
            s += view.split && !is_facet ? 1u : n_nodes;
            n_sources_left -= 1u;
        }
        gather_cells(sum, pairing, emitter, taker, veil, veiled, pane, aside, n_aside);
        // Without cells to spend the next facet would be looked at as a whole only: it waits for the next dispatch.
        n_sources_left = n_cells_left < CELLS / 4u ? 0u : n_sources_left;
    }
}

// The lobe's gap where it is nearest to its peak in a cell that turns the half vector by `turn`.
float nearest_gap(float gap, float turn) {
    float angle = max(sqrt(2.0 * gap) - turn, 0.0);
    return 0.5 * angle * angle;
}

// A bound on what the cells that stayed too wide may change (docs/model.md §11 "unresolved").
float audit(Pairing pairing, Region emitter, Taker taker, vec3 albedo, uint s, uint end) {
    Pane pane = pane_of(emitter);
    Walk walk = start_walk(s);
    float bound = 0.0;
    // Cells of its own.
    uint n_kept = n_cells_left;
    n_cells_left = CELLS;
    while (walk.s < end) {
        uint i = pairing.i_source + walk.s;
        Source source = sources[i];
        uint n_nodes = nodes_of(i);
        View view = look(source, i, n_nodes, walk, pane, emitter, taker);
        float scale = cell_scale(walk.level);
        float turn = TURN * view.width;
        // Nothing is nearer than the centre less half a diagonal, and no cell fills more than the hemisphere.
        float nearest = max(1.0 - 0.70710678 * view.width, 0.0) * pane.side * scale / max(view.width, 1e-30);
        float most = min(PI / source.area, scale * scale / max(nearest * nearest, 1e-30));
        // As if nothing shaded the cell: its facet's mean may be mostly shadow. Only surfaces' facets have cells.
        vec3 sent = vec3(0.0);
        for (uint l = 0u; l < push.n_lights; ++l) {
            Light light = lights[l];
            vec4 flux = fluxes[i * push.n_lights + l];
            float g = source.area * share_of(light, arrival_at(light, view.position), source.normal, flux.y);
            bool shines = emitter.i_lobe != NO_LOBE && light.kind != LIGHT_SKY && g > 0.0;
            float peak = shines ? lobe_at(emitter.i_lobe, nearest_gap(view.emitter_gap, turn)) : 0.0;
            sent += light.energy * g * (emitter.kd * PI_INVERSE + emitter.ks * peak);
        }
        vec3 received = albedo, taken = albedo;
#if GLOSSY
        received += taker.region.ks * lobe_at(taker.region.i_lobe, view.taker_gap);
        taken += taker.region.ks * lobe_at(taker.region.i_lobe, nearest_gap(view.taker_gap, turn));
#endif
        // Of geometry: all that it may be where the cell is wider than far, else the midpoint rule's error. Of lobes: their
        // greatest values in place of those met.
        vec3 met = max(abs(view.leaving), sent) * abs(received);
        vec3 geometry = met * (view.width > 1.0 ? most : view.share * view.width * view.width);
        vec3 lobes = max(sent * taken - met, vec3(0.0)) * (view.width > 1.0 ? most : view.share);
        vec3 e = geometry + lobes;
        bound += view.wide && !view.split ? max(e.x, max(e.y, e.z)) : 0.0;
        n_cells_left -= min(n_cells_left, view.split ? 1u : 0u);
        walk = advance(walk, view.split, n_nodes);
    }
    n_cells_left = n_kept;
    return bound;
}

void main() {
    Block block = blocks[push.i_first_block + gl_WorkGroupID.x];
    uint place = block.i_first + min(gl_LocalInvocationID.x, block.n_facets - 1u);
    uint j = order[place];
    Facet facet = facets[j];
    Region own = regions[facet.i_region];
    vec3 to_eye = push.eye - facet.position;
    Taker taker = Taker(facet.position, facet.normal, normalize(to_eye), own);
    vec3 albedo = own.kd * facet.color * PI_INVERSE;
    Sum sum = Sum(vec3(0.0), vec3(0.0), 0.0, 0.0);
    uint next = push.begins != 0u ? 0u : reached[j];
    uint last = 0u;
    for (uint k = 0u; k < block.n_pairings; ++k) {
        Pairing pairing = pairings[block.i_pairing + k];
        Region emitter = regions[pairing.i_region];
        last = pairing.i_source + pairing.n_sources;
        uint s = begin_of(pairing, next);
        uint n = n_sources_left > 0u ? pairing.n_sources : 0u;
        Veil veil = veil_of(pairing, emitter, facet.position);
        // Two loops and not a condition inside of one: a device that runs both sides of a condition then runs one.
        uint n_before = s;
        float n_open = sum.n_unresolved;
        gather(sum, pairing, emitter, taker, veil, false, s, veil.n == 0u ? n : 0u);
        gather(sum, pairing, emitter, taker, veil, true, s, veil.n > 0u && !veil.closed ? n : 0u);
        sum.unresolved += audit(pairing, emitter, taker, albedo, n_before, sum.n_unresolved > n_open ? s : 0u);
        s = veil.closed && n > 0u ? pairing.n_sources : s;
        next = n > 0u ? max(next, pairing.i_source + s) : next;
    }
    if (gl_LocalInvocationID.x < block.n_facets) {
        // The lobe is the front side's.
        float front = dot(to_eye, facet.normal) > 0.0 ? 1.0 : 0.0;
        Lit before = lit[j];
        bool begins = push.begins != 0u;
        lit[j].indirect = (begins ? vec3(0.0) : before.indirect) + sum.indirect;
        lit[j].second = (begins ? vec3(0.0) : before.second) + albedo * sum.indirect + front * own.ks * sum.glossy;
        lit[j].n_unresolved = (begins ? 0.0 : before.n_unresolved) + sum.n_unresolved;
        lit[j].unresolved = (begins ? 0.0 : before.unresolved) + sum.unresolved;
        lit[j].n_lost = (push.begins != 0u ? 0.0 : lit[j].n_lost) + n_cut + (push.ends != 0u ? float(last - min(next, last)) : 0.0);
        reached[j] = next;
    }
}
