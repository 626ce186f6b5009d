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
// The opening angle of clouds' clusters over that of surfaces': their facets overlap and look every way, so that they need
// it this much smaller for the same error, 1 % of L2 at theta = 0.4.
const float CLOUD_THETA = 0.4;
// Where a cluster's normals differ, those nearer to the receiver may be those that face it: an error of the first order,
// of this share of radius over distance times the normals' spread.
const float MIXED = 0.5;
// Cells wider than this share of their distance are discs to their receiver.
const float NEAR = 1.0;
// A cell that a shadow's rim runs through is quartered down to this share of pair_size.
const float RIM = 0.5;
// A cluster whose mean normal is at least this long has, but for rounding, a single normal.
const float EVEN = 0.9999;

// What the cells of a region's facets have in common. A cloud's facets have no axes and are one cell.
struct Pane { vec3 half_u; vec3 half_v; float side; };

Pane pane_of(Region emitter) {
    bool is_surface = emitter.kind == REGION_SURFACE;
    vec3 u = is_surface ? emitter.u / float(emitter.n_u) : vec3(0.0);
    vec3 v = is_surface ? emitter.v / float(emitter.n_v) : vec3(0.0);
    return Pane(u, v, 2.0 * sqrt(max(dot(u, u), dot(v, v))));
}

// Source s of the region, and cell `at` of the 4^level it is divided into, in Z order.
struct Walk { uint s; uint level; uvec2 at; };

Walk start_walk(uint s) { return Walk(s, 0u, uvec2(0u)); }

// Sources and cells that this dispatch may still look at: a driver may end a loop after some ten thousand turns without a
// word, so the walk goes on in another where it ended in this one.
uint n_sources_left = STEPS;
uint n_cells_left = CELLS;
// Facets whose cells a driver cut short all the same.
float n_cut = 0.0;

// Facets set aside for a closer look, so that what they take is not gone through for every facet: a device that runs both
// sides of a condition runs an empty loop at least once.
const uint MAX_ASIDE = 8u;

// Where the walk through a pairing's sources begins, `reached` being the first source that is still to be looked at.
uint begin_of(Pairing pairing, uint reached) {
    return clamp(reached, pairing.i_source, pairing.i_source + pairing.n_sources) - pairing.i_source;
}

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
        walk.s + (done ? (enters ? 1u : n_nodes) : 0u), quarters ? walk.level + 1u : level, quarters ? walk.at * 2u : next);
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
// The mean of max(x, 0) over a normal distribution: what of a cluster's cosines is positive.
float positive_part(float mean, float variance) {
    float deviation = sqrt(max(variance, 1e-12));
    float z = clamp(mean / deviation, -6.0, 6.0);
    float below = 0.5 + 0.5 * erf_approx(0.70710678 * z);
    return max(z > 5.9 ? mean : deviation * (z * below + 0.39894228 * exp(-0.5 * z * z)), 0.0);
}

// The mean of cos cos/d^2 over a cluster whose mean square distance from its middle is `extent` d^2: the middle's value and
// the second derivatives' share. A surface's cluster lies in its plane (half of the spread an axis) and has one normal; a
// cloud's is as deep as it is wide (a third an axis) and its normals spread about their mean.
float cluster_form(vec3 receiver_normal, vec3 source_normal, vec3 way, float d2, float extent, uint kind) {
    float at_source = -dot(source_normal, way), at_receiver = dot(receiver_normal, way);
    float turned = dot(receiver_normal, source_normal);
    if (kind == REGION_SURFACE) {
        float bent = 2.0 * extent * at_source * (at_receiver - turned * at_source - 3.0 * at_receiver * at_source * at_source);
        return at_source > 0.0 && at_receiver > 0.0 ? max(at_source * at_receiver + bent, 0.0) / d2 : 0.0;
    }
    float bent = -extent * (turned + 2.0 * at_source * at_receiver) / 3.0;
    float apart = max(1.0 - dot(source_normal, source_normal), 0.0) / 3.0;
    float both = positive_part(at_source, apart) * positive_part(at_receiver, extent / 3.0);
    return max(both + (at_source > 0.0 && at_receiver > 0.0 ? bent : 0.0), 0.0) / d2;
}
#endif

