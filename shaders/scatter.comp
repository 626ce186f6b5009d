#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "medium.glsl"

// Computes the radiance that clouds scatter toward the eye as a medium, and the first reflection of
// surfaces and ground (model.md §18, passes.md "scatter").
// In: facets, lights, optical depths [facet][light], regions, the lobe table, media by cloud; with
// DIFFUSE the diffuse light by cell. Out: fluence and radiance of every facet, linear RGB, and with
// SLOPES the relative slopes of the clouds' radiance, 1/length.
// Law: albedo' sum E F sum_i a^i p(c^i g) e^{-b^i s tau}, and (phi + 3 g F.w) albedo'/4pi.

// 1: light is scattered further by diffusion.
#ifndef DIFFUSE
#define DIFFUSE 0
#endif
// 1: and the slopes of the light are wanted.
#ifndef SLOPES
#define SLOPES 0
#endif

layout(push_constant) uniform Push {
    Grid grid;
    vec3 eye;
    uint n_facets;
    uint n_lights;
    uint n_solids;
    // 1-g on the way to surfaces and ground.
    float backward;
    uint n_terms;
    float term_light;
    float term_depth;
    float term_phase;
} push;
UPDATES(5, Lit, lit)
READS(6, Medium, media)
// phi beside U, and the flux along each axis, by cell.
#if DIFFUSE
// Texels, which llvmpipe fetches for all invocations at once.
TEXELS(7, field)
#endif
#if SLOPES
WRITES(8, Slope, slopes)
#endif

#include "first.glsl"

float arriving(float tau) {
    return tau < BARRED_DEPTH ? through(vec3(push.backward * tau)).x : 0.0;
}
#define ARRIVING(k) arriving(transmittance[k])
#include "reflect.glsl"

// Returns the share of a light that is scattered per solid angle at 1 - cos = away.
vec3 toward_eye(Medium m, Law law, float away, float tau) {
    vec3 sum = vec3(0.0);
    float light = 1.0, depth = 1.0, phase = 1.0;
    for (uint i = 0; i < push.n_terms; ++i) {
        sum += light * phase_at(m, phase, away) * through(depth * tau * law.depth);
        light *= push.term_light;
        depth *= push.term_depth;
        phase *= push.term_phase;
    }
    return law.albedo * sum;
}

// Returns the share of a sky's irradiance over pi that is scattered to where `up` is the cosine to
// the zenith.
vec3 of_sky(Medium m, Law law, float up, float constant, float tau) {
    vec3 sum = vec3(0.0);
    float light = 1.0, depth = 1.0, phase = 1.0;
    for (uint i = 0; i < push.n_terms; ++i) {
        float share = 0.5 - (forward_half(phase * m.mean) - 0.5) * up;
        sum += light * (share + constant) * through(depth * tau * law.depth);
        light *= push.term_light;
        depth *= push.term_depth;
        phase *= push.term_phase;
    }
    return law.albedo * sum;
}

#if DIFFUSE
vec4 field_at(int k) { return uintBitsToFloat(TEXEL(field, k)); }

// Returns phi + 3 g F.w, at least 0, and U at p: trilinear between the cells' centres and beyond
// the outermost as on them.
vec4 diffuse_along(vec3 p, vec3 w, float g) {
    ivec3 n = ivec3(push.grid.n_cells);
    vec3 at = (p - push.grid.low) * push.grid.inv_cell * vec3(1.0, push.grid.inv_aspect, 1.0) - 0.5;
    at = clamp(at, vec3(0.0), vec3(n - 1));
    ivec3 base = ivec3(at);
    vec3 part = at - vec3(base);
    vec4 sum = vec4(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        ivec3 to = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
        vec3 share = mix(1.0 - part, part, equal(to, ivec3(1)));
        ivec3 i = min(base + to, n - 1);
        int c = 4 * (i.x + n.x * (i.y + n.y * i.z));
        vec3 along =
            w.x * field_at(c + 1).rgb + w.y * field_at(c + 2).rgb + w.z * field_at(c + 3).rgb;
        sum += share.x * share.y * share.z * (field_at(c) + vec4(3.0 * g * along, 0.0));
    }
    return vec4(max(sum.rgb, vec3(0.0)), sum.w);
}
#endif

#if SLOPES
float mean_of(vec3 v) { return dot(v, vec3(1.0 / 3.0)); }

// Returns the change of the light along each axis, relative to it: differences over a cell, of U
// for the light that is scattered once.
vec3 slope_at(vec3 p, vec3 w, float g, vec3 albedo, vec3 once, vec3 diffuse) {
    vec3 edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
    float first = mean_of(once), all = first + mean_of(diffuse);
    vec3 rise = vec3(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        vec3 half_step = vec3(0.0);
        half_step[axis] = 0.5 * edges[axis];
        vec4 after = diffuse_along(p + half_step, w, g), prior = diffuse_along(p - half_step, w, g);
        float both = after.w + prior.w;
        rise[axis] = INV_FOUR_PI * mean_of(albedo * (after.rgb - prior.rgb));
        rise[axis] += both > 0.0 ? 2.0 * first * (after.w - prior.w) / both : 0.0;
    }
    return all > 0.0 ? rise / (all * edges) : vec3(0.0);
}
#endif

void main() {
    FOR_EACH(j, push.n_facets) {
        Facet facet = facets[j];
        if (facet.i_region < push.n_solids) {
            Reflected r = reflected_by(j, facet, push.eye, push.n_lights);
            lit[j].direct = r.irradiance;
            lit[j].first = r.radiance;
            return;
        }
        Medium m = media[facet.i_region - push.n_solids];
        Law law = law_of(m, facet.color);
        vec3 to_eye = push.eye - facet.position;
        float distance = length(to_eye);
        vec3 outgoing = distance > 0.0 ? to_eye / distance : vec3(0.0, 1.0, 0.0);
        vec3 fluence = vec3(0.0), radiance = vec3(0.0);
        for (uint l = 0; l < push.n_lights; ++l) {
            Light light = lights[l];
            float tau = transmittance[j * push.n_lights + l];
            if (tau >= BARRED_DEPTH) {
                continue;
            }
            if (light.kind == LIGHT_SKY) {
#if !DIFFUSE
                radiance += light.energy * INV_PI
                            * of_sky(m, law, outgoing.y, light.constant, tau);
#endif
            } else {
                Arrival a = arrival_at(light, facet.position);
                vec3 e = light.energy * a.falloff;
                // 1 - cos of the light's way and the way to the eye keeps its digits near 0.
                vec3 bend = a.toward + outgoing;
                fluence += e * through(tau * law.depth);
                radiance += e * toward_eye(m, law, 0.5 * dot(bend, bend), tau);
            }
        }
#if DIFFUSE
        vec3 diffuse =
            law.albedo * diffuse_along(facet.position, outgoing, m.mean).rgb * INV_FOUR_PI;
#if SLOPES
        slopes[j].relative =
            slope_at(facet.position, outgoing, m.mean, law.albedo, radiance, diffuse);
        slopes[j].position = facet.position;
#endif
        radiance += diffuse;
#endif
        lit[j].direct = fluence;
        lit[j].first = radiance;
    }
}
