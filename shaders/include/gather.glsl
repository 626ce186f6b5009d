// One receiver and one source: what is read, and the form factor between them
// (model.md §7, passes.md "second"). Needs the buffers of second_gather.comp or
// second_tensor.comp.

const float PI_INVERSE = 0.318309886183791;

// A small number of lights is kept in registers; loops over them are unrolled.
#ifndef N_KEPT
#define N_KEPT 0
#endif
#if N_KEPT > 0
Light kept[N_KEPT];
#define N_LIGHTS uint(N_KEPT)
#define LIGHT(l) kept[l]
#define KEEP_LIGHTS \
    [[unroll]] for (uint l = 0u; l < N_LIGHTS; ++l) { kept[l] = lights[l]; }
#else
#define N_LIGHTS push.n_lights
#define LIGHT(l) lights[l]
#define KEEP_LIGHTS
#endif

// Shape of the facets of a region. A cloud's facets have no axes and are one cell.
struct FacetShape {
    vec3 half_u;
    vec3 half_v;
    float side;
    float area;
};

FacetShape facet_shape_of(Region emitter) {
    bool is_surface = emitter.kind == REGION_SURFACE;
    vec3 u = is_surface ? emitter.u / float(emitter.n_u) : vec3(0.0);
    vec3 v = is_surface ? emitter.v / float(emitter.n_v) : vec3(0.0);
    float uu = dot(u, u), vv = dot(v, v);
    return FacetShape(u, v, 2.0 * sqrt(max(uu, vv)), 4.0 * sqrt(uu * vv));
}

// A source as it is read from the buffers.
struct LoadedSource {
    vec3 position;
    float radius;
    vec3 flux;
    uint n_nodes;
    bool is_partly_shadowed;
    vec3 normal;
    float area;
    float total_area;
    // Second moments of a cluster: xx, yy, zz; xy, xz, yz.
    vec3 square;
    vec3 leaning;
};

LoadedSource load_source(uint i, Region emitter, FacetShape facet_shape) {
    int k = int(i) * 5;
    vec4 place = uintBitsToFloat(TEXEL(sources, k)),
         sent = uintBitsToFloat(TEXEL(sources, k + 1));
    LoadedSource s = LoadedSource(
        place.xyz, place.w, sent.xyz, 1u, sent.w < 0.0, emitter.normal, facet_shape.area,
        facet_shape.area, vec3(0.0), vec3(0.0)
    );
    // Surfaces' facets share normal and area, which need not be loaded.
    if (emitter.kind != REGION_SURFACE) {
        vec4 face = uintBitsToFloat(TEXEL(sources, k + 2));
        s.normal = face.xyz;
        // A facet without area would divide 0 by 0 where it is its own receiver.
        s.area = max(face.w, 1e-30);
        s.total_area = face.w;
    }
#if TREE
    s.n_nodes = uint(max(sent.w, 1.0));
    if (s.n_nodes > 1u) {
        vec4 extent = uintBitsToFloat(TEXEL(sources, k + 3));
        s.total_area = extent.x;
        s.square = extent.yzw;
        s.leaning = uintBitsToFloat(TEXEL(sources, k + 4).xyz);
    }
#endif
    return s;
}

// Returns source i's flux by light l, as second_sources.comp wrote it.
vec4 flux_at(uint i, uint l) {
    return uintBitsToFloat(TEXEL(fluxes, int(i * push.n_lights + l)));
}

Packed packed_samples_at(uint i, uint l) {
    int k = int(i * push.n_lights + l) * 2;
    return Packed(TEXEL(cell_samples, k), TEXEL(cell_samples, k + 1));
}

// The receiver: its place, the direction it reflects to, and its diffuse albedo over pi.
struct Receiver {
    vec3 position;
    vec3 normal;
    vec3 outgoing;
    vec3 albedo;
    Region region;
};

// 0 where the eye is behind the receiver: only the front side has a lobe.
float front;

// Returns cos cos/(d^2 + A/pi) of unit direction from receiver to source; 0 where either faces
// away.
float form(vec3 receiver_normal, vec3 source_normal, vec3 direction, float d2, float area) {
    float at_source = -dot(source_normal, direction), at_receiver = dot(receiver_normal, direction);
    return max(at_source, 0.0) * max(at_receiver, 0.0) / (d2 + area * PI_INVERSE);
}