// By how much a cell of this width over its distance is wider than `limit` widths of the region's lobes, its half vector
// being `gap` from the normal and turning by `turn` within the cell: for the narrowest that can be met of all that its
// material has over time, so that the cells are the same at any time.
float lobe_excess(Region region, float gap, float turn, float width, float limit) {
    float beyond = sqrt(2.0 * gap) - turn;
    bool met = beyond < LOBE_REACH * region.lobe_width_most;
    float narrowest = max(region.lobe_width, beyond / LOBE_REACH);
    return met ? width / (limit * narrowest) : 0.0;
}

View look(Source source, uint i, uint n_nodes, Walk walk, Pane pane, Region emitter, Taker taker) {
    View view;
#if TREE
    bool is_cluster = n_nodes > 1u;
    pane.half_u = is_cluster ? vec3(0.0) : pane.half_u;
    pane.half_v = is_cluster ? vec3(0.0) : pane.half_v;
    pane.side = is_cluster ? 2.0 * source.radius : pane.side;
    vec3 face = is_cluster ? source.normal * inversesqrt(max(dot(source.normal, source.normal), 1e-30)) : source.normal;
    // A cluster is opened by its radius, and where its facets look different ways.
    float theta = emitter.kind == REGION_SURFACE ? push.theta : CLOUD_THETA * push.theta;
    float limit = is_cluster ? 2.0 * theta : push.pair_size;
    float lobe_limit = is_cluster ? LOBE_STEP * theta : LOBE_STEP * push.pair_size;
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
    // What a cluster's extent may change of its form factor: in radius over distance, and the cosines.
    float tilt = 0.5 * view.width;
    float at_taker = max(dot(taker.normal, view.way) + tilt, 0.0);
    float at_source = max(-dot(source.normal, view.way), 0.0) + 1.0 - length(source.normal);
    float mixed = sqrt(max(1.0 - dot(source.normal, source.normal), 0.0));
    float wrong = tilt * (tilt + MIXED * mixed) * min(at_taker, 1.0) * at_source * source.total_area * inverse * inverse;
    float allowed = theta * theta;
    excess = is_cluster ? (tilt > 1.0 ? 2.0 : wrong / (allowed * allowed)) : excess;
#endif
    float turn = TURN * view.width;
    view.emitter_gap = 2.0;
    uint n_shiny = emitter.i_lobe == NO_LOBE ? 0u : 1u;
    for (uint g = 0u; g < n_shiny; ++g) {
        view.leaving += lobe_flux(i, emitter, view.position, face, -view.way, view.emitter_gap);
        excess = max(excess, lobe_excess(emitter, view.emitter_gap, turn, view.width, lobe_limit));
    }
    view.taker_gap = 2.0;
#if GLOSSY
    view.taker_gap = half_vector_gap(taker.normal, view.way, taker.outgoing);
    excess = max(excess, lobe_excess(taker.region, view.taker_gap, turn, view.width, lobe_limit));
#endif
    // Some of the cell may be before the receiver; the receiver is before all of it or none.
    bool before = dot(taker.normal, offset) > -pane.side * scale;
    bool faces = dot(source.normal, offset) < 0.0;
#if TREE
    // A cluster with normals of its own each may send what its mean does not say.
    faces = faces || (is_cluster && dot(source.normal, source.normal) < EVEN * EVEN);
    view.split = before && faces && excess > 1.0 && (is_cluster || (walk.level < push.pair_levels && n_cells_left > 0u));
    view.wide = before && faces && excess > 1.0 && !is_cluster;
#else
    view.wide = before && faces && excess > 1.0;
    view.split = view.wide && walk.level < push.pair_levels && n_cells_left > 0u;
#endif
    return view;
}

// Of the ball about a cluster or cell that is opened where the rim of a shadow runs through it; 0 where it is small enough.
float torn_radius(Source source, Walk walk, View view, uint n_nodes) {
#if TREE
    if (n_nodes > 1u) {
        return view.width > push.theta * TORN ? source.radius : 0.0;
    }
#endif
    bool wide = view.width > push.pair_size * RIM && walk.level < push.pair_levels && n_cells_left > 0u;
    return wide ? source.radius * cell_scale(walk.level) : 0.0;
}
