// How a receiver sees one source: as a whole, or cell by cell where the source is too wide for its
// distance (model.md §7, passes.md "second"). Needs gather.glsl.

// A lobe reaches this many of its widths; beyond it is below e^-8 of its peak.
const float LOBE_REACH = 4.0;
// Greatest width of a whole source in widths of a lobe, times pair_size. At the default 0.5 the
// half vector turns by 3/4 of a width from one to the next, and the midpoint rule on a Gaussian is
// then exact to 1e-7.
const float LOBE_STEP = 3.0;
// Lobes are evaluated in each quarter of a cell, so that a cell may be this much wider. Its
// quarters are 3/4 as wide as a whole may be, finer than lobes need; its points are as fine as
// shadow edges need (docs/reference/measured.md).
const float LOBE_PARTS = 1.5;
// The half vector turns by at most this share of a cell's width over its distance between centre
// and corner. It is half the direction's turn, of half a diagonal of sqrt 2, and twice that where
// the light is as near as the receiver.
const float TURN = 0.75;
// A cluster that a shadow's edge crosses is opened down to this share of the opening angle's
// diameter.
const float CLUSTER_EDGE_WIDTH = 0.5;
// Opening angle of clouds' clusters over that of surfaces'. Their facets overlap and face every
// way, so they need a smaller angle for the same error: 1 % of L2 at theta = 0.4.
const float CLOUD_THETA = 0.4;
// Where a cluster's normals differ, those nearer to the receiver may be those that face it. The
// error is of first order: this share of radius over distance times the normals' spread.
const float MIXED = 0.5;
// 1 - cos gamma of a lobe without light: beyond the reach and turn of any lobe.
const float UNLIT = 1e6;
// Facets wider than this share of their distance count as discs.
const float NEAR = 1.0;
// A facet that a shadow's edge crosses is split down to this share of pair_size.
const float EDGE_WIDTH = 0.125;
// The same where a shadow's edge crosses only the view of the facet, or only its light.
const float SINGLE_EDGE_WIDTH = 0.25;
// Cells with points may be this much wider than wholes: their points' parts are what must be small.
const float CELL_WIDTH = 3.0;
// A cluster whose mean normal is at least this long has one normal but for rounding.
const float EVEN = 0.9999;

// The place of a walk: deferred facet s, and cell `at` of its 4^level cells in Z order.
struct Walk {
    uint s;
    uint level;
    uvec2 at;
};

Walk start_walk(uint s) { return Walk(s, 0u, uvec2(0u)); }

// Facets are deferred before they are split, so that the loop over cells does not run once for
// every facet. A device that runs both sides of a condition runs an empty loop at least once.
#ifndef MAX_DEFERRED
#define MAX_DEFERRED 8
#endif
#ifndef MAX_EDGE_FACETS
#define MAX_EDGE_FACETS (WIDE != 0 ? 4 : 32)
#endif

// Returns 2^-level.
float cell_scale(uint level) { return uintBitsToFloat((127u - level) << 23); }

// Moves into the cell's first quarter, on to the next cell, or, after a facet's last cell, to the
// next facet.
Walk advance(Walk walk, bool is_split) {
    // Last quarters of last quarters end together.
    uint up = min(uint(findLSB(~(walk.at.x & walk.at.y))), walk.level);
    uint level = walk.level - up;
    uvec2 at = walk.at >> up;
    bool odd = (at.x & 1u) != 0u;
    bool done = !is_split && level == 0u;
    uvec2 next = odd ? uvec2(at.x - 1u, at.y + 1u) : uvec2(at.x + 1u, at.y);
    next = done ? uvec2(0u) : next;
    return Walk(
        walk.s + (done ? 1u : 0u), is_split ? walk.level + 1u : level,
        is_split ? walk.at * 2u : next
    );
}

// A source or a cell of it, as the receiver sees it.
struct SourceView {
    vec3 position;
    vec3 direction;
    // Squared distance, and width over distance.
    float d2;
    float width;
    // By kept light: the flux that makes the emitter's lobe shine, and 1 - cos gamma there. Then
    // the least of these gaps, and the gap at the receiver.
    vec4 shine;
    vec4 gaps;
    float emitter_gap;
    float receiver_gap;
    // Wider than asked for; and wider than a cell may be.
    bool is_too_wide;
    bool is_split;
};

