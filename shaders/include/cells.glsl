// How a receiver goes through a region's sources: facet by facet, and a facet too wide for its
// distance cell by cell (docs/model.md §7, §11 "second"). Needs gather.glsl.

// A lobe is met within this many of its widths (e^-8 of its peak beyond).
const float LOBE_REACH = 4.0;
// Wholes no wider than this many widths of a lobe, times pair_size: at the default 0.5 the half
// vector turns by 3/4 of a width from one to the next, and the midpoint rule on a Gaussian is then
// exact to 1e-7.
const float LOBE_STEP = 3.0;
// Lobes are met in each quarter of a cell, so that a cell may be this much wider: its quarters, 3/4
// as wide as a whole may be, are finer than they need be for the lobe, and its points as fine as
// rims need (docs/measured.md).
const float LOBE_PARTS = 1.5;
// The half vector turns by at most this share of a cell's width over its distance between its
// centre and its corner: half the direction's turn, of half a diagonal of sqrt 2; twice that where
// the light is as near as the receiver.
const float TURN = 0.75;
// A cluster that a shadow's rim runs through is opened down to this share of the opening angle's
// diameter.
const float TORN = 0.5;
// The opening angle of clouds' clusters over that of surfaces': their facets overlap and look every
// way, so that they need it this much smaller for the same error, 1 % of L2 at theta = 0.4.
const float CLOUD_THETA = 0.4;
// Where a cluster's normals differ, those nearer to the receiver may be those that face it: an
// error of the first order, of this share of radius over distance times the normals' spread.
const float MIXED = 0.5;
// 1 - cos gamma where no light shines on a lobe: out of any lobe's reach, and of any turn's.
const float UNLIT = 1e6;
// Facets wider than this share of their distance are discs to their receiver.
const float NEAR = 1.0;
// A facet that a shadow's rim runs through is looked at closely down to this share of pair_size.
const float RIM = 0.125;
// Where only the view of it or only a light on it is torn, this is near enough.
const float SINGLE = 0.25;
// Cells that are looked at by their points may be this much wider: it is their points' parts that
// are to be small.
const float BROAD = 3.0;
// A cluster whose mean normal is at least this long has, but for rounding, a single normal.
const float EVEN = 0.9999;

// Facet s of those set aside, and cell `at` of the 4^level it is divided into, in Z order.
struct Walk { uint s; uint level; uvec2 at; };

Walk start_walk(uint s) { return Walk(s, 0u, uvec2(0u)); }

// Facets set aside for a closer look, so that what they take is not gone through for every facet: a
// device that runs both sides of a condition runs an empty loop at least once.
#ifndef MAX_ASIDE
#define MAX_ASIDE 8
#endif
#ifndef MAX_TORN
#define MAX_TORN 32
#endif

// 2^-level.
float cell_scale(uint level) { return uintBitsToFloat((127u - level) << 23); }

// Into the cell's first quarter, on to the next cell, or, after a facet's last, to the next facet.
Walk advance(Walk walk, bool quartered) {
    // Last quarters of last quarters are done together.
    uint up = min(uint(findLSB(~(walk.at.x & walk.at.y))), walk.level);
    uint level = walk.level - up;
    uvec2 at = walk.at >> up;
    bool odd = (at.x & 1u) != 0u;
    bool done = !quartered && level == 0u;
    uvec2 next = odd ? uvec2(at.x - 1u, at.y + 1u) : uvec2(at.x + 1u, at.y);
    next = done ? uvec2(0u) : next;
    return Walk(walk.s + (done ? 1u : 0u), quartered ? walk.level + 1u : level, quartered ? walk.at * 2u : next);
}

// A source or cell as the receiver sees it.
struct View {
    vec3 position;
    vec3 way;
    // Square of the distance, and width over distance.
    float d2;
    float width;
    // Of each light that is kept: what makes the emitter's lobe shine, and 1 - cos gamma there; the
    // least of them; and that at the receiver.
    vec4 shine;
    vec4 gaps;
    float emitter_gap;
    float taker_gap;
    // Wider than asked for; and wider than a cell may be.
    bool wide;
    bool quartered;
};

#if TREE
// The mean of max(x, 0) over a normal distribution: what of a cluster's cosines is positive.
float positive_part(float mean, float variance) {
    float deviation = sqrt(max(variance, 1e-12));
    float z = clamp(mean / deviation, -6.0, 6.0);
    float below = 0.5 + 0.5 * erf_approx(0.70710678 * z);
    // What does not spread is its mean; the least deviation would give what faces away 4e-7.
    bool spreads = variance > 1e-12 && z <= 5.9;
    return max(spreads ? deviation * (z * below + 0.39894228 * exp(-0.5 * z * z)) : mean, 0.0);
}

