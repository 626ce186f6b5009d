// How a receiver goes through a region's sources: facet by facet, and a facet too wide for its distance cell by cell
// (docs/model.md §7, §11 "second"). Needs gather.glsl.

// A lobe is met within this many of its widths (e^-8 of its peak beyond).
const float LOBE_REACH = 4.0;
// Cells no wider than this many widths of a lobe, times pair_size: at the default 0.5 the half vector turns by 3/4 of a
// width from one to the next, and the midpoint rule on a Gaussian is then exact to 1e-7.
const float LOBE_STEP = 3.0;
// The half vector turns by at most this share of a cell's width over its distance between its centre and its corner: half
// the direction's turn, of half a diagonal of sqrt 2; twice that where the light is as near as the receiver.
const float TURN = 0.75;
// A cluster that a shadow's rim runs through is opened down to this share of the opening angle's diameter.
const float TORN = 0.5;
// Cells wider than this share of their distance are discs to their receiver.
const float NEAR = 1.0;
// A cell that a shadow's rim runs through is quartered down to this share of pair_size.
const float RIM = 0.125;
// A cluster whose mean normal is at least this long has, but for rounding, a single normal.
const float EVEN = 0.9999;
// Cells of one facet that are looked at, at most: no scene holds a device longer than its watchdog waits.
const uint MAX_STEPS = 65536u;

// What the cells of a region's facets have in common. A cloud's facets have no axes and are one cell.
struct Pane { vec3 half_u; vec3 half_v; float side; };

Pane pane_of(Region emitter) {
    bool is_surface = emitter.kind == REGION_SURFACE;
    vec3 u = is_surface ? emitter.u / float(emitter.n_u) : vec3(0.0);
    vec3 v = is_surface ? emitter.v / float(emitter.n_v) : vec3(0.0);
    return Pane(u, v, 2.0 * sqrt(max(dot(u, u), dot(v, v))));
}

// Source s of the region, and cell `at` of the 4^level it is divided into, in Z order.
struct Walk { uint s; uint level; uvec2 at; uint n_steps; };

Walk start_walk() { return Walk(0u, 0u, uvec2(0u), 0u); }

// 2^-level.
float cell_scale(uint level) { return uintBitsToFloat((127u - level) << 23); }

// Into the cell's first quarter or the cluster's first child, or on to the next cell, or, after a facet's last, to the next
// source: past the `n_nodes` of this one's subtree, 1 for a facet.
Walk advance(Walk walk, bool split, uint n_nodes) {
    // Last quarters of last quarters are done together.
    uint up = min(uint(findLSB(~(walk.at.x & walk.at.y))), walk.level);
    uint level = walk.level - up;
    uvec2 at = walk.at >> up;
    bool odd = (at.x & 1u) != 0u;
    uvec2 next = odd ? uvec2(at.x - 1u, at.y + 1u) : uvec2(at.x + 1u, at.y);
    bool enters = split && n_nodes > 1u;
    bool done = enters || (!split && level == 0u);
    next = done ? uvec2(0u) : next;
    bool quarters = split && !enters;
    return Walk(
        walk.s + (done ? (enters ? 1u : n_nodes) : 0u), quarters ? walk.level + 1u : level, quarters ? walk.at * 2u : next,
        done ? 0u : walk.n_steps + 1u);
}

// A cell as the receiver sees it.
struct View {
    vec3 position;
    vec3 way;
    // Width over distance.
    float width;
    // cos cos / (d^2 + A/pi), times the cell's part of its facet.
    float share;
    // Radiance toward the receiver times the facet's area.
    vec3 leaving;
    // Least 1 - cos gamma at the emitter, and at the receiver.
    float emitter_gap;
    float taker_gap;
    // Wider than asked for; and to be quartered.
    bool wide;
    bool split;
};

#if TREE
// The mean of cos cos/d^2 over a cluster whose mean square distance from its middle is `extent` d^2: the middle's value and
// the second derivatives' share. A surface's cluster lies in its plane (half of the spread an axis), a cloud's is as deep
// as it is wide (a third an axis).
float cluster_form(vec3 receiver_normal, vec3 source_normal, vec3 way, float d2, float extent, uint kind) {
    float at_source = -dot(source_normal, way), at_receiver = dot(receiver_normal, way);
    float turned = dot(receiver_normal, source_normal);
    float bent = kind == REGION_SURFACE
        ? 2.0 * extent * at_source * (at_receiver - turned * at_source - 3.0 * at_receiver * at_source * at_source)
        : -extent * (turned + 2.0 * at_source * at_receiver) / 3.0;
    bool faces = at_source > 0.0 && at_receiver > 0.0;
    return faces ? max(at_source * at_receiver + bent, 0.0) / d2 : 0.0;
}
#endif

