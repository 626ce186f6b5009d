// The buffers and functions that second_gather.comp and second_tensor.comp share
// (model.md §7, passes.md "second").
// Needs records.glsl.

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

// 1: few registers: lists lie in shared memory, and occluders are loaded where they are looked at.
// For devices that run the fewer subgroups at once, the more registers an invocation has, and that
// keep indexed arrays in memory.
#ifndef WIDE
#define WIDE 0
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
    // Of the dispatches that make up a gather.
    uint i_round;
    uint n_rounds;
    // Of second_tensor.comp alone. is_first_light: 1 for the first light that has energy.
    uint i_light;
    uint i_vectors;
    uint n_rows;
    uint n_columns;
    uint is_first_light;
} push;
READS(0, Block, blocks)
READS(1, Pairing, pairings)
READS(2, uint, occluders)
READS(3, uint, order)
READS(4, Facet, facets)
#if WIDE
// All invocations of a workgroup read the same emitter and the same region of their own. A GPU
// loads these from a storage buffer to registers that they share, and texels to registers of each.
READS(5, uvec4, regions)
#define REGION_WORDS(k) regions[k]
#else
TEXELS(5, regions)
#endif
READS(6, Light, lights)
TEXELS(7, sources)
TEXELS(8, fluxes)
FLOATS(9, table)
FLOATS(10, density)
// By facet: the first source that was not looked at yet, or DONE.
UPDATES(13, uint, reached)
// As second_sources.comp writes them.
TEXELS(14, cell_samples)
// Workgroups of each round, three numbers a round: a receiver that is not done counts for the next.
UPDATES(15, uint, rounds)

#include "light.glsl"
#include "occlude.glsl"
#include "functions.glsl"
#include "cell_samples.glsl"
#include "iterations.glsl"
#include "regions.glsl"
#include "lobe.glsl"
#if MARCH
#include "density.glsl"
#endif
#include "occluders.glsl"
#include "reach.glsl"
#include "arriving.glsl"
#include "gather.glsl"
#include "cells.glsl"
