#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "light.glsl"
#include "occlude.glsl"

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
    uint adds;
    uint rim_cells;
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
    // Steps of the walks.
    uint n_cells;
};

// Of the ball about a cluster or cell that is opened where the rim of a shadow runs through it; 0 where it is small enough.
float torn_radius(Source source, Walk walk, View view, uint n_nodes, uint n_cells) {
#if TREE
    if (n_nodes > 1u) {
        return view.width > push.theta * TORN ? source.radius : 0.0;
    }
#endif
    bool wide = n_cells < push.rim_cells && view.width > push.pair_size * RIM && walk.level < push.pair_levels && walk.n_steps < MAX_STEPS;
    return wide ? source.radius * cell_scale(walk.level) : 0.0;
}

// Adds what the first `n` sources of a pairing send to the receiver. One step is one cell: a whole facet, or a quarter of
// a cell that was too wide for its distance, so that neighbouring invocations need not wait for each other's near facets.
void gather(inout Sum sum, Pairing pairing, Region emitter, Taker taker, Veil veil, const bool veiled, uint n) {
    Pane pane = pane_of(emitter);
    Walk walk = start_walk();
    while (walk.s < n) {
        uint i = pairing.i_source + walk.s;
        uint n_nodes = nodes_of(i);
        View view = look(sources[i], i, n_nodes, walk, pane, emitter, taker);
        float share = view.split ? 0.0 : view.share;
        if (veiled) {
            float radius = torn_radius(sources[i], walk, view, n_nodes, sum.n_cells);
            bvec2 veiling = veils_ball(pairing, veil, taker.position, view.position, radius, share > 0.0);
            view.split = view.split || (radius > 0.0 && veiling.y);
            share = view.split || veiling.x ? 0.0 : share;
        }
        float lit_radius = n_nodes == 1u && emitter.kind == REGION_SURFACE ? torn_radius(sources[i], walk, view, n_nodes, sum.n_cells) : 0.0;
        bool in_part = is_lit_in_part(i, pairing.i_region, view.position, lit_radius, share > 0.0 && lit_radius > 0.0);
        view.split = view.split || in_part;
        share = view.split ? 0.0 : share;
#if MARCH
        share *= attenuation(taker.position, view.position, share > 0.0);
#endif
        uint n_own = share > 0.0 && walk.level > 0u ? push.n_lights : 0u;
        vec3 leaving = n_own > 0u ? vec3(0.0) : view.leaving;
        for (uint l = 0u; l < n_own; ++l) {
            leaving += cell_flux(i, sources[i], pairing.i_region, emitter, view.position, -view.way, l);
        }
        vec3 e = leaving * share;
        sum.indirect += e;
#if GLOSSY
        sum.glossy += e * lobe_at(taker.region.i_lobe, view.taker_gap);
#endif
        sum.n_unresolved += view.wide && !view.split ? 1.0 : 0.0;
        sum.n_cells += 1u;
        walk = advance(walk, view.split, n_nodes);
    }
}

// The lobe's gap where it is nearest to its peak in a cell that turns the half vector by `turn`.
float nearest_gap(float gap, float turn) {
    float angle = max(sqrt(2.0 * gap) - turn, 0.0);
    return 0.5 * angle * angle;
}

// A bound on what the cells that stayed too wide may change (docs/model.md §11 "unresolved").
float audit(Pairing pairing, Region emitter, Taker taker, vec3 albedo, uint n) {
    Pane pane = pane_of(emitter);
    Walk walk = start_walk();
    float bound = 0.0;
    while (walk.s < n) {
        uint i = pairing.i_source + walk.s;
        Source source = sources[i];
        uint n_nodes = nodes_of(i);
        View view = look(source, i, n_nodes, walk, pane, emitter, taker);
        float scale = cell_scale(walk.level);
        float turn = TURN * view.width;
        // Nothing is nearer than the centre less half a diagonal, and no cell fills more than the hemisphere.
        float nearest = max(1.0 - 0.70710678 * view.width, 0.0) * pane.side * scale / max(view.width, 1e-30);
        float most = min(PI / source.area, scale * scale / max(nearest * nearest, 1e-30));
        vec3 sent = source.flux;
        for (uint l = 0u; l < push.n_lights; ++l) {
            float g = lights[l].kind == LIGHT_SKY || emitter.i_lobe == NO_LOBE ? 0.0 : fluxes[i * push.n_lights + l].w;
            float peak = g > 0.0 ? lobe_at(emitter.i_lobe, nearest_gap(view.emitter_gap, turn)) : 0.0;
            sent += emitter.ks * lights[l].energy * (g * peak);
        }
        vec3 received = albedo, taken = albedo;
#if GLOSSY
        received += taker.region.ks * lobe_at(taker.region.i_lobe, view.taker_gap);
        taken += taker.region.ks * lobe_at(taker.region.i_lobe, nearest_gap(view.taker_gap, turn));
#endif
        // Of geometry: all that it may be where the cell is wider than far, else the midpoint rule's error. Of lobes: their
        // greatest values in place of those met.
        vec3 met = abs(view.leaving * received);
        vec3 geometry = met * (view.width > 1.0 ? most : view.share * view.width * view.width);
        vec3 lobes = max(sent * taken - met, vec3(0.0)) * (view.width > 1.0 ? most : view.share);
        vec3 e = geometry + lobes;
        bound += view.wide && !view.split ? max(e.x, max(e.y, e.z)) : 0.0;
        walk = advance(walk, view.split, n_nodes);
    }
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
    Sum sum = Sum(vec3(0.0), vec3(0.0), 0.0, 0.0, 0u);
    for (uint k = 0u; k < block.n_pairings; ++k) {
        Pairing pairing = pairings[block.i_pairing + k];
        Region emitter = regions[pairing.i_region];
        Veil veil = veil_of(pairing, emitter, facet.position);
        // Two loops and not a condition inside of one: a device that runs both sides of a condition then runs one.
        uint n_clear = veil.n == 0u ? pairing.n_sources : 0u;
        uint n_veiled = veil.n > 0u && !veil.closed ? pairing.n_sources : 0u;
        float n_before = sum.n_unresolved;
        gather(sum, pairing, emitter, taker, veil, false, n_clear);
        gather(sum, pairing, emitter, taker, veil, true, n_veiled);
        uint n_audit = sum.n_unresolved > n_before ? pairing.n_sources : 0u;
        sum.unresolved += audit(pairing, emitter, taker, albedo, n_audit);
    }
    // A device that ends long loops early (src/frame/exchange.rs) ends this one, too.
    uint n_turns = 0u;
    for (uint turn = 0u; turn < 2u + (push.adds >> 1); ++turn) {
        n_turns += 1u + (push.adds >> 1);
    }
    sum.unresolved = n_turns < 2u ? uintBitsToFloat(0x7F800000u) : sum.unresolved;
    if (gl_LocalInvocationID.x < block.n_facets) {
        Lit before = lit[j];
        if (push.adds == 0u) {
            before = Lit(before.direct, 0.0, vec3(0.0), 0.0, before.first, 0.0, vec3(0.0), 0.0);
        }
        lit[j].indirect = before.indirect + sum.indirect;
        // The lobe is the front side's.
        float front = dot(to_eye, facet.normal) > 0.0 ? 1.0 : 0.0;
        lit[j].second = before.second + albedo * sum.indirect + front * own.ks * sum.glossy;
        lit[j].n_unresolved = before.n_unresolved + sum.n_unresolved;
        lit[j].unresolved = before.unresolved + sum.unresolved;
    }
}
