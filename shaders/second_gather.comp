#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "records.glsl"
#include "light.glsl"
#include "occlude.glsl"
#include "functions.glsl"
#include "stencil.glsl"

// The second reflection, C (16), gathered fused: radiance at once, no tensor (docs/model.md §7, §11
// "second"). A workgroup takes a block of receivers of one region, and goes through the regions
// that it can receive light from.

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
// 1: some region has a lobe.
#ifndef SHINY
#define SHINY 1
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
    float theta;
    uint n_surfaces;
    // Of the dispatches that make up a gather.
    uint i_round;
    uint n_rounds;
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
layout(std430, binding = 11) readonly buffer Nodes { Node nodes[]; };
layout(std430, binding = 12) buffer LitFacets { Lit lit[]; };
// By facet: the first source that is still to be looked at, or DONE.
layout(std430, binding = 13) buffer Reached { uint reached[]; };
// As second_sources.comp leaves them.
layout(binding = 14) uniform usamplerBuffer stencils;
// Workgroups of each round, three numbers a round: those of the next are counted where a receiver
// is not done.
layout(std430, binding = 15) buffer Rounds { uint rounds[]; };

#include "sum.glsl"
#include "lobe.glsl"
#if MARCH
#include "density.glsl"
#endif
#include "veil.glsl"
#include "reach.glsl"
#include "arriving.glsl"
#include "gather.glsl"
#include "cells.glsl"

// What the receiver has got.
SUM3 indirect = EMPTY3;
SUM3 glossy = EMPTY3;
// Cells that stayed wider than asked for, and a bound on what they may change of L2's greatest
// channel.
float n_unresolved = 0.0;
float unresolved = 0.0;

// Adds what comes along the view's way.
void add(View view, vec3 e, Taker taker) {
    ADD(indirect, e);
#if GLOSSY
    if (e != vec3(0.0)) {
        ADD(glossy, e * lobe_at(taker.region.i_lobe, view.taker_gap));
    }
#endif
}

void take_whole(uint i, Sender source, View view, Region emitter, Taker taker, float share) {
    vec3 leaving = source.flux;
#if SHINY
    vec3 shining = vec3(0.0);
    if (emitter.i_lobe != NO_LOBE && share > 0.0) {
        [[unroll]] for (uint l = 0u; l < N_LIGHTS; ++l) {
            vec2 shine = shine_of(i, source, view, l);
            shining += LIGHT(l).energy * (shine.x * lobe_at(emitter.i_lobe, shine.y));
        }
    }
    leaving += emitter.ks * shining;
#endif
    add(view, leaving * share, taker);
}

// The receiver's lobe toward each quarter of a cell, the emitter's by light l.
#if GLOSSY
vec4 taken_from(Cell cell, Taker taker) {
    vec4 lobes;
    [[unroll]] for (uint q = 0u; q < 4u; ++q) {
        vec3 way = unit(quarter_at(cell, q) - taker.position);
        lobes[q] = lobe_at(taker.region.i_lobe, half_vector_gap(taker.normal, way, taker.outgoing));
    }
    return lobes;
}
#endif

#if SHINY
vec4 shining_from(Cell cell, Sender source, Region emitter, Taker taker, uint l) {
    vec4 lobes;
    [[unroll]] for (uint q = 0u; q < 4u; ++q) {
        vec3 p = quarter_at(cell, q);
        lobes[q] = lobe_at(emitter.i_lobe, gap_of(p, source.normal, unit(taker.position - p), l));
    }
    return lobes;
}
#endif

void take_cell(
    uint i, Sender source, View view, Region emitter, Taker taker, Stencil seen, Walk walk, Cell cell, float part, uint i_own,
    const bool own) {
#if GLOSSY
    vec4 taken = taken_from(cell, taker);
#endif
    UNROLL for (uint l = 0u; l < N_LIGHTS; ++l) {
        vec4 g = part * arriving_by(i, source, walk, cell, seen, i_own, own, l);
        vec3 diffuse = LIGHT(l).energy * emitter.kd * PI_INVERSE;
        ADD(indirect, diffuse * dot(g, vec4(1.0)));
#if GLOSSY
        ADD(glossy, diffuse * dot(g, taken));
#endif
#if SHINY
        if (emitter.i_lobe != NO_LOBE && shine_of(i, source, view, l).x > 0.0 && part > 0.0) {
            g *= shining_from(cell, source, emitter, taker, l);
            vec3 shining = LIGHT(l).energy * emitter.ks;
            ADD(indirect, shining * dot(g, vec4(1.0)));
#if GLOSSY
            ADD(glossy, shining * dot(g, taken));
#endif
        }
#endif
    }
}

// The lobe's gap where it is nearest to its peak in a cell that turns the half vector by `turn`.
float nearest_gap(float gap, float turn) {
    float angle = max(sqrt(2.0 * gap) - turn, 0.0);
    return 0.5 * angle * angle;
}

