#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "records.glsl"

// Gathers the second reflection as radiance at once, without tensors (model.md §7, passes.md
// "second"). A workgroup takes a block of receivers of one region and goes through the regions that
// it can receive light from. In: facets, regions, lights, sources with their fluxes and cell
// samples. Out: irradiance I_i and radiance L2 of every facet, linear RGB, and a bound on cells
// that stayed too wide. Law: I = sum over sources of Lambda G V. Source: C (16). Bound: pair_size
// and theta limit the form factors' error; `unresolved` bounds the rest.

// 1: sources are the nodes of a tree, 0: facets.
#ifndef TREE
#define TREE 1
#endif
// 1: some region has a lobe.
#ifndef SHINY
#define SHINY 1
#endif


READS(11, Node, nodes)
UPDATES(12, Lit, lit)

#include "second.glsl"
#include "sum.glsl"

// The receiver's sums.
SUM3 indirect = EMPTY3;
SUM3 glossy = EMPTY3;
// Cells that stayed wider than asked for, and a bound on what they may change of L2's greatest
// channel.
float n_unresolved = 0.0;
float unresolved = 0.0;

// Adds what arrives along the view's direction.
void add(SourceView view, vec3 e, Receiver receiver) {
    ADD(indirect, e);
#if GLOSSY
    if (e != vec3(0.0)) {
        ADD(glossy, e * lobe_at(receiver.region.i_lobe, view.receiver_gap));
    }
#endif
}

void add_whole(
    uint i, LoadedSource source, SourceView view, Region emitter, Receiver receiver, float share
) {
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
    add(view, leaving * share, receiver);
}

// Returns the receiver's lobe toward each quarter of a cell; below, the emitter's by light l.
#if GLOSSY
vec4 taken_from(Cell cell, Receiver receiver) {
    vec4 lobes;
    [[unroll]] for (uint q = 0u; q < 4u; ++q) {
        vec3 direction = unit(quarter_at(cell, q) - receiver.position);
        lobes[q] = lobe_at(
            receiver.region.i_lobe, half_vector_gap(receiver.normal, direction, receiver.outgoing)
        );
    }
    return lobes;
}
#endif

#if SHINY
vec4 shining_from(Cell cell, LoadedSource source, Region emitter, Receiver receiver, uint l) {
    vec4 lobes;
    [[unroll]] for (uint q = 0u; q < 4u; ++q) {
        vec3 p = quarter_at(cell, q);
        lobes[q] =
            lobe_at(emitter.i_lobe, gap_of(p, source.normal, unit(receiver.position - p), l));
    }
    return lobes;
}
#endif

void add_cell(
    uint i, LoadedSource source, SourceView view, Region emitter, Receiver receiver,
    CellSamples seen, Walk walk, Cell cell, float part, uint i_own, const bool own
) {
#if GLOSSY && !WIDE
    vec4 taken = taken_from(cell, receiver);
#endif
    UNROLL for (uint l = 0u; l < N_LIGHTS; ++l) {
        vec4 g = part * arriving_by(i, source, walk, cell, seen, i_own, own, l);
#if GLOSSY && WIDE
        // Again for each light: before the light, it would take registers beside the light's.
        vec4 taken = taken_from(cell, receiver);
#endif
        vec3 diffuse = LIGHT(l).energy * emitter.kd * PI_INVERSE;
        ADD(indirect, diffuse * dot(g, vec4(1.0)));
#if GLOSSY
        ADD(glossy, diffuse * dot(g, taken));
#endif
#if SHINY
        if (emitter.i_lobe != NO_LOBE && shine_of(i, source, view, l).x > 0.0 && part > 0.0) {
            g *= shining_from(cell, source, emitter, receiver, l);
            vec3 shining = LIGHT(l).energy * emitter.ks;
            ADD(indirect, shining * dot(g, vec4(1.0)));
#if GLOSSY
            ADD(glossy, shining * dot(g, taken));
#endif
        }
#endif
    }
}

// Returns the lobe's gap where it is nearest to its peak in a cell that turns the half vector by
// `turn`.
float nearest_gap(float gap, float turn) {
    float angle = max(sqrt(2.0 * gap) - turn, 0.0);
    return 0.5 * angle * angle;
}

// Adds a bound on what a cell that stayed too wide may change (passes.md
// "unresolved").
void add_unresolved(
    uint i, LoadedSource source, SourceView view, Region emitter, Receiver receiver, float area
) {
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
    vec3 received = receiver.albedo, taken = receiver.albedo;
#if GLOSSY
    float at = abs(lobe_at(receiver.region.i_lobe, view.receiver_gap));
    received += receiver.region.ks * at;
    taken += receiver.region.ks
             * max(at, lobe_at(receiver.region.i_lobe, nearest_gap(view.receiver_gap, turn)));
#endif
    // Geometry may change all of it where the cell is wider than its distance, else by the midpoint
    // rule's error. Lobes count with their greatest values, since the quarters' middles may have
    // missed them.
    vec3 e = met * received * share * min(view.width * view.width, 1.0)
             + (sent * taken - plain * receiver.albedo) * share;
    unresolved += max(e.x, max(e.y, e.z));
    n_unresolved += 1.0;
}

// Stores the receiver's sums. n_more: what is added to the sources that were not looked at.
void store_receiver(uint j, Receiver receiver, float n_more, bool is_bounded) {
    bool begins = push.i_round == 0u;
    vec3 arrived = vec3(TOTAL(indirect)), shone = vec3(TOTAL(glossy));
    Lit before = lit[j];
    lit[j].indirect = (begins ? vec3(0.0) : before.indirect) + arrived;
    lit[j].second = (begins ? vec3(0.0) : before.second) + receiver.albedo * arrived
                    + front * receiver.region.ks * shone;
    lit[j].n_unresolved = (begins ? 0.0 : before.n_unresolved) + n_unresolved;
    lit[j].unresolved = is_bounded ? (begins ? 0.0 : before.unresolved) + unresolved
                                   : uintBitsToFloat(0x7f800000u);
    lit[j].n_lost = (begins ? 0.0 : before.n_lost) + n_more;
}

#define STORES_PAIRINGS 0
#include "walk.glsl"
