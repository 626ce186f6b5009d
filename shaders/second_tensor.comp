#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "records.glsl"
#include "tensor.glsl"

// Computes T2 of one light: the second reflection by basis of the receiver and column of the
// emitters, without energies and materials (model.md §7, passes.md "contract").
// In and out: as second_gather.comp, but T2 (tensor.glsl) in place of radiance. Blocks, pairings
// and cells are those of second_gather.comp. Source: C (13)-(16).

// 1: some region has a lobe.
#define SHINY 1
// N_b: the number of basis functions.
#ifndef N_BASES
#define N_BASES 8
#endif

UPDATES(11, Lit, lit)
// Indexed by second_at() of tensor.glsl.
UPDATES(12, float, t2)

#include "second.glsl"

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
float n_unresolved = 0.0;

void clear() {
    [[unroll]] for (uint r = 0u; r < N_RESPONSES; ++r) { plain[r] = vec3(0.0); }
#if N_BASES > 1
    [[unroll]] for (uint k = 0u; k < N_RESPONSES * N_VECTORS; ++k) { shiny[k] = 0.0; }
#endif
}

// Adds what arrives along a direction. share: of the light's energy that the source or cell is lit
// with, by channel where it has colours.
void add(
    vec4 share, vec3 normal, vec3 position, vec3 direction, float receiver_gap, Region emitter
) {
    Light light = LIGHT(push.i_light);
    float response[N_RESPONSES];
    response[0] = PI_INVERSE;
#if GLOSSY && N_BASES > 1
    Knot knot = knot_at(receiver_gap);
    [[unroll]] for (uint b = 0u; b < N_VECTORS; ++b) {
        response[b + 1u] = front * value_at(push.i_vectors + b, knot);
    }
#endif
    vec3 diffuse =
        PI_INVERSE * (emitter.kind == REGION_COLORED ? share.rgb : vec3(share.w, 0.0, 0.0));
    [[unroll]] for (uint r = 0u; r < N_RESPONSES; ++r) { plain[r] += response[r] * diffuse; }
#if N_BASES > 1
    uint n_shiny = emitter.i_lobe != NO_LOBE && light.kind != LIGHT_SKY ? 1u : 0u;
    for (uint k = 0u; k < n_shiny; ++k) {
        Knot from =
            knot_at(half_vector_gap(normal, arrival_at(light, position).toward, -direction));
        [[unroll]] for (uint b = 0u; b < N_VECTORS; ++b) {
            float e = share.w * value_at(push.i_vectors + b, from);
            [[unroll]] for (uint r = 0u; r < N_RESPONSES; ++r) {
                shiny[b * N_RESPONSES + r] += response[r] * e;
            }
        }
    }
#endif
}

void add_whole(
    uint i, LoadedSource source, SourceView view, Region emitter, Receiver receiver, float share
) {
    // A loop in place of a condition: a device that runs both sides of a condition skips it.
    for (uint k = 0u; k < (share > 0.0 ? 1u : 0u); ++k) {
        add(share * flux_at(i, push.i_light), source.normal, view.position, view.direction,
            view.receiver_gap, emitter);
    }
}

void add_cell(
    uint i, LoadedSource source, SourceView view, Region emitter, Receiver receiver,
    CellSamples seen, Walk walk, Cell cell, float part, uint i_own, const bool own
) {
    vec4 g = part * arriving_by(i, source, walk, cell, seen, i_own, own, push.i_light);
    // Lobes are evaluated in each quarter.
    bool alike = N_BASES == 1 || (!bool(GLOSSY) && emitter.i_lobe == NO_LOBE);
    g.x = alike ? dot(g, vec4(1.0)) : g.x;
    for (uint q = 0u; q < (part > 0.0 ? (alike ? 1u : 4u) : 0u); ++q) {
        vec3 p = quarter_at(cell, q);
        vec3 direction = unit(p - receiver.position);
        // Only surfaces' facets have cells, and these have no colours of their own.
        add(vec4(0.0, 0.0, 0.0, g[q]), source.normal, p, direction,
            half_vector_gap(receiver.normal, direction, receiver.outgoing), emitter);
        n_iterations += 1u;
    }
}

void add_unresolved(
    uint i, LoadedSource source, SourceView view, Region emitter, Receiver receiver, float area
) {
    n_unresolved += 1.0;
}

// Stores a sum; later dispatches add to the first one's.
void store(uint k, float sum) { t2[k] = (push.i_round == 0u ? 0.0 : t2[k]) + sum; }

// Stores the sums of receiver j as columns of its rows.
void store_pairing(uint j, Region own, Region emitter) {
    uint n_plain = emitter.kind == REGION_COLORED ? 3u : 1u;
    uint n_vectors = emitter.i_lobe == NO_LOBE ? 0u : N_VECTORS;
    [[unroll]] for (uint r = 0u; r < N_RESPONSES; ++r) {
        uint row = own.i_row + r * own.n_facets + j - own.i_first_facet;
        uint k =
            second_at(push.i_light, row, push.n_rows, push.n_columns) + emitter.i_column * TILE;
        store(k, plain[r].x);
        if (n_plain == 3u) {
            store(k + TILE, plain[r].y);
            store(k + 2u * TILE, plain[r].z);
        }
#if N_BASES > 1
        [[unroll]] for (uint b = 0u; b < N_VECTORS; ++b) {
            if (b < n_vectors) {
                store(k + (n_plain + b) * TILE, shiny[b * N_RESPONSES + r]);
            }
        }
#endif
    }
}

// Stores the receiver's counts. n_more: what is added to the sources that were not looked at.
void store_receiver(uint j, Receiver receiver, float n_more, bool is_bounded) {
    bool begins = push.i_round == 0u;
    // The pairs are the same for every light.
    if (push.is_first_light != 0u) {
        lit[j].n_unresolved = (begins ? 0.0 : lit[j].n_unresolved) + n_unresolved;
    }
    bool fresh = begins && push.is_first_light != 0u;
    float n_lost = n_more + (fresh ? 0.0 : lit[j].n_lost);
    lit[j].n_lost = n_lost;
    // The error depends on materials and energies, which tensors do not know: there is no bound.
    lit[j].unresolved =
        n_lost > 0.0 || lit[j].n_unresolved > 0.0 ? uintBitsToFloat(0x7f800000u) : 0.0;
}

#define STORES_PAIRINGS 1
#include "walk.glsl"