// A cluster's second moments times a vector.
vec3 moments_by(Sender s, vec3 x) {
    return s.square * x + vec3(dot(s.leaning.xy, x.yz), s.leaning.x * x.x + s.leaning.z * x.z, dot(s.leaning.yz, x.xy));
}

// The mean of cos cos/d^2 over a cluster: the middle's value, and half its second derivatives times
// the second moments. A cloud's normals spread about their mean.
float cluster_form(Sender source, vec3 receiver_normal, vec3 way, float d2, uint kind) {
    float at_source = -dot(source.normal, way), at_receiver = dot(receiver_normal, way);
    float inverse = 1.0 / max(d2, 1e-30);
    vec3 along = moments_by(source, way) * inverse;
    float extent = (source.square.x + source.square.y + source.square.z) * inverse;
    float bent = at_source * at_receiver * (12.0 * dot(along, way) - 2.0 * extent)
        - 4.0 * (at_source * dot(receiver_normal, along) - at_receiver * dot(source.normal, along))
        - dot(receiver_normal, moments_by(source, source.normal)) * inverse;
    bent = at_source > 0.0 && at_receiver > 0.0 ? bent : 0.0;
    if (kind == REGION_SURFACE) {
        return at_source > 0.0 && at_receiver > 0.0 ? max(at_source * at_receiver + bent, 0.0) * inverse : 0.0;
    }
    float apart = max(1.0 - dot(source.normal, source.normal), 0.0) / 3.0;
    return max(positive_part(at_source, apart) * positive_part(at_receiver, extent / 3.0) + bent, 0.0) * inverse;
}
#endif

// By how much a cell of this width over its distance is wider than `limit` widths of the region's
// lobes, its half vector being `gap` from the normal and turning by `turn` within the cell: for the
// narrowest that can be met of all that its material has over time, so that the cells are the same
// at any time.
float lobe_excess(Region region, float gap, float turn, float width, float limit) {
    float beyond = sqrt(2.0 * gap) - turn;
    bool met = beyond < LOBE_REACH * region.lobe_width_most;
    float narrowest = max(region.lobe_width, beyond / LOBE_REACH);
    return met ? width / (limit * narrowest) : 0.0;
}

bool is_cluster(Sender source) {
#if TREE
    return source.n_nodes > 1u;
#else
    return false;
#endif
}

// cos cos/d^2 of a source as a whole, its mean.
float form_of(Sender source, View view, Pane pane, Region emitter, Taker taker) {
    float share = pane.side > 0.0 && view.width <= NEAR
        ? rectangle_form(taker.normal, source.normal, view.way, view.d2, pane.half_u, pane.half_v)
        : form(taker.normal, source.normal, view.way, view.d2, source.area);
#if TREE
    share = is_cluster(source) ? cluster_form(source, taker.normal, view.way, view.d2, emitter.kind) : share;
#endif
    return share;
}

#if TREE
// How much more a cluster's extent may change of its form factor than the opening angle allows: in
// radius over distance, and the cosines.
float cluster_excess(Sender source, View view, Region emitter, Taker taker) {
    float theta = emitter.kind == REGION_SURFACE ? push.theta : CLOUD_THETA * push.theta;
    float tilt = 0.5 * view.width;
    float even = dot(source.normal, source.normal);
    float at_taker = max(dot(taker.normal, view.way) + tilt, 0.0);
    float at_source = max(-dot(source.normal, view.way), 0.0) + 1.0 - sqrt(even);
    float mixed = sqrt(max(1.0 - even, 0.0));
    // Its second moments are in its form factor: beyond them a surface's cluster is wrong by the
    // third order, counted from its nearest point; where facets look different ways, one of a cloud
    // by the first.
    float nearest = tilt / max(1.0 - tilt, 0.01);
    float order = emitter.kind == REGION_SURFACE ? nearest * nearest * nearest : tilt * (tilt + MIXED * mixed);
    float wrong = order * min(at_taker, 1.0) * at_source * source.total_area / max(view.d2, 1e-30);
    float allowed = theta * theta;
    return tilt > 1.0 ? 2.0 : wrong / (allowed * allowed);
}
#endif

