#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "diffusion.glsl"
#include "medium.glsl"
#include "patches.glsl"

// Computes the radiance that the medium of each cell scatters toward the eye (model.md §18,
// passes.md "scatter").
// In: lights, phi and F by cell, and what suns and lamps make a cell send out. Out: by cell
// radiance and extinction. Law: s S + (1-s) L. S is what is scattered but not straight on, of
// suns and lamps by the phase function. L is the radiance that comes to the cell along the way to
// the eye.
// Error: some ulp.

// 1: the scene has surfaces or ground.
#ifndef SOLIDS
#define SOLIDS 0
#endif

layout(push_constant) uniform Push {
    Grid grid;
    // s
    vec3 weakened;
    uint n_lights;
    // albedo', and 3 albedo' g'
    vec3 even;
    float g;
    vec3 forward;
    float straight;
    vec3 eye;
} push;
READS(0, Light, lights)
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(1, field)
TEXELS(2, arrived)
WRITES(3, vec4, seen)
#if SOLIDS
READS(4, vec4, faces)
#endif

#include "faces.glsl"
#include "angle.glsl"
#include "sky.glsl"

vec3 field_at(int k) { return uintBitsToFloat(TEXEL(field, k).rgb); }
vec4 arrived_at(int k) { return uintBitsToFloat(TEXEL(arrived, k)); }
float mean_of(vec3 v) { return dot(v, vec3(1.0 / 3.0)); }

// Returns 4 pi times what a cell scatters along w of the light that is not scattered straight on,
// over albedo s, beside its extinction.
vec4 sent_along(int c, vec3 w) {
    vec3 along = w.x * field_at(4 * c + 1) + w.y * field_at(4 * c + 2) + w.z * field_at(4 * c + 3);
    vec3 diffuse = push.even * field_at(4 * c) + push.forward * along;
    // Light of suns and lamps goes in the direction of its flux, and what is left of the fluence
    // evenly in all.
    vec4 even = arrived_at(4 * c);
    vec3 of_suns = even.rgb;
    vec3 flux = vec3(
        mean_of(arrived_at(4 * c + 1).rgb), mean_of(arrived_at(4 * c + 2).rgb),
        mean_of(arrived_at(4 * c + 3).rgb)
    );
    float fluence = mean_of(push.forward) * mean_of(of_suns), size = length(flux);
    float directed = fluence > 0.0 ? min(size * mean_of(push.even) / fluence, 1.0) : 0.0;
    vec3 bend = w - (size > 0.0 ? flux / size : vec3(0.0));
    float away = 0.5 * dot(bend, bend);
    float phase = henyey_greenstein(push.g, away) / (INV_FOUR_PI * max(1.0 - push.straight, 1e-30));
    return vec4(max(diffuse, vec3(0.0)) + of_suns * mix(1.0, phase, directed), even.w);
}

#define OUTSIDE(radiance) max(radiance, vec3(0.0))
#include "ways.glsl"

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    Skies skies = all_skies();
    FOR_EACH(c, n_total(level)) {
        ivec3 at = place_of(level, c);
        vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
        vec3 to_eye = push.eye - push.grid.low - edges * (vec3(at) + 0.5);
        vec3 w = dot(to_eye, to_eye) > 0.0 ? normalize(to_eye) : vec3(0.0, 1.0, 0.0);
        // A cell at the eye's height has the horizon behind it: light must not jump there.
        float above = clamp(0.5 - to_eye.y / edges.y, 0.0, 1.0);
        vec4 own = sent_along(int(c), w);
        vec3 behind = radiance_along(level, at, w, above, skies);
        vec3 all = push.weakened * own.rgb + (1.0 - push.weakened) * behind;
        seen[c] = vec4(INV_FOUR_PI * all, own.w);
    }
}