#if TREE
// Returns the mean of max(x, 0) over a normal distribution, as for the positive part of a cluster's
// cosines.
float positive_part(float mean, float variance) {
    float deviation = sqrt(max(variance, 1e-12));
    float z = clamp(mean / deviation, -6.0, 6.0);
    float below = 0.5 + 0.5 * erf_approx(0.70710678 * z);
    // A distribution without spread is its mean: the least deviation would give a cluster that
    // faces away 4e-7.
    bool spreads = variance > 1e-12 && z <= 5.9;
    return max(spreads ? deviation * (z * below + 0.39894228 * exp(-0.5 * z * z)) : mean, 0.0);
}

// Returns a cluster's second moments times a vector.
vec3 moments_by(LoadedSource s, vec3 x) {
    return s.square * x
           + vec3(
               dot(s.leaning.xy, x.yz), s.leaning.x * x.x + s.leaning.z * x.z,
               dot(s.leaning.yz, x.xy)
           );
}

// Returns the mean of cos cos/d^2 over a cluster: the value at its middle, and half its second
// derivatives times the second moments. A cloud's normals spread about their mean.
float cluster_form(LoadedSource source, vec3 receiver_normal, vec3 direction, float d2, uint kind) {
    float at_source = -dot(source.normal, direction), at_receiver = dot(receiver_normal, direction);
    float inverse = 1.0 / max(d2, 1e-30);
    vec3 along = moments_by(source, direction) * inverse;
    float extent = (source.square.x + source.square.y + source.square.z) * inverse;
    float bent =
        at_source * at_receiver * (12.0 * dot(along, direction) - 2.0 * extent)
        - 4.0 * (at_source * dot(receiver_normal, along) - at_receiver * dot(source.normal, along))
        - dot(receiver_normal, moments_by(source, source.normal)) * inverse;
    bent = at_source > 0.0 && at_receiver > 0.0 ? bent : 0.0;
    if (kind == REGION_SURFACE) {
        return at_source > 0.0 && at_receiver > 0.0
                   ? max(at_source * at_receiver + bent, 0.0) * inverse
                   : 0.0;
    }
    float apart = max(1.0 - dot(source.normal, source.normal), 0.0) / 3.0;
    return max(positive_part(at_source, apart) * positive_part(at_receiver, extent / 3.0) + bent,
               0.0)
           * inverse;
}
#endif

// Returns by how much a cell of this width over its distance is wider than `limit` widths of the
// region's lobes. gap: of the half vector from the normal. turn: its change within the cell. The
// narrowest lobe counts that the material has at any time, so that the cells do not depend on the
// time.
float lobe_excess(Region region, float gap, float turn, float width, float limit) {
    float beyond = sqrt(2.0 * gap) - turn;
    bool met = beyond < LOBE_REACH * region.lobe_width_most;
    float narrowest = max(region.lobe_width, beyond / LOBE_REACH);
    return met ? width / (limit * narrowest) : 0.0;
}

bool is_cluster(LoadedSource source) {
#if TREE
    return source.n_nodes > 1u;
#else
    return false;
#endif
}

// Returns the mean of cos cos/d^2 over a whole source.
float form_of(
    LoadedSource source, SourceView view, FacetShape facet_shape, Region emitter, Receiver receiver
) {
    float share = facet_shape.side > 0.0 && view.width <= NEAR
                      ? rectangle_form(
                            receiver.normal, source.normal, view.direction, view.d2,
                            facet_shape.half_u, facet_shape.half_v
                        )
                      : form(receiver.normal, source.normal, view.direction, view.d2, source.area);
#if TREE
    share = is_cluster(source)
                ? cluster_form(source, receiver.normal, view.direction, view.d2, emitter.kind)
                : share;
#endif
    return share;
}

#if TREE
// Returns how much more a cluster's extent may change of its form factor than the opening angle
// allows, by radius over distance and the cosines.
float cluster_excess(LoadedSource source, SourceView view, Region emitter, Receiver receiver) {
    float theta = emitter.kind == REGION_SURFACE ? push.theta : CLOUD_THETA * push.theta;
    float tilt = 0.5 * view.width;
    float even = dot(source.normal, source.normal);
    float at_receiver = max(dot(receiver.normal, view.direction) + tilt, 0.0);
    float at_source = max(-dot(source.normal, view.direction), 0.0) + 1.0 - sqrt(even);
    float mixed = sqrt(max(1.0 - even, 0.0));
    // The form factor includes the second moments. Beyond them a surface's cluster errs by third
    // order, counted from its nearest point. A cloud's cluster errs by first order, where its
    // facets face different ways.
    float nearest = tilt / max(1.0 - tilt, 0.01);
    float order = emitter.kind == REGION_SURFACE ? nearest * nearest * nearest
                                                 : tilt * (tilt + MIXED * mixed);
    float wrong =
        order * min(at_receiver, 1.0) * at_source * source.total_area / max(view.d2, 1e-30);
    float allowed = theta * theta;
    return tilt > 1.0 ? 2.0 : wrong / (allowed * allowed);
}
#endif