bool is_met(float gap, float turn, float lobe_width) { return sqrt(2.0 * gap) < turn + LOBE_REACH * lobe_width; }

View look(Source source, uint i, uint n_nodes, Walk walk, Pane pane, Region emitter, Taker taker) {
    View view;
#if TREE
    bool is_cluster = n_nodes > 1u;
    pane.half_u = is_cluster ? vec3(0.0) : pane.half_u;
    pane.half_v = is_cluster ? vec3(0.0) : pane.half_v;
    pane.side = is_cluster ? 2.0 * source.radius : pane.side;
    vec3 face = is_cluster ? source.normal * inversesqrt(max(dot(source.normal, source.normal), 1e-30)) : source.normal;
    // A cluster is opened by its radius, and where its facets look different ways.
    float limit = is_cluster ? 2.0 * push.theta : push.pair_size;
    float lobe_limit = is_cluster ? LOBE_STEP * push.theta : LOBE_STEP * push.pair_size;
#else
    vec3 face = source.normal;
    float limit = push.pair_size;
    float lobe_limit = LOBE_STEP * push.pair_size;
#endif
    float scale = cell_scale(walk.level);
    vec2 at = (2.0 * vec2(walk.at) + 1.0) * scale - 1.0;
    view.position = source.position + at.x * pane.half_u + at.y * pane.half_v;
    vec3 offset = view.position - taker.position;
    float d2 = dot(offset, offset);
    float inverse = inversesqrt(max(d2, 1e-30));
    view.way = offset * inverse;
    float part = scale * scale;
    view.width = pane.side * scale * inverse;
    // The disc's factor where the derivatives' series would not do; a cloud's facet is a disc.
    view.share = part * (view.width > 0.0 && view.width <= NEAR
        ? rectangle_form(taker.normal, source.normal, view.way, d2, scale * pane.half_u, scale * pane.half_v)
        : form(taker.normal, source.normal, view.way, d2, part * source.area));
#if TREE
    float extent = source.spread / max(d2, 1e-30);
    view.share = is_cluster ? cluster_form(taker.normal, source.normal, view.way, d2, extent, emitter.kind) : view.share;
#endif
    view.leaving = source.flux;
    float excess = view.width / limit;
#if TREE
    // What a cluster's extent may change of its form factor: in the square of radius over distance, and the cosines.
    float tilt = 0.5 * view.width;
    float at_taker = max(dot(taker.normal, view.way) + tilt, 0.0);
    float at_source = max(-dot(source.normal, view.way), 0.0) + 1.0 - length(source.normal);
    float wrong = tilt * tilt * min(at_taker, 1.0) * at_source * source.total_area * inverse * inverse;
    float allowed = push.theta * push.theta;
    excess = is_cluster ? (tilt > 1.0 ? 2.0 : wrong / (allowed * allowed)) : excess;
#endif
    float turn = TURN * view.width;
    view.emitter_gap = 2.0;
    uint n_shiny = emitter.i_lobe == NO_LOBE ? 0u : 1u;
    for (uint g = 0u; g < n_shiny; ++g) {
        view.leaving += lobe_flux(i, emitter, view.position, face, -view.way, view.emitter_gap);
        bool met = is_met(view.emitter_gap, turn, emitter.lobe_width);
        excess = max(excess, met ? view.width / (lobe_limit * emitter.lobe_width) : 0.0);
    }
    view.taker_gap = 2.0;
#if GLOSSY
    view.taker_gap = half_vector_gap(taker.normal, view.way, taker.outgoing);
    bool met = is_met(view.taker_gap, turn, taker.region.lobe_width);
    excess = max(excess, met ? view.width / (lobe_limit * taker.region.lobe_width) : 0.0);
#endif
    // Some of the cell may be before the receiver; the receiver is before all of it or none.
    bool before = dot(taker.normal, offset) > -pane.side * scale;
    bool faces = dot(source.normal, offset) < 0.0;
#if TREE
    // A cluster with normals of its own each may send what its mean does not say.
    faces = faces || (is_cluster && dot(source.normal, source.normal) < EVEN * EVEN);
    view.split = before && faces && excess > 1.0 && (is_cluster || (walk.level < push.pair_levels && walk.n_steps < MAX_STEPS));
    view.wide = before && faces && excess > 1.0 && !is_cluster;
#else
    view.wide = before && faces && excess > 1.0;
    view.split = view.wide && walk.level < push.pair_levels && walk.n_steps < MAX_STEPS;
#endif
    return view;
}
