#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "light.glsl"
#include "medium.glsl"
#include "field.glsl"
#include "functions.glsl"

// Computes the radiance that clouds scatter toward the eye as a medium, and the first reflection of
// surfaces and ground (model.md §18, passes.md "scatter").
// In: facets, lights, optical depths [facet][light], regions, the lobe table, media by cloud; with
// DIFFUSE the diffuse light by cell. Out: fluence and radiance of every facet, linear RGB, and with
// SLOPES the relative slopes of the clouds' radiance, 1/length; with SOLIDS that of the box's
// patches.
// Law: albedo' sum E F sum_i a^i p(c^i g) e^{-b^i s tau}, and (phi + 3 g F.w) albedo'/4pi.

// 1: light is scattered further by diffusion.
#ifndef DIFFUSE
#define DIFFUSE 0
#endif
// 1: and the slopes of the light are wanted.
#ifndef SLOPES
#define SLOPES 0
#endif

// 1: and clouds have the light that the cells scatter toward the eye.
#ifndef SEEN
#define SEEN 0
#endif

// 1: and the scene has surfaces or ground.
#ifndef SOLIDS
#define SOLIDS 0
#endif

layout(push_constant) uniform Push {
    Grid grid;
    vec3 eye;
    uint n_facets;
    uint n_lights;
    uint n_solids;
    // Share of the depth that weakens light on its way to surfaces and ground: 1-g, with DIFFUSE s.
    float backward;
    uint n_terms;
    float term_light;
    float term_depth;
    float term_phase;
    float unused;
    // 1 over albedo (1-f) of the mean medium.
    vec3 inverse_scattered;
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
#if SEEN
// Radiance toward the eye and extinction by cell.
#if SLOPES && SOLIDS
TEXELS(10, seen)
#elif SLOPES || SOLIDS
TEXELS(9, seen)
#else
TEXELS(8, seen)
#endif
#endif

#include "first.glsl"
#if SOLIDS
// phi and the flux along each axis, by patch.
#if SLOPES
TEXELS(9, patches)
#else
TEXELS(8, patches)
#endif
#include "patches.glsl"
#include "angle.glsl"
#include "sky.glsl"
#endif

float arriving(float tau) {
    return tau < BARRED_DEPTH ? through(vec3(push.backward * tau)).x : 0.0;
}
#define ARRIVING(k) arriving(transmittance[k])
#define WITHOUT_SKY SOLIDS
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
    Weights of = weights_at(push.grid, p);
    vec4 sum = vec4(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        Corner to = corner_of(ivec3(push.grid.n_cells), of, corner);
        int c = 4 * to.i_cell;
        vec3 along =
            w.x * field_at(c + 1).rgb + w.y * field_at(c + 2).rgb + w.z * field_at(c + 3).rgb;
        sum += to.share * (field_at(c) + vec4(3.0 * g * along, 0.0));
    }
    return vec4(max(sum.rgb, vec3(0.0)), sum.w);
}
#endif

float mean_of(vec3 v) { return dot(v, vec3(1.0 / 3.0)); }

#if SLOPES
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

#if SEEN
// Returns radiance and extinction at p: trilinear between the cells' centres.
vec4 seen_at(vec3 p) {
    Weights of = weights_at(push.grid, p);
    vec4 sum = vec4(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        Corner to = corner_of(ivec3(push.grid.n_cells), of, corner);
        sum += to.share * uintBitsToFloat(TEXEL(seen, to.i_cell));
    }
    return sum;
}

// Places on a way to the eye on which a blob is seen, and their distance, sigma.
const int N_PLACES = 4;
const float APART = 1.2;
// Half the distance of the ways, sigma.
const float ASIDE = 1.0;

