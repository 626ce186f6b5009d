// What one facet receives from one source (docs/model.md §7, §11 "second"). Needs the buffers of
// second_gather.comp or of second_tensor.comp.

const float PI_INVERSE = 0.318309886183791;

// Lights that are few are kept at hand; loops over them are then unrolled.
#ifndef N_KEPT
#define N_KEPT 0
#endif
#if N_KEPT > 0
Light kept[N_KEPT];
#define N_LIGHTS uint(N_KEPT)
#define LIGHT(l) kept[l]
#define KEEP_LIGHTS [[unroll]] for (uint l = 0u; l < N_LIGHTS; ++l) { kept[l] = lights[l]; }
#else
#define N_LIGHTS push.n_lights
#define LIGHT(l) lights[l]
#define KEEP_LIGHTS
#endif

// What the facets of a region have in common. A cloud's facets have no axes and are one cell.
struct Pane { vec3 half_u; vec3 half_v; float side; float area; };

Pane pane_of(Region emitter) {
    bool is_surface = emitter.kind == REGION_SURFACE;
    vec3 u = is_surface ? emitter.u / float(emitter.n_u) : vec3(0.0);
    vec3 v = is_surface ? emitter.v / float(emitter.n_v) : vec3(0.0);
    float uu = dot(u, u), vv = dot(v, v);
    return Pane(u, v, 2.0 * sqrt(max(uu, vv)), 4.0 * sqrt(uu * vv));
}

// A source as it is needed.
struct Sender {
    vec3 position;
    float radius;
    vec3 flux;
    uint n_nodes;
    bool in_part;
    vec3 normal;
    float area;
    float total_area;
    // Of a cluster its second moments: xx, yy, zz; xy, xz, yz.
    vec3 square;
    vec3 leaning;
};

Sender sender_at(uint i, Region emitter, Pane pane) {
    int k = int(i) * 5;
    vec4 place = uintBitsToFloat(texelFetch(sources, k)), sent = uintBitsToFloat(texelFetch(sources, k + 1));
    Sender s = Sender(place.xyz, place.w, sent.xyz, 1u, sent.w < 0.0, emitter.normal, pane.area, pane.area, vec3(0.0), vec3(0.0));
    // Where it need not be loaded it is not.
    if (emitter.kind != REGION_SURFACE) {
        vec4 face = uintBitsToFloat(texelFetch(sources, k + 2));
        s.normal = face.xyz;
        s.area = face.w;
        s.total_area = face.w;
    }
#if TREE
    s.n_nodes = uint(max(sent.w, 1.0));
    if (s.n_nodes > 1u) {
        vec4 extent = uintBitsToFloat(texelFetch(sources, k + 3));
        s.total_area = extent.x;
        s.square = extent.yzw;
        s.leaning = uintBitsToFloat(texelFetch(sources, k + 4).xyz);
    }
#endif
    return s;
}

// Of light l: what second_sources.comp leaves.
vec4 flux_at(uint i, uint l) { return uintBitsToFloat(texelFetch(fluxes, int(i * push.n_lights + l))); }

Packed stencil_at(uint i, uint l) {
    int k = int(i * push.n_lights + l) * 2;
    return Packed(texelFetch(stencils, k), texelFetch(stencils, k + 1));
}

// The receiver: where it is, whither it reflects, and how much diffusely.
struct Taker { vec3 position; vec3 normal; vec3 outgoing; vec3 albedo; Region region; };

// cos cos / (d^2 + A/pi) of unit `way` from receiver to source; 0 where either turns its back.
float form(vec3 receiver_normal, vec3 source_normal, vec3 way, float d2, float area) {
    float at_source = -dot(source_normal, way), at_receiver = dot(receiver_normal, way);
    return max(at_source, 0.0) * max(at_receiver, 0.0) / (d2 + area * PI_INVERSE);
}