// A bound on what a cell that stayed too wide may change (docs/model.md §11 "unresolved").
void take_doubt(uint i, Sender source, View view, Region emitter, Taker taker, float area) {
    float turn = TURN * view.width;
    // Nothing is nearer than the centre less half a diagonal, and no cell fills more than the
    // hemisphere.
    float distance = sqrt(view.d2);
    float nearest = distance * max(1.0 - 0.70710678 * view.width, 0.0);
    float most = min(PI, area / max(nearest * nearest, 1e-30));
    float share = view.width > 1.0 ? most : min(most, area / max(view.d2, 1e-30));
    // As if nothing shaded the cell: its facet's mean may be mostly shadow.
    vec3 met = vec3(0.0), sent = vec3(0.0), plain = vec3(0.0);
    for (uint l = 0u; l < N_LIGHTS; ++l) {
        float g = share_of(LIGHT(l), arrival_at(LIGHT(l), view.position), source.normal, 1.0);
        float peak = 0.0, lobe = 0.0;
#if SHINY
        vec2 shine = shine_of(i, source, view, l);
        if (emitter.i_lobe != NO_LOBE && shine.x > 0.0) {
            peak = lobe_at(emitter.i_lobe, nearest_gap(view.emitter_gap, turn));
            lobe = abs(lobe_at(emitter.i_lobe, shine.y));
        }
#endif
        met += LIGHT(l).energy * g * (emitter.kd * PI_INVERSE + emitter.ks * lobe);
        sent += LIGHT(l).energy * g * (emitter.kd * PI_INVERSE + emitter.ks * max(peak, lobe));
        plain += LIGHT(l).energy * g * (emitter.kd * PI_INVERSE);
    }
    vec3 received = taker.albedo, taken = taker.albedo;
#if GLOSSY
    float at = abs(lobe_at(taker.region.i_lobe, view.taker_gap));
    received += taker.region.ks * at;
    taken += taker.region.ks * max(at, lobe_at(taker.region.i_lobe, nearest_gap(view.taker_gap, turn)));
#endif
    // Of geometry: all that it may be where the cell is wider than far, else the midpoint rule's
    // error. Of lobes: their greatest values, since the quarters' middles may have met nothing of
    // them.
    vec3 e = met * received * share * min(view.width * view.width, 1.0) + (sent * taken - plain * taker.albedo) * share;
    unresolved += max(e.x, max(e.y, e.z));
    n_unresolved += 1.0;
}

#include "walk.glsl"

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
    vec3 to_eye = push.eye - facet.position;
    vec3 albedo = own.kd * facet.color * PI_INVERSE;
    Taker taker = Taker(facet.position, facet.normal, normalize(to_eye), albedo, own);
    uint last = 0u;
    for (uint k = 0u; k < block.n_pairings; ++k) {
        Pairing pairing = pairings[block.i_pairing + k];
        last = pairing.i_source + pairing.n_sources;
        bool open = n_turns < BATCH_TURNS && n_torn < MAX_TORN && next < last;
        Region emitter = region_at(pairing.i_region);
        uint s = begin_of(pairing, next);
        uint n = open ? pairing.n_sources : 0u;
        Veil veil = veil_of(pairing, emitter, facet.position, open);
        gather(block.i_pairing + k, pairing, emitter, taker, veil, s, veil.closed ? 0u : n);
        s = veil.closed && open ? pairing.n_sources : s;
        next = open ? pairing.i_source + s : next;
        n_turns += 4u;
    }
    gather_torn(taker);
    if (gl_LocalInvocationID.x < block.n_facets) {
        // The lobe is the front side's.
        float front = dot(to_eye, facet.normal) > 0.0 ? 1.0 : 0.0;
        bool begins = push.i_round == 0u;
        vec3 arrived = vec3(TOTAL(indirect)), shone = vec3(TOTAL(glossy));
        Lit before = lit[j];
        // What none of the dispatches has come to is told, and has no bound.
        float n_lost = n_cut + (push.i_round + 1u == push.n_rounds ? float(last - min(next, last)) : 0.0);
        lit[j].indirect = (begins ? vec3(0.0) : before.indirect) + arrived;
        lit[j].second = (begins ? vec3(0.0) : before.second) + albedo * arrived + front * own.ks * shone;
        lit[j].n_unresolved = (begins ? 0.0 : before.n_unresolved) + n_unresolved;
        lit[j].unresolved = n_lost > 0.0 ? uintBitsToFloat(0x7f800000u) : (begins ? 0.0 : before.unresolved) + unresolved;
        lit[j].n_lost = (begins ? 0.0 : before.n_lost) + n_lost;
        reached[j] = next >= last ? DONE : next;
        if (next < last) {
            atomicMax(rounds[3u * (push.i_round + 1u)], gl_NumWorkGroups.x);
        }
    }
}
