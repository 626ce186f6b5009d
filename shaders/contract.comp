#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "each.glsl"
#include "tensor.glsl"
#include "sum.glsl"

// Contracts the tensors T1 and T2 with the lights' energies and the materials' coefficients
// (model.md §7, passes.md "contract").
// In: facets, lights, regions, coefficients by column, T1 [light][row], T2 (tensor.glsl). Out:
// irradiance I_d, I_i and radiance L1, L2 of every facet, linear RGB.
// Law: I = pi sum E T, L = sum E c_b' C T over lights, bases and columns. Source: C (13)-(16).
// Error bound: that of the sums, of magnitude sum |c_b| max|v_b| (passes.md "sums").

// N_b: the number of basis functions.
#ifndef N_BASES
#define N_BASES 8
#endif

#if DOUBLE
const REAL PI = 3.14159265358979LF;
#else
const REAL PI = 3.14159265358979;
#endif

layout(push_constant) uniform Push {
    uint n_facets;
    uint n_lights;
    uint n_rows;
    uint n_columns;
} push;
READS(0, Facet, facets)
READS(1, Light, lights)
TEXELS(2, regions)
#include "regions.glsl"
// RGB coefficients by column.
TEXELS(3, coefficients)
// [light][row]
FLOATS(4, t1)
// Indexed by second_at() of tensor.glsl.
FLOATS(5, t2)
// By region the first span and the number of its spans. Behind them the spans: the first column and
// the number of columns that the region can receive light from.
READS(6, uvec2, spans)
WRITES(7, Lit, lit)

vec3 coefficient_of(uint column) {
    return uintBitsToFloat(TEXEL(coefficients, int(column)).rgb);
}

// The facet as a receiver: coefficient and row of each of its bases.
REAL3 own[N_BASES];
uint rows[N_BASES];

#if SUMMATION == PLAIN && !DOUBLE
struct Sum {
    vec3 direct;
    vec3 indirect;
    vec3 first;
    vec3 second;
};

// Returns what one light of energy 1 brings. Each column's coefficient is loaded once for all
// bases.
Sum of_light(uint l, uvec2 own_spans, uint n_shiny) {
    uint at[N_BASES];
    float direct = FLOAT(t1, int(l * push.n_rows + rows[0]));
    Sum sum = Sum(vec3(direct), vec3(0.0), own[0] * direct, vec3(0.0));
    for (uint k = 0u; k < n_shiny; ++k) {
        [[unroll]] for (uint b = 1u; b < N_BASES; ++b) {
            sum.first += own[b] * FLOAT(t1, int(l * push.n_rows + rows[b]));
        }
    }
    [[unroll]] for (uint b = 0u; b < N_BASES; ++b) {
        at[b] = second_at(l, rows[b], push.n_rows, push.n_columns);
    }
    for (uint i = 0u; i < own_spans.y; ++i) {
        uvec2 span = spans[own_spans.x + i];
        for (uint c = span.x; c < span.x + span.y; ++c) {
            vec3 column = coefficient_of(c);
            float indirect = FLOAT(t2, int(at[0] + c * TILE));
            vec3 second = own[0] * indirect;
            for (uint k = 0u; k < n_shiny; ++k) {
                [[unroll]] for (uint b = 1u; b < N_BASES; ++b) {
                    second += own[b] * FLOAT(t2, int(at[b] + c * TILE));
                }
            }
            sum.indirect += column * indirect;
            sum.second += column * second;
        }
    }
    return sum;
}

#else
// The sums over all lights: each is a single sum over lights, bases and columns.
struct Sum {
    SUM3 direct;
    SUM3 indirect;
    SUM3 first;
    SUM3 second;
};

void add_light(inout Sum sum, REAL3 energy, uint l, uvec2 own_spans, uint n_shiny) {
    uint at[N_BASES];
    REAL3 direct = energy * FLOAT(t1, int(l * push.n_rows + rows[0]));
    ADD(sum.direct, direct);
    ADD(sum.first, direct * own[0]);
    for (uint k = 0u; k < n_shiny; ++k) {
        UNROLL for (uint b = 1u; b < N_BASES; ++b) {
            ADD(sum.first, energy * own[b] * FLOAT(t1, int(l * push.n_rows + rows[b])));
        }
    }
    [[unroll]] for (uint b = 0u; b < N_BASES; ++b) {
        at[b] = second_at(l, rows[b], push.n_rows, push.n_columns);
    }
    for (uint i = 0u; i < own_spans.y; ++i) {
        uvec2 span = spans[own_spans.x + i];
        for (uint c = span.x; c < span.x + span.y; ++c) {
            REAL3 column = energy * coefficient_of(c);
            REAL3 indirect = column * FLOAT(t2, int(at[0] + c * TILE));
            ADD(sum.indirect, indirect);
            ADD(sum.second, indirect * own[0]);
            for (uint k = 0u; k < n_shiny; ++k) {
                UNROLL for (uint b = 1u; b < N_BASES; ++b) {
                    ADD(sum.second, column * own[b] * FLOAT(t2, int(at[b] + c * TILE)));
                }
            }
        }
    }
}
#endif

void main() {
    FOR_EACH(j, push.n_facets) {
        Facet facet = facets[j];
        Region region = region_at(facet.i_region);
        bool glossy = region.i_lobe != NO_LOBE;
        uint i_vector = region.i_column + (region.kind == REGION_COLORED ? 3u : 1u);
        own[0] = REAL3(region.kd) * facet.color;
        rows[0] = region.i_row + j - region.i_first_facet;
        [[unroll]] for (uint b = 1u; b < N_BASES; ++b) {
            own[b] = REAL3(glossy ? coefficient_of(i_vector + b - 1u) : vec3(0.0));
            rows[b] = glossy ? rows[b - 1u] + region.n_facets : rows[0];
        }
#if SUMMATION == PLAIN && !DOUBLE
        Sum sum = Sum(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
        for (uint l = 0u; l < push.n_lights; ++l) {
            vec3 energy = lights[l].energy;
            Sum light = of_light(
                l, energy == vec3(0.0) ? uvec2(0u) : spans[facet.i_region], glossy ? 1u : 0u
            );
            sum.direct += energy * light.direct;
            sum.indirect += energy * light.indirect;
            sum.first += energy * light.first;
            sum.second += energy * light.second;
        }
#else
        Sum sum = Sum(EMPTY3, EMPTY3, EMPTY3, EMPTY3);
        for (uint l = 0u; l < push.n_lights; ++l) {
            vec3 energy = lights[l].energy;
            add_light(
                sum, energy, l, energy == vec3(0.0) ? uvec2(0u) : spans[facet.i_region],
                glossy ? 1u : 0u
            );
        }
#endif
        // n_unresolved keeps the value that `second` counted.
        lit[j].direct = vec3(PI * TOTAL(sum.direct));
        lit[j].indirect = vec3(PI * TOTAL(sum.indirect));
        lit[j].first = vec3(TOTAL(sum.first));
        lit[j].second = vec3(TOTAL(sum.second));
    }
}
