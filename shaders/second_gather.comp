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

#include "lobe.glsl"
#if MARCH
#include "density.glsl"
#endif
#include "veil.glsl"
#include "gather.glsl"

struct Sum {
    vec3 indirect;
    vec3 glossy;
    // Cells that stayed wider than asked for, and a bound on what they may change of L2's greatest channel.
    float n_unresolved;
    float unresolved;
};

struct Taker { vec3 position; vec3 normal; vec3 outgoing; Region region; };

// Adds what the first `n` sources of a pairing send to the receiver. One step is one cell: a whole facet, or a quarter of
// a cell that was too wide for its distance, so that neighbouring invocations need not wait for each other's near facets.
void gather(inout Sum sum, Pairing pairing, Region emitter, Taker taker, Veil veil, const bool veiled, uint n) {
    bool flat_emitter = emitter.kind == REGION_SURFACE;
    vec3 half_u = flat_emitter ? emitter.u / float(emitter.n_u) : vec3(0.0);
    vec3 half_v = flat_emitter ? emitter.v / float(emitter.n_v) : vec3(0.0);
    float side = 2.0 * sqrt(max(dot(half_u, half_u), dot(half_v, half_v)));
    uint n_shiny = emitter.i_lobe == NO_LOBE ? 0u : 1u;
    Cell cell = Cell(0u, uvec2(0u));
    uint n_steps = 0u;
    for (uint s = 0u; s < n;) {
        uint i = pairing.i_source + s;
        Source source = sources[i];
        float scale = cell_scale(cell);
        vec2 at = (2.0 * vec2(cell.at) + 1.0) * scale - 1.0;
        vec3 q = source.position + at.x * half_u + at.y * half_v;
        vec3 offset = q - taker.position;
        float d2 = dot(offset, offset);
        float inverse = inversesqrt(max(d2, 1e-30));
        vec3 way = offset * inverse;
        float part = scale * scale;
        float share = part * form(taker.normal, source.normal, way, d2, part * source.area);
        // Width over distance: of geometry, and of the half vector's turn where a lobe can be met.
        float width = side * scale * inverse;
        float excess = width / push.pair_size;
        vec3 leaving = source.flux;
        float turn = 0.75 * width;
        for (uint g = 0u; g < n_shiny; ++g) {
            float gap;
            leaving += lobe_flux(i, emitter, q, source.normal, -way, gap);
            excess = max(excess, lobe_excess(emitter, gap, turn, width));
        }
#if GLOSSY
        float gap = half_vector_gap(taker.normal, way, taker.outgoing);
        excess = max(excess, lobe_excess(taker.region, gap, turn, width));
#endif
        // Some of the cell may be before the receiver, and the receiver is before all of it or none.
        bool faces = dot(source.normal, offset) < 0.0 && dot(taker.normal, offset) > -side * scale;
        bool wide = faces && excess > 1.0;
        bool split = wide && cell.level < push.pair_levels && n_steps < MAX_STEPS;
        share = split ? 0.0 : share;
        if (veiled) {
            share *= visible(pairing, veil, taker.position, q, share > 0.0);
        }
#if MARCH
        share *= attenuation(taker.position, q, share > 0.0);
#endif
        vec3 e = leaving * share;
        sum.indirect += e;
#if GLOSSY
        vec3 g = e * lobe_at(taker.region.i_lobe, gap);
        sum.glossy += g;
#endif
        bool open = wide && !split;
        sum.n_unresolved += open ? 1.0 : 0.0;
        Cell next = next_cell(cell);
        s += !split && next.level == 0u ? 1u : 0u;
        n_steps = next.level == 0u ? 0u : n_steps + 1u;
        cell = split ? Cell(cell.level + 1u, cell.at * 2u) : next;
    }
}

void main() {
    Block block = blocks[push.i_first_block + gl_WorkGroupID.x];
    uint place = block.i_first + min(gl_LocalInvocationID.x, block.n_facets - 1u);
    uint j = order[place];
    Facet facet = facets[j];
    Region own = regions[facet.i_region];
    Taker taker = Taker(facet.position, facet.normal, normalize(push.eye - facet.position), own);
    Sum sum = Sum(vec3(0.0), vec3(0.0), 0.0, 0.0);
    for (uint k = 0u; k < block.n_pairings; ++k) {
        Pairing pairing = pairings[block.i_pairing + k];
        Region emitter = regions[pairing.i_region];
        Veil veil = veil_of(pairing, emitter, facet.position);
        // Two loops and not a condition inside of one: a device that runs both sides of a condition then runs one.
        uint n_clear = veil.n == 0u ? emitter.n_facets : 0u;
        uint n_veiled = veil.n > 0u && !veil.closed ? emitter.n_facets : 0u;
        gather(sum, pairing, emitter, taker, veil, false, n_clear);
        gather(sum, pairing, emitter, taker, veil, true, n_veiled);
    }
    if (gl_LocalInvocationID.x < block.n_facets) {
        lit[j].indirect = sum.indirect;
        lit[j].second = own.kd * facet.color * sum.indirect * PI_INVERSE + own.ks * sum.glossy;
        lit[j].n_unresolved = sum.n_unresolved;
        lit[j].unresolved = sum.unresolved;
    }
}