// Returns how the receiver sees a source, or a cell of one. broad: how much wider than pair_size it
// may be.
SourceView view_of(
    LoadedSource source, uint i, Walk walk, float broad, FacetShape facet_shape, Region emitter,
    Receiver receiver
) {
    SourceView view;
    bool cluster = is_cluster(source);
    float scale = cell_scale(walk.level);
    vec2 at = (2.0 * vec2(walk.at) + 1.0) * scale - 1.0;
    at *= cluster ? 0.0 : 1.0;
    view.position = source.position + at.x * facet_shape.half_u + at.y * facet_shape.half_v;
    vec3 offset = view.position - receiver.position;
    view.d2 = dot(offset, offset);
    float inverse = inversesqrt(max(view.d2, 1e-30));
    view.direction = offset * inverse;
    float side = cluster ? 2.0 * source.radius : facet_shape.side * scale;
    view.width = side * inverse;
    float excess = view.width / (broad * push.pair_size);
    float by_lobes = 0.0;
    float lobe_limit = (broad > 1.0 ? LOBE_PARTS : 1.0) * LOBE_STEP * push.pair_size;
    vec3 face = source.normal;
#if TREE
    float theta = emitter.kind == REGION_SURFACE ? push.theta : CLOUD_THETA * push.theta;
    excess = cluster ? cluster_excess(source, view, emitter, receiver) : excess;
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
            float gap = gap_of(view.position, face, -view.direction, l);
            view.emitter_gap = g > 0.0 ? min(view.emitter_gap, gap) : view.emitter_gap;
#if N_KEPT > 0
            view.shine[l] = g;
            view.gaps[l] = gap;
#endif
        }
        by_lobes = lobe_excess(emitter, view.emitter_gap, turn, view.width, lobe_limit);
    }
#endif
    view.receiver_gap = 2.0;
#if GLOSSY
    view.receiver_gap = half_vector_gap(receiver.normal, view.direction, receiver.outgoing);
    by_lobes =
        max(by_lobes,
            lobe_excess(receiver.region, view.receiver_gap, turn, view.width, lobe_limit));
#endif
    // Part of the cell may be before the receiver's plane; the receiver is before all of the cell's
    // plane or none.
    bool before = dot(receiver.normal, offset) > -side;
    bool faces = dot(source.normal, offset) < 0.0;
#if TREE
    // A cluster whose normals differ may send light that its mean normal does not show.
    faces = faces || (cluster && dot(source.normal, source.normal) < EVEN * EVEN);
#endif
    view.is_too_wide = before && faces && max(excess, by_lobes) > 1.0;
    view.is_split = before && faces
                    && (view.width > CELL_WIDTH * push.pair_size
                        || by_lobes > (broad > 1.0 ? 1.0 : LOBE_PARTS));
    return view;
}

// Whether a source is wide enough for shadow edges to be looked for.
bool may_have_edge(LoadedSource source, SourceView view) {
#if TREE
    if (is_cluster(source)) {
        return view.width > push.theta * CLUSTER_EDGE_WIDTH;
    }
#endif
    return view.width > push.pair_size * EDGE_WIDTH;
}

// Returns what the quarters of a facet's cell send on of light l's energy: A times the share that
// arrives at each of their visible points. own: finds the light at the cell's own points. Otherwise
// the facet's parts that the points lie in give the light.
vec4 arriving_by(
    uint i, LoadedSource source, Walk walk, Cell cell, CellSamples seen, uint i_own, const bool own,
    uint l
) {
    vec3 flux = flux_at(i, l).xyz;
    if (own) {
        CellSamples s =
            arriving(LIGHT(l), cell, source.normal, flux.y, uint(flux.z), i_own, push.n_surfaces);
        return source.area * quarters(seen, s);
    }
    return flux.x * quarters(seen, part_of(unpacked(packed_samples_at(i, l)), walk.at, walk.level));
}

// Returns light l's flux that makes the lobe of a source shine, and 1 - cos gamma there.
vec2 shine_of(uint i, LoadedSource source, SourceView view, uint l) {
#if N_KEPT > 0
    return vec2(view.shine[l], view.gaps[l]);
#else
    float g = LIGHT(l).kind != LIGHT_SKY ? flux_at(i, l).w : 0.0;
    vec3 face = source.normal * inversesqrt(max(dot(source.normal, source.normal), 1e-30));
    return vec2(g, gap_of(view.position, face, -view.direction, l));
#endif
}