// A source, or cell of one. `broad`: how much wider than pair_size it may be.
View look(Sender source, uint i, Walk walk, float broad, Pane pane, Region emitter, Taker taker) {
    View view;
    bool cluster = is_cluster(source);
    float scale = cell_scale(walk.level);
    vec2 at = (2.0 * vec2(walk.at) + 1.0) * scale - 1.0;
    at *= cluster ? 0.0 : 1.0;
    view.position = source.position + at.x * pane.half_u + at.y * pane.half_v;
    vec3 offset = view.position - taker.position;
    view.d2 = dot(offset, offset);
    float inverse = inversesqrt(max(view.d2, 1e-30));
    view.way = offset * inverse;
    float side = cluster ? 2.0 * source.radius : pane.side * scale;
    view.width = side * inverse;
    float excess = view.width / (broad * push.pair_size);
    float by_lobes = 0.0;
    float lobe_limit = (broad > 1.0 ? LOBE_PARTS : 1.0) * LOBE_STEP * push.pair_size;
    vec3 face = source.normal;
#if TREE
    float theta = emitter.kind == REGION_SURFACE ? push.theta : CLOUD_THETA * push.theta;
    excess = cluster ? cluster_excess(source, view, emitter, taker) : excess;
    lobe_limit = cluster ? LOBE_STEP * theta : lobe_limit;
    face *= cluster ? inversesqrt(max(dot(face, face), 1e-30)) : 1.0;
#endif
    float turn = TURN * view.width;
    view.shine = vec4(0.0);
    view.gaps = vec4(2.0);
    view.emitter_gap = UNLIT;
#if SHINY
    if (emitter.i_lobe != NO_LOBE) {
        [[unroll]] for (uint l = 0u; l < N_LIGHTS; ++l) {
            float g = LIGHT(l).kind != LIGHT_SKY ? flux_at(i, l).w : 0.0;
            float gap = gap_of(view.position, face, -view.way, l);
            view.emitter_gap = g > 0.0 ? min(view.emitter_gap, gap) : view.emitter_gap;
#if N_KEPT > 0
            view.shine[l] = g;
            view.gaps[l] = gap;
#endif
        }
        by_lobes = lobe_excess(emitter, view.emitter_gap, turn, view.width, lobe_limit);
    }
#endif
    view.taker_gap = 2.0;
#if GLOSSY
    view.taker_gap = half_vector_gap(taker.normal, view.way, taker.outgoing);
    by_lobes = max(by_lobes, lobe_excess(taker.region, view.taker_gap, turn, view.width, lobe_limit));
#endif
    // Some of the cell may be before the receiver; the receiver is before all of it or none.
    bool before = dot(taker.normal, offset) > -side;
    bool faces = dot(source.normal, offset) < 0.0;
#if TREE
    // A cluster with normals of its own each may send what its mean does not say.
    faces = faces || (cluster && dot(source.normal, source.normal) < EVEN * EVEN);
#endif
    view.wide = before && faces && max(excess, by_lobes) > 1.0;
    view.quartered = before && faces && (view.width > BROAD * push.pair_size || by_lobes > (broad > 1.0 ? 1.0 : LOBE_PARTS));
    return view;
}

// Whether a source is wide enough for the rims of shadows to be looked for.
bool may_be_torn(Sender source, View view) {
#if TREE
    if (is_cluster(source)) {
        return view.width > push.theta * TORN;
    }
#endif
    return view.width > push.pair_size * RIM;
}

// What of light l's energy the quarters of a facet's cell send on: A times the share at each of
// their points as they are seen; `own`: of the cell itself, else of the parts of its facet that its
// points lie in.
vec4 arriving_by(uint i, Sender source, Walk walk, Cell cell, Stencil seen, uint i_own, const bool own, uint l) {
    vec3 flux = flux_at(i, l).xyz;
    if (own) {
        Stencil s = arriving(LIGHT(l), cell, source.normal, flux.y, uint(flux.z), i_own, push.n_surfaces);
        return source.area * quarters(seen, s);
    }
    return flux.x * quarters(seen, part_of(unpacked(stencil_at(i, l)), walk.at, walk.level));
}

// Light l's share that makes the lobe of a source shine, and 1 - cos gamma there.
vec2 shine_of(uint i, Sender source, View view, uint l) {
#if N_KEPT > 0
    return vec2(view.shine[l], view.gaps[l]);
#else
    float g = LIGHT(l).kind != LIGHT_SKY ? flux_at(i, l).w : 0.0;
    vec3 face = source.normal * inversesqrt(max(dot(source.normal, source.normal), 1e-30));
    return vec2(g, gap_of(view.position, face, -view.way, l));
#endif
}
