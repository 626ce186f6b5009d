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

struct Sum { vec3 indirect; vec3 glossy; };

// Adds what the sources of a pairing send to the receiver: as many as `n`, behind the veil or without one.
void gather(inout Sum sum, Pairing pairing, Region emitter, Region own, Veil veil, const bool veiled, uint n, vec3 p, vec3 normal, vec3 outgoing) {
    uint n_shiny = emitter.i_lobe == NO_LOBE ? 0u : 1u;
    for (uint s = 0u; s < n; ++s) {
        uint i = pairing.i_source + s;
        Source source = sources[i];
        vec3 offset = source.position - p;
        float d2 = dot(offset, offset);
        vec3 way = offset * inversesqrt(max(d2, 1e-30));
        float share = form(normal, source.normal, way, d2, source.area);
        if (veiled) {
            share *= visible(pairing, veil, p, source.position, share > 0.0);
        }
#if MARCH
        share *= attenuation(p, source.position, share > 0.0);
#endif
        vec3 leaving = source.flux;
        for (uint g = 0u; g < n_shiny; ++g) {
            leaving += lobe_flux(i, emitter, source.position, source.normal, -way, 1.0);
        }
        vec3 e = leaving * share;
        sum.indirect += e;
#if GLOSSY
        sum.glossy += e * lobe_between(own.i_lobe, normal, way, outgoing);
#endif
    }
}

void main() {
    Block block = blocks[push.i_first_block + gl_WorkGroupID.x];
    uint place = block.i_first + min(gl_LocalInvocationID.x, block.n_facets - 1u);
    uint j = order[place];
    Facet facet = facets[j];
    Region own = regions[facet.i_region];
    vec3 p = facet.position, normal = facet.normal;
    vec3 outgoing = normalize(push.eye - p);
    Sum sum = Sum(vec3(0.0), vec3(0.0));
    for (uint k = 0u; k < block.n_pairings; ++k) {
        Pairing pairing = pairings[block.i_pairing + k];
        Region emitter = regions[pairing.i_region];
        Veil veil = veil_of(pairing, emitter, p);
        // Two loops and not a condition inside of one: a device that runs both sides of a condition then runs one.
        uint n_clear = veil.n == 0u ? emitter.n_facets : 0u;
        uint n_veiled = veil.n > 0u && !veil.closed ? emitter.n_facets : 0u;
        gather(sum, pairing, emitter, own, veil, false, n_clear, p, normal, outgoing);
        gather(sum, pairing, emitter, own, veil, true, n_veiled, p, normal, outgoing);
    }
    if (gl_LocalInvocationID.x < block.n_facets) {
        lit[j].indirect = sum.indirect;
        lit[j].second = own.kd * facet.color * sum.indirect * PI_INVERSE + own.ks * sum.glossy;
    }
}
