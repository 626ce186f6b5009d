#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "diffusion.glsl"
#include "medium.glsl"
#include "patches.glsl"
#include "second_order.glsl"

// Gathers the light that arrives in each cell from all others (model.md §18, passes.md
// "diffusion").
// In: lights, by direction and cell what the cell sends out there, beside its extinction; with
// SOLIDS the light of surfaces and ground on the box. In, out: phi and F by cell. Out: the sources
// Q0 and q that their change is in diffusion; with SECOND the second order of what it scatters.
// Law: phi and F are the means over 24 directions w of 4 pi L and 4 pi L w, L being the radiance
// along w. Error: some ulp.

// 1: the scene has surfaces or ground.
#ifndef SOLIDS
#define SOLIDS 0
#endif

layout(push_constant) uniform Push {
    Grid grid;
    // s
    vec3 weakened;
    uint n_lights;
    // albedo (1-f), and 3 albedo (g-f)
    vec3 even;
    float inverse_chord;
    vec3 forward;
    // 5 (g^2-f)/(1-f)
    float second;
    // 1 - albedo g
    vec3 kept;
} push;
READS(0, Light, lights)
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(1, sent)
UPDATES(2, vec4, field)
WRITES(3, vec4, change)
#if SOLIDS
READS(4, vec4, faces)
#endif
#if SECOND && SOLIDS
WRITES(5, vec4, of_second)
#elif SECOND
WRITES(4, vec4, of_second)
#endif

#include "directions.glsl"
#include "sectors.glsl"
#include "faces.glsl"
#include "angle.glsl"
#include "sky.glsl"

// The first cell's texel of the direction that is being summed.
int first_sent = 0;
// The sector that it comes from.
uint i_sector = 0u;
vec4 sent_along(int c, vec3 w) { return uintBitsToFloat(TEXEL(sent, first_sent + c)); }

// Sums over directions keep its flux.
#define OUTSIDE(radiance) (radiance)
#define FROM_SOLIDS(at, axis, side, d, above) of_sector(at, axis, side, i_sector)
#include "ways.glsl"

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    Skies skies = all_skies();
    FOR_EACH(i, n_total(level)) {
        int c = int(i);
        ivec3 at = place_of(level, i);
        vec3 phi = vec3(0.0), x = vec3(0.0), y = vec3(0.0), z = vec3(0.0);
#if SECOND
        vec3 sums[N_SECOND];
        [[unroll]] for (int m = 0; m < N_SECOND; ++m) { sums[m] = vec3(0.0); }
#endif
        for (uint k = 0; k < N_DIRECTIONS; ++k) {
            vec3 w = direction(k);
            first_sent = int(k * n_total(level));
            // The signs are the others.
            i_sector = k ^ 7u;
            vec3 l = radiance_along(level, at, w, w.y < 0.0 ? 1.0 : 0.0, skies);
            phi += l;
            x += l * w.x;
            y += l * w.y;
            z += l * w.z;
#if SECOND
            float at_w[N_SECOND] = second_order(w);
            [[unroll]] for (int m = 0; m < N_SECOND; ++m) { sums[m] += at_w[m] * l; }
#endif
        }
#if SECOND
        vec3 scattered = push.second * push.even / max(push.weakened, vec3(1e-30));
        [[unroll]] for (int m = 0; m < N_SECOND; ++m) {
            vec3 mean = sums[m] / (SECOND_MEANS[m] * float(N_DIRECTIONS));
            of_second[N_SECOND * c + m] = vec4(scattered * mean, 0.0);
        }
#endif
        vec3 new[4] = vec3[](phi, x, y, z);
        float sigma = uintBitsToFloat(TEXEL(sent, c)).w;
        vec3 reach = 1.0 / (3.0 * sigma * push.kept + push.inverse_chord);
        // Where cells are opaque, diffusion is right and the change is rounding.
        vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
        vec3 depth = sigma * push.weakened * min(edges.x, min(edges.y, edges.z));
        vec3 counts = sigma / max(vec3(1.0), depth * depth);
        for (int k = 0; k < 4; ++k) {
            vec3 now = new[k] / float(N_DIRECTIONS);
            vec3 rise = now - field[4 * c + k].rgb;
            field[4 * c + k].rgb = now;
            vec3 scattered = k == 0 ? push.even : reach * push.forward;
            change[4 * c + k] = vec4(counts * scattered * rise, 0.0);
        }
    }
}
