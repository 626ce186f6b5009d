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
// In: lights, and by cell what it sends out toward the eye of light that is not scattered straight
// on, S, beside its extinction. Out: by cell radiance and extinction. Law: s S + (1-s) L. L is the
// radiance that comes to the cell along the way to the eye. Error: some ulp.

// 1: the scene has surfaces or ground.
#ifndef SOLIDS
#define SOLIDS 0
#endif

layout(push_constant) uniform Push {
    Grid grid;
    // s
    vec3 weakened;
    uint n_lights;
    vec3 eye;
} push;
READS(0, Light, lights)
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(1, toward)
WRITES(2, vec4, seen)
#if SOLIDS
READS(3, vec4, faces)
#endif

#include "directions.glsl"
#include "sectors.glsl"
#include "faces.glsl"
#include "angle.glsl"
#include "sky.glsl"
#include "eye.glsl"

vec4 sent_along(int c, vec3 w) { return uintBitsToFloat(TEXEL(toward, c)); }

#define OUTSIDE(radiance) max(radiance, vec3(0.0))
#define FROM_SOLIDS(at, axis, side, d, above) between_sectors(at, axis, side, d, above)
#include "ways.glsl"

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    Skies skies = all_skies();
    FOR_EACH(c, n_total(level)) {
        ivec3 at = place_of(level, c);
        vec3 way = way_to_eye(push.grid, at, push.eye);
        vec3 w = toward_eye(push.grid, at, push.eye);
        // A cell at the eye's height has the horizon behind it: light must not jump there.
        float above = clamp(0.5 - way.y / (push.grid.cell * push.grid.aspect), 0.0, 1.0);
        vec4 own = sent_along(int(c), w);
        vec3 behind = radiance_along(level, at, w, above, skies);
        vec3 all = push.weakened * own.rgb + (1.0 - push.weakened) * behind;
        seen[c] = vec4(INV_FOUR_PI * all, own.w);
    }
}
