#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "functions.glsl"
#include "occlude.glsl"
#include "diffusion.glsl"

// Computes the light of suns and lamps that is scattered for the first time in every cell
// (model.md §18, passes.md "diffusion").
// In: lights, regions, the density grid (1/length). Out: by cell Q0 (W/m^3), and q = 3 D Q1 along
// each axis (W/m^2). Law: Q0 = albedo (1-f) sigma U, Q1 = albedo (g-f) sigma F of the light that
// arrives, weakened by e^{-s tau}. The mean of U over the channels stands beside Q0. With SOLIDS q
// has D c times the flux of the sky, too, weakened by e^{-(1-albedo g) tau}. Bound: that of the
// march.

// 1: U is wanted in cells without extinction, too.
#ifndef SLOPES
#define SLOPES 0
#endif

// 1: bounces follow, which begin with what suns and lamps make every cell send out.
#ifndef BOUNCES
#define BOUNCES 0
#endif

// 1: the scene has surfaces or ground, which the sky reaches through the grid.
#ifndef SOLIDS
#define SOLIDS 0
#endif

layout(push_constant) uniform Push {
    Grid grid;
    vec3 albedo;
    float inverse_chord;
    float g;
    float straight;
    uint n_lights;
    uint n_surfaces;
    float step_length;
    uint max_steps;
    float densest;
} push;
READS(0, Light, lights)
TEXELS(1, regions)
#include "regions.glsl"
FLOATS(2, density)
// By cell: Q0, q along x, y and z.
WRITES(3, vec4, field)
#if BOUNCES
WRITES(4, vec4, arrived)
#endif

#include "sum.glsl"
#include "density.glsl"
#include "reach.glsl"
#include "march.glsl"
#include "medium.glsl"
#include "angle.glsl"
#include "sky.glsl"

// Returns the length of the way through the middle of a cell.
float chord_of(vec3 toward) {
    vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
    vec3 across = edges / max(abs(toward), vec3(1e-6));
    return min(across.x, min(across.y, across.z));
}

// Light of a beam in a cell: its mean, and the share of what is scattered that would make as much
// phi deep in the cloud if it were scattered at the cell's middle.
struct InCell {
    vec3 mean;
    vec3 share;
};

// Returns light in a cell behind the optical depth `front`, with `own` from face to face, of which
// `counted` counts for diffusion. The factors are those of the depth that weakens the beam, and of
// the depth that diffusion counts.
InCell in_cell(float front, float own, float counted, vec3 weakened, vec3 kept) {
    vec3 depth = own * weakened;
    InCell of = InCell(vec3(1.0), vec3(1.0));
    for (int k = 0; k < 3; ++k) {
        float t = depth[k];
        float absorbed = one_minus_exp(t);
        // The mean place of what is scattered, as a share of the way. The series errs by t^3/720.
        float place = t < 0.0625 ? 0.5 - t * (1.0 / 12.0) : 1.0 / t - (1.0 - absorbed) / absorbed;
        of.mean[k] = t > 0.0 ? absorbed / (counted * weakened[k]) : 1.0;
        of.share[k] = (2.0 + 3.0 * kept[k] * (front + min(place * own, 0.5 * counted)))
                      / (2.0 + 3.0 * kept[k] * (front + 0.5 * counted));
    }
    of.mean *= through(front * weakened);
    return of;
}

void main() {
    Level level = Level(push.grid.n_cells, 0u);
    FOR_EACH(c, n_total(level)) {
        vec3 at = vec3(place_of(level, c)) + 0.5;
        vec3 p = push.grid.low + push.grid.cell * vec3(1.0, push.grid.aspect, 1.0) * at;
        float whole = cell_at(int(c)), sigma = min(whole, push.densest);
        vec3 weakened = 1.0 - push.albedo * push.straight;
        vec3 kept = 1.0 - push.albedo * push.g;
        vec3 fluence = vec3(0.0), from_middle = vec3(0.0);
        // Flux of the skies along x, y and z.
        vec3 fallen[3] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0)), direct = vec3(0.0);
        vec3 x = vec3(0.0), y = vec3(0.0), z = vec3(0.0);
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            bool is_sky = light.kind == LIGHT_SKY;
            bool is_wanted = is_sky ? SOLIDS != 0 : SLOPES + BOUNCES != 0 || sigma > 0.0;
            bool is_on = is_wanted && any(notEqual(light.energy, vec3(0.0)));
            if (is_on && is_clear(p, light, 0xFFFFFFFFu, push.n_surfaces)) {
                Arrival a = arrival_at(light, p);
                float tau = depth_along(p, a.toward, a.distance, true);
                if (is_sky) {
                    vec3 e = light.energy * through(tau * kept);
                    fallen[0] -= MEAN_UP * light.tilt_x * e;
                    fallen[1] -= e;
                    fallen[2] -= MEAN_UP * light.tilt_z * e;
                } else {
                    vec3 e = light.energy * a.falloff;
                    direct += e * through(tau * weakened);
                    // Where the march finds less than half of the cell, light is whole at the face.
                    float chord = chord_of(a.toward), front = max(tau - 0.5 * whole * chord, 0.0);
                    InCell of = in_cell(front, whole * chord, sigma * chord, weakened, kept);
                    e *= of.mean;
                    fluence += e;
                    from_middle += of.share * e;
                    x -= e * a.toward.x;
                    y -= e * a.toward.y;
                    z -= e * a.toward.z;
                }
            }
        }
        vec3 reach = 1.0 / (3.0 * sigma * kept + push.inverse_chord);
        vec3 carried = 3.0 * reach * push.albedo * (push.g - push.straight) * sigma;
        vec3 scattered = push.albedo * (1.0 - push.straight) * sigma * from_middle;
        field[4 * c] = vec4(scattered, dot(direct, vec3(1.0 / 3.0)));
        vec3 bounded = reach * push.inverse_chord;
        field[4 * c + 1] = vec4(carried * x + bounded * fallen[0], 0.0);
        field[4 * c + 2] = vec4(carried * y + bounded * fallen[1], 0.0);
        field[4 * c + 3] = vec4(carried * z + bounded * fallen[2], 0.0);
#if BOUNCES
        // Also where nothing scatters yet: the cells about have a mixture.
        vec3 share = push.albedo * (1.0 - push.straight) / max(weakened, vec3(1e-30));
        arrived[4 * c] = vec4(share * fluence, sigma);
        arrived[4 * c + 1] = vec4(share * x, 0.0);
        arrived[4 * c + 2] = vec4(share * y, 0.0);
        arrived[4 * c + 3] = vec4(share * z, 0.0);
#endif
    }
}