// Returns the mean of cos cos/d^2 over a rectangle of half axes u and v about the end of unit
// direction w, to the second derivatives. Of (n_r x)(-n_s x)/|x|^4 along u it is 4 (-n_s w)[(n_r
// w)(6 (u w)^2 - u u) - 2 (n_r u)(u w)]/d^4, and the mean adds a sixth of it.
float rectangle_form(
    vec3 receiver_normal, vec3 source_normal, vec3 direction, float d2, vec3 u, vec3 v
) {
    float at_source = -dot(source_normal, direction), at_receiver = dot(receiver_normal, direction);
    vec2 along = vec2(dot(u, direction), dot(v, direction));
    vec2 leaning = vec2(dot(receiver_normal, u), dot(receiver_normal, v));
    float bent =
        at_receiver * (6.0 * dot(along, along) - dot(u, u) - dot(v, v)) - 2.0 * dot(leaning, along);
    bool faces = at_source > 0.0 && at_receiver > 0.0;
    return faces ? at_source * max(at_receiver + bent * 2.0 / (3.0 * d2), 0.0) / d2 : 0.0;
}

// Returns the number of occluders that are held in registers. The others are loaded in a loop of
// their own: where both sides of a condition are run, a loop that nothing enters costs one load of
// nothing.
uint n_loaded(OccluderList occluder_list) {
    return occluder_list.whole ? 0u : min(occluder_list.n, MAX_LOADED);
}

#if !WIDE
Region loaded_occluder(OccluderList occluder_list, uint k) {
    Region r = occluder_list.first;
    if (k == 1u) {
        r = occluder_list.second;
    }
    if (k == 2u) {
        r = occluder_list.third;
    }
    return r;
}
#endif

// Returns x: the share of a ball about q that the occluders leave visible from p; y: whether a
// shadow's edge crosses the ball. Nothing is looked at unless `wanted`.
vec2 visible_part(
    Pairing pairing, OccluderList occluder_list, vec3 p, vec3 q, float radius, bool wanted
) {
    uint n = wanted ? occluder_list.n : 0u, n_near = min(n, n_loaded(occluder_list));
    vec2 found = vec2(1.0, 0.0);
#if !WIDE
    for (uint k = 0u; k < n_near; ++k) {
        vec2 by = hides_ball(loaded_occluder(occluder_list, k), p, q, radius);
        found = vec2(found.x * (1.0 - by.x), max(found.y, by.y));
        n_iterations += 1u;
    }
#endif
    for (uint k = n_near; k < n; ++k) {
        vec2 by = hides_ball(region_at(occluder_of(pairing, occluder_list, k)), p, q, radius);
        found = vec2(found.x * (1.0 - by.x), max(found.y, by.y));
        n_iterations += 1u;
    }
    return found;
}

// Subtracts from each point of a cell the share of its part that n occluders hide.
void subtract_shadows(
    inout CellSamples seen, Pairing pairing, OccluderList occluder_list, vec3 p, Cell cell, uint n
) {
    uint n_near = min(n, n_loaded(occluder_list));
#if !WIDE
    for (uint k = 0u; k < n_near; ++k) {
        subtract_shadow(seen, loaded_occluder(occluder_list, k), p, 1.0, cell);
        n_iterations += 1u;
    }
#endif
    for (uint k = n_near; k < n; ++k) {
        subtract_shadow(seen, region_at(occluder_of(pairing, occluder_list, k)), p, 1.0, cell);
        n_iterations += 1u;
    }
}

#if MARCH
// Returns e^{-(1-g) tau} between p and q through the density grid. The part inside the grid's box
// is marched in equal steps with midpoint samples. Steps are no longer than the march's own and no
// more than the pair's greatest number.
float attenuation(vec3 p, vec3 q, bool wanted) {
    vec3 d = q - p;
    vec3 low = push.grid.low;
    vec3 high = low + cell_edges() * vec3(push.grid.n_cells);
    // A direction along an axis' planes divides by zero: infinities compare rightly, 0/0 is kept
    // out.
    vec3 inverse = 1.0 / mix(d, vec3(1e-30), equal(d, vec3(0.0)));
    vec3 a = (low - p) * inverse, b = (high - p) * inverse;
    vec3 nearer = min(a, b), farther = max(a, b);
    float enter = max(max(nearer.x, nearer.y), max(nearer.z, 0.0));
    float leave = min(min(farther.x, farther.y), min(farther.z, 1.0));
    float part = max(leave - enter, 0.0);
    float distance = part * length(d);
    uint n = wanted && distance > 0.0
                 ? clamp(uint(ceil(part * in_widths(d) / push.step_length)), 1u, push.pair_steps)
                 : 0u;
    float sum = 0.0;
    for (uint k = 0; k < n; ++k) {
        sum += density_at(p + d * (enter + part * (float(k) + 0.5) / float(n)));
        n_iterations += 1u;
    }
    float depth = n > 0u ? push.backward * sum * distance / float(n) : 0.0;
    return depth > 0.0 ? exp(-depth) : 1.0;
}
#endif

// Returns 1 - cos gamma of light l at a part of a source about p.
float gap_of(vec3 p, vec3 normal, vec3 outgoing, uint l) {
    return half_vector_gap(normal, arrival_at(LIGHT(l), p).toward, outgoing);
}
