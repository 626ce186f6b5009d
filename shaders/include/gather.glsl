// What one facet receives from one source (docs/model.md §7, §11 "second"). Needs the buffers of second_gather.comp
// or of second_tensor.comp.

const float PI_INVERSE = 0.318309886183791;

// The receiver: where it is, and whither it reflects.
struct Taker { vec3 position; vec3 normal; vec3 outgoing; Region region; };

// cos cos / (d^2 + A/pi) of unit `way` from receiver to source; 0 where either turns its back.
float form(vec3 receiver_normal, vec3 source_normal, vec3 way, float d2, float area) {
    float at_source = -dot(source_normal, way), at_receiver = dot(receiver_normal, way);
    return max(at_source, 0.0) * max(at_receiver, 0.0) / (d2 + area * PI_INVERSE);
}

// The mean of cos cos/d^2 over a rectangle of half axes u and v about the end of unit `way`, to the second derivatives: of
// (n_r x)(-n_s x)/|x|^4 along u it is 4 (-n_s w)[(n_r w)(6 (u w)^2 - u u) - 2 (n_r u)(u w)]/d^4, w the way, and the mean a
// sixth of it.
float rectangle_form(vec3 receiver_normal, vec3 source_normal, vec3 way, float d2, vec3 u, vec3 v) {
    float at_source = -dot(source_normal, way), at_receiver = dot(receiver_normal, way);
    vec2 along = vec2(dot(u, way), dot(v, way));
    vec2 leaning = vec2(dot(receiver_normal, u), dot(receiver_normal, v));
    float bent = at_receiver * (6.0 * dot(along, along) - dot(u, u) - dot(v, v)) - 2.0 * dot(leaning, along);
    bool faces = at_source > 0.0 && at_receiver > 0.0;
    return faces ? at_source * max(at_receiver + bent * 2.0 / (3.0 * d2), 0.0) / d2 : 0.0;
}

// What the veil hides of a ball about q: x, whether its middle is hidden; y, whether the rim of a shadow runs through it.
// Nothing is looked at where nothing would come. Two a turn: turns are counted (src/frame/exchange.rs).
bvec2 veils_ball(Pairing pairing, Veil veil, vec3 p, vec3 q, float radius, bool wanted) {
    uint n = wanted ? veil.n : 0u;
    bvec2 found = bvec2(false);
    for (uint k = 0u; k < n; k += 2u) {
        bvec2 a = hides_ball(regions[occluder_of(pairing, veil, k)], p, q, radius);
        bvec2 b = hides_ball(regions[occluder_of(pairing, veil, min(k + 1u, n - 1u))], p, q, radius);
        found = bvec2(found.x || a.x || b.x, found.y || a.y || b.y);
    }
    return found;
}

#if MARCH
// e^{-(1-g) tau} between p and q through the density grid: equal steps over what lies in the grid's box, no longer than
// the march's own and no more than the pair's greatest number, midpoint samples.
float attenuation(vec3 p, vec3 q, bool wanted) {
    vec3 d = q - p;
    vec3 low = push.grid.low;
    vec3 high = low + push.grid.cell * vec3(push.grid.n_cells);
    // A way along an axis' planes divides by zero: the infinities sort themselves out, 0/0 is kept out.
    vec3 inverse = 1.0 / mix(d, vec3(1e-30), equal(d, vec3(0.0)));
    vec3 a = (low - p) * inverse, b = (high - p) * inverse;
    vec3 nearer = min(a, b), farther = max(a, b);
    float enter = max(max(nearer.x, nearer.y), max(nearer.z, 0.0));
    float leave = min(min(farther.x, farther.y), min(farther.z, 1.0));
    float part = max(leave - enter, 0.0);
    float distance = part * length(d);
    uint n = wanted && distance > 0.0 ? clamp(uint(ceil(distance / push.step_length)), 1u, push.pair_steps) : 0u;
    float sum = 0.0;
    for (uint k = 0; k < n; ++k) {
        sum += density_at(p + d * (enter + part * (float(k) + 0.5) / float(n)));
    }
    float depth = n > 0u ? push.backward * sum * distance / float(n) : 0.0;
    return depth > 0.0 ? exp(-depth) : 1.0;
}
#endif

// A g of a part of a surface's facet for light l, as if the whole facet were lit as the part's middle p is: the facet's own
// mean would carry its shadows' rims to where a receiver touches it.
float cell_share(uint i_source, Source source, uint i_region, vec3 p, uint l) {
    Light light = lights[l];
    vec3 share = fluxes[i_source * push.n_lights + l].xyz;
    bool hidden = shadows_of(uint(share.z), p, 0.0, light, i_region, push.n_surfaces).x;
    return source.area * share_of(light, arrival_at(light, p), source.normal, hidden ? 0.0 : share.y);
}

// What it sends toward `outgoing` of light l: radiance times the facet's area.
vec3 cell_flux(float g, Source source, Region emitter, vec3 p, vec3 outgoing, uint l) {
    Light light = lights[l];
    bool shines = emitter.i_lobe != NO_LOBE && light.kind != LIGHT_SKY && g > 0.0;
    float lobe = shines ? lobe_between(emitter.i_lobe, source.normal, arrival_at(light, p).toward, outgoing) : 0.0;
    return light.energy * g * (emitter.kd * PI_INVERSE + emitter.ks * lobe);
}

// Whether the rim of a shadow runs through the ball about p, part of a facet on which some light falls.
bool is_lit_in_part(uint i_source, uint i_region, vec3 p, float radius, bool wanted) {
    uint n = wanted ? push.n_lights : 0u;
    bool torn = false;
    for (uint l = 0u; l < n; ++l) {
        vec3 share = fluxes[i_source * push.n_lights + l].xyz;
        torn = torn || shadows_of(uint(share.z), p, radius, lights[l], i_region, push.n_surfaces).y;
    }
    return torn;
}

// The lobe of a cell of a source toward `outgoing`, by light: radiance per area of the source times its whole area.
// `gap`: the least 1 - cos gamma of any light.
vec3 lobe_flux(uint i_source, Region emitter, vec3 p, vec3 normal, vec3 outgoing, out float gap) {
    vec3 sum = vec3(0.0);
    gap = 2.0;
    for (uint l = 0u; l < push.n_lights; ++l) {
        Light light = lights[l];
        float g = light.kind == LIGHT_SKY ? 0.0 : fluxes[i_source * push.n_lights + l].w;
        float w = half_vector_gap(normal, arrival_at(light, p).toward, outgoing);
        gap = g > 0.0 ? min(gap, w) : gap;
        sum += light.energy * (g * lobe_at(emitter.i_lobe, w));
    }
    return emitter.ks * sum;
}