// The mean of cos cos/d^2 over a rectangle of half axes u and v about the end of unit `way`, to the
// second derivatives: of (n_r x)(-n_s x)/|x|^4 along u it is 4 (-n_s w)[(n_r w)(6 (u w)^2 - u u) -
// 2 (n_r u)(u w)]/d^4, w the way, and the mean a sixth of it.
float rectangle_form(vec3 receiver_normal, vec3 source_normal, vec3 way, float d2, vec3 u, vec3 v) {
    float at_source = -dot(source_normal, way), at_receiver = dot(receiver_normal, way);
    vec2 along = vec2(dot(u, way), dot(v, way));
    vec2 leaning = vec2(dot(receiver_normal, u), dot(receiver_normal, v));
    float bent = at_receiver * (6.0 * dot(along, along) - dot(u, u) - dot(v, v)) - 2.0 * dot(leaning, along);
    bool faces = at_source > 0.0 && at_receiver > 0.0;
    return faces ? at_source * max(at_receiver + bent * 2.0 / (3.0 * d2), 0.0) / d2 : 0.0;
}

// What is at hand of a veil; the rest is loaded, in loops of its own: where both sides of a
// condition are run, a loop that nothing enters costs the loading of nothing, once.
uint at_hand(Veil veil) { return veil.whole ? 0u : min(veil.n, N_AT_HAND); }

Region veiling_at(Veil veil, uint k) {
    Region r = veil.first;
    if (k == 1u) {
        r = veil.second;
    }
    if (k == 2u) {
        r = veil.third;
    }
    return r;
}

// What the veil leaves of a ball about q: x, the share of it that is seen; y, whether the rim of a
// shadow runs through it. Nothing is looked at where nothing would come.
vec2 veils_ball(Pairing pairing, Veil veil, vec3 p, vec3 q, float radius, bool wanted) {
    uint n = wanted ? veil.n : 0u, n_near = min(n, at_hand(veil));
    vec2 found = vec2(1.0, 0.0);
    for (uint k = 0u; k < n_near; ++k) {
        vec2 by = hides_ball(veiling_at(veil, k), p, q, radius);
        found = vec2(found.x * (1.0 - by.x), max(found.y, by.y));
        n_turns += 1u;
    }
    for (uint k = n_near; k < n; ++k) {
        vec2 by = hides_ball(region_at(occluder_of(pairing, veil, k)), p, q, radius);
        found = vec2(found.x * (1.0 - by.x), max(found.y, by.y));
        n_turns += 1u;
    }
    return found;
}

// Takes from each point of a cell what the veil hides of its part.
void shade_all(inout Stencil seen, Pairing pairing, Veil veil, vec3 p, Cell cell, uint n) {
    uint n_near = min(n, at_hand(veil));
    for (uint k = 0u; k < n_near; ++k) {
        shade(seen, veiling_at(veil, k), p, 1.0, cell);
        n_turns += 1u;
    }
    for (uint k = n_near; k < n; ++k) {
        shade(seen, region_at(occluder_of(pairing, veil, k)), p, 1.0, cell);
        n_turns += 1u;
    }
}

#if MARCH
// e^{-(1-g) tau} between p and q through the density grid: equal steps over what lies in the grid's
// box, no longer than the march's own and no more than the pair's greatest number, midpoint
// samples.
float attenuation(vec3 p, vec3 q, bool wanted) {
    vec3 d = q - p;
    vec3 low = push.grid.low;
    vec3 high = low + cell_edges() * vec3(push.grid.n_cells);
    // A way along an axis' planes divides by zero: the infinities sort themselves out, 0/0 is kept
    // out.
    vec3 inverse = 1.0 / mix(d, vec3(1e-30), equal(d, vec3(0.0)));
    vec3 a = (low - p) * inverse, b = (high - p) * inverse;
    vec3 nearer = min(a, b), farther = max(a, b);
    float enter = max(max(nearer.x, nearer.y), max(nearer.z, 0.0));
    float leave = min(min(farther.x, farther.y), min(farther.z, 1.0));
    float part = max(leave - enter, 0.0);
    float distance = part * length(d);
    uint n = wanted && distance > 0.0 ? clamp(uint(ceil(part * in_widths(d) / push.step_length)), 1u, push.pair_steps) : 0u;
    float sum = 0.0;
    for (uint k = 0; k < n; ++k) {
        sum += density_at(p + d * (enter + part * (float(k) + 0.5) / float(n)));
        n_turns += 1u;
    }
    float depth = n > 0u ? push.backward * sum * distance / float(n) : 0.0;
    return depth > 0.0 ? exp(-depth) : 1.0;
}
#endif

// 1 - cos gamma of light l at a part of a source about p.
float gap_of(vec3 p, vec3 normal, vec3 outgoing, uint l) {
    return half_vector_gap(normal, arrival_at(LIGHT(l), p).toward, outgoing);
}
