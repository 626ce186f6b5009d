#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Radiance and irradiance of every facet from the tensors T1 and T2, the lights' energies and the materials' coefficients,
// C (13)-(16) (docs/model.md §7, §11 "contract").

layout(local_size_x = 64) in;

const float PI = 3.14159265358979;

layout(push_constant) uniform Push { uint n_facets; uint n_lights; uint n_bases; uint n_rows; uint n_columns; } push;
layout(std430, binding = 0) readonly buffer Facets { Facet facets[]; };
layout(std430, binding = 1) readonly buffer Lights { Light lights[]; };
layout(std430, binding = 2) readonly buffer Regions { Region regions[]; };
// By column.
layout(std430, binding = 3) readonly buffer Coefficients { vec4 coefficients[]; };
// [light][row]
layout(std430, binding = 4) readonly buffer First { float t1[]; };
// [light][column][row]
layout(std430, binding = 5) readonly buffer Second { float t2[]; };
layout(std430, binding = 6) writeonly buffer LitFacets { Lit lit[]; };

struct Reflected { vec3 first; vec3 second; };

// One row of both tensors, summed over lights and columns.
Reflected row_of(uint row) {
    Reflected sum = Reflected(vec3(0.0), vec3(0.0));
    for (uint l = 0u; l < push.n_lights; ++l) {
        vec3 energy = lights[l].energy;
        uint n_columns = energy == vec3(0.0) ? 0u : push.n_columns;
        vec3 second = vec3(0.0);
        uint k = l * push.n_columns * push.n_rows + row;
        for (uint c = 0u; c < n_columns; ++c) {
            second += coefficients[c].rgb * t2[k];
            k += push.n_rows;
        }
        sum.first += energy * t1[l * push.n_rows + row];
        sum.second += energy * second;
    }
    return sum;
}

void main() {
    FOR_EACH(j, push.n_facets) {
        Facet facet = facets[j];
        Region region = regions[facet.i_region];
        uint row = region.i_row + j - region.i_first_facet;
        Reflected diffuse = row_of(row);
        vec3 albedo = region.kd * facet.color;
        vec3 first = albedo * diffuse.first;
        vec3 second = albedo * diffuse.second;
        uint n_vectors = region.i_lobe == NO_LOBE ? 0u : push.n_bases - 1u;
        uint column = region.i_column + (region.kind == REGION_COLORED ? 3u : 1u);
        for (uint b = 0u; b < n_vectors; ++b) {
            row += region.n_facets;
            Reflected glossy = row_of(row);
            vec3 coefficient = coefficients[column + b].rgb;
            first += coefficient * glossy.first;
            second += coefficient * glossy.second;
        }
        // n_unresolved stays as second counted it.
        lit[j].direct = PI * diffuse.first;
        lit[j].indirect = PI * diffuse.second;
        lit[j].first = first;
        lit[j].second = second;
    }
}