// Returns the radiance of a blob as the eye sees it through the cells, its mean over the channels,
// and `relative`, its change across the view.
vec3 seen_of(Facet facet, vec3 toward, out float mean, out vec3 relative) {
    float weight = 0.0, first = 0.0, apart = APART * facet.sigma;
    vec3 sum = vec3(0.0);
    vec3 other = abs(toward.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
    vec3 u = normalize(cross(toward, other)), v = cross(u, toward);
    for (int k = 0; k < 4; ++k) {
        vec3 aside = ASIDE * ((k & 1) == 0 ? u : -u) + ASIDE * ((k & 2) == 0 ? v : -v);
        float passed = 1.0;
        for (int i = 0; i < N_PLACES; ++i) {
            float z = APART * (0.5 * float(N_PLACES - 1) - float(i));
            vec4 here = seen_at(facet.position + facet.sigma * (z * toward + aside));
            float depth = here.w * apart, on = through(vec3(depth)).x;
            // The mean of e^-t over the step.
            float mean_passed = depth > 0.0 ? one_minus_exp(depth) / depth : 1.0;
            float w = exp(-0.5 * z * z) * passed * mean_passed;
            passed *= on;
            weight += w;
            first += w * z;
            sum += w * here.rgb;
        }
    }
    vec3 radiance = sum / weight, edges = push.grid.cell * vec3(1.0, push.grid.aspect, 1.0);
    vec3 p = facet.position + facet.sigma * (first / weight) * toward;
    mean = mean_of(radiance);
    relative = vec3(0.0);
#if SLOPES
    for (int axis = 0; axis < 3; ++axis) {
        vec3 half_step = vec3(0.0);
        half_step[axis] = 0.5 * edges[axis];
        vec3 rise = seen_at(p + half_step).rgb - seen_at(p - half_step).rgb;
        relative[axis] = mean_of(rise) / edges[axis];
    }
    relative = mean > 0.0 ? relative / mean : vec3(0.0);
    relative -= dot(relative, toward) * toward;
#endif
    return radiance;
}
#endif

#if SOLIDS
vec3 patch_value(uint k) { return uintBitsToFloat(TEXEL(patches, int(k))).rgb; }

// Returns the irradiance of a facet of a surface or ground by the sky and the light of the clouds.
// Inside of the box it is that of the cells, beyond a patch's edge that of the patches.
vec3 of_sky_and_clouds(uint j, Facet facet) {
    Skies skies = all_skies();
    bool is_roofed = false;
    for (uint l = 0; l < push.n_lights; ++l) {
        if (lights[l].kind == LIGHT_SKY) {
            bool is_barred = transmittance[j * push.n_lights + l] >= BARRED_DEPTH;
            is_roofed = is_roofed || (is_barred && any(notEqual(lights[l].energy, vec3(0.0))));
        }
    }
    if (is_roofed) {
        return skies.all;
    }
    vec3 extent = extent_of(push.grid), p = facet.position;
    vec3 nearest = clamp(p, push.grid.low, push.grid.low + extent);
    float edge = max(extent.x, max(extent.y, extent.z)) / float(PATCHES);
    float far = min(distance(p, nearest) / edge, 1.0);
    vec3 outside = sky_on(skies, facet.normal);
    for (uint face = 0; face < 6u; ++face) {
        // Where the facet is behind a face, none of its patches counts.
        Patch of_face = patch_at(push.grid, face * OF_FACE);
        bool is_seen = far > 0.0 && dot(p - of_face.center, of_face.outward) > 0.0;
        uint first = face * OF_FACE, end = is_seen ? first + OF_FACE : first;
        for (uint i = first; i < end; ++i) {
            Patch from = patch_at(push.grid, i);
            vec3 offset = from.center - p;
            float share = share_between(offset, from.outward, from.area, facet.normal);
            vec3 to = offset * inversesqrt(dot(offset, offset));
            vec3 along = to.x * patch_value(4u * i + 1u) + to.y * patch_value(4u * i + 2u)
                         + to.z * patch_value(4u * i + 3u);
            vec3 sent = 0.25 * max(patch_value(4u * i) - 3.0 * along, vec3(0.0));
            outside += share * (sent - sky_along(skies, to, offset.y > 0.0 ? 1.0 : 0.0));
        }
    }
    Weights of = weights_at(push.grid, nearest);
    vec3 inside = vec3(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        Corner to = corner_of(ivec3(push.grid.n_cells), of, corner);
        int c = 4 * to.i_cell;
        vec3 across = facet.normal.x * field_at(c + 1).rgb + facet.normal.y * field_at(c + 2).rgb
                      + facet.normal.z * field_at(c + 3).rgb;
        inside += to.share * (0.25 * field_at(c).rgb - 0.5 * across);
    }
    return mix(max(inside, vec3(0.0)), max(outside, vec3(0.0)), far);
}
#endif

void main() {
    FOR_EACH(j, push.n_facets) {
        Facet facet = facets[j];
        if (facet.i_region < push.n_solids) {
            Reflected r = reflected_by(j, facet, push.eye, push.n_lights);
#if SOLIDS
            vec3 more = of_sky_and_clouds(j, facet);
            r.irradiance += more;
            r.radiance += region_at(facet.i_region).kd * facet.color * more * INV_PI;
#endif
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
                fluence += e * through(tau * law.depth);
#if !SEEN
                // 1 - cos of the light's way and the way to the eye keeps its digits near 0.
                vec3 bend = a.toward + outgoing;
                radiance += e * toward_eye(m, law, 0.5 * dot(bend, bend), tau);
#endif
            }
        }
#if SEEN
        vec3 relative;
        float mean;
        radiance = seen_of(facet, outgoing, mean, relative);
        radiance *= law.albedo * law.depth * push.inverse_scattered;
        // The colour. Slices multiply it by the mean of the cells' light where they are.
        lit[j].indirect = mean > 0.0 ? radiance / mean : vec3(0.0);
#if SLOPES
        slopes[j].relative = relative;
        slopes[j].position = facet.position;
#endif
#elif DIFFUSE
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
