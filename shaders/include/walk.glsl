// How a receiver walks the sources of a pairing: wholes one by one, deferred ones cell by cell
// (passes.md "second"). main() is here, too. The includer defines three functions.
// add_whole() adds a source as a whole.
// add_cell() adds a cell; own: its light is found at its own points, not taken from its facet's.
// add_unresolved() counts a cell that stayed too wide.
// With STORES_PAIRINGS it also defines clear() and store_pairing(), for the sums of one pairing.
// store_receiver() stores the rest.

// Facets whose cells a driver cut short all the same.
float n_cut = 0.0;

// Facets that a light's shadow edge crosses and that must be split, as (source, pairing). Their
// cells' own light is found after all else, so that no other cell waits for it.
#if WIDE
shared uvec2 edge_facets[MAX_EDGE_FACETS * WORKGROUP];
shared uint deferred[MAX_DEFERRED * WORKGROUP];
#define OWN(k) ((k) * WORKGROUP + gl_LocalInvocationID.x)
#else
uvec2 edge_facets[MAX_EDGE_FACETS];
uint deferred[MAX_DEFERRED];
#define OWN(k) k
#endif
uint n_edge_facets = 0u;
// Short lists are often full: then the walk goes on in the same dispatch.
#define AGAIN (WIDE && !STORES_PAIRINGS)

#if WIDE
// The cell stayed too wide: the next iteration adds its bound. Otherwise the registers of the bound
// would live beside those of the cell.
bool is_bound = false;
#endif

// Adds one cell of a facet, or returns true where the cell must be split.
bool add_or_split(
    uint i, Walk walk, Pairing pairing, Region emitter, Receiver receiver,
    OccluderList occluder_list, FacetShape facet_shape, const bool own
) {
    LoadedSource source = load_source(i, emitter, facet_shape);
    SourceView view = view_of(source, i, walk, CELL_WIDTH, facet_shape, emitter, receiver);
    bool is_split =
        view.is_too_wide && walk.level < push.pair_levels && n_iterations < SPLIT_ITERATIONS;
    float scale = cell_scale(walk.level);
#if WIDE
    if (is_bound) {
        add_unresolved(i, source, view, emitter, receiver, scale * scale * source.area);
        n_iterations += 1u;
        is_bound = false;
        return false;
    }
    is_bound = view.is_too_wide && !is_split;
#endif
    Cell cell = Cell(view.position, scale * facet_shape.half_u, scale * facet_shape.half_v);
    // Share of the facet, and a sixteenth of it for each point.
    float part = is_split ? 0.0 : 0.0625 * scale * scale;
    CellSamples seen =
        forms(cell, source.normal, receiver.normal, receiver.position, scale * scale * source.area);
    subtract_shadows(
        seen, pairing, occluder_list, receiver.position, cell, is_split ? 0u : occluder_list.n
    );
#if MARCH
    part *= attenuation(receiver.position, view.position, part > 0.0);
#endif
    add_cell(i, source, view, emitter, receiver, seen, walk, cell, part, pairing.i_region, own);
#if !WIDE
    for (uint k = 0u; k < (view.is_too_wide && !is_split ? 1u : 0u); ++k) {
        add_unresolved(i, source, view, emitter, receiver, scale * scale * source.area);
        n_iterations += 1u;
    }
#endif
    n_iterations += CELL_ITERATIONS;
    return is_split;
}

// Moves on from a cell that add_or_split() has looked at.
Walk next_of(Walk walk, bool is_split) {
#if WIDE
    if (is_bound) {
        return walk;
    }
#endif
    return advance(walk, is_split);
}

// Walks the cells of the deferred facets. One iteration is one cell, so that neighbouring
// invocations need not wait for each other's facets.
void gather_cells(
    Pairing pairing, Region emitter, Receiver receiver, OccluderList occluder_list,
    FacetShape facet_shape, uint n_deferred
) {
    Walk walk = start_walk(0u);
    while (walk.s < n_deferred) {
        bool is_split = add_or_split(
            deferred[OWN(walk.s)], walk, pairing, emitter, receiver, occluder_list, facet_shape,
            false
        );
        walk = next_of(walk, is_split);
    }
    n_cut += float(n_deferred - walk.s);
}

// Walks the cells of the facets with shadow edges, of all pairings.
void gather_edge_facets(Receiver receiver) {
    Walk walk = start_walk(0u);
    while (walk.s < n_edge_facets) {
        uvec2 facet = edge_facets[OWN(walk.s)];
        Pairing pairing = pairings[facet.y];
        Region emitter = region_at(pairing.i_region);
        // All surfaces in between: finding a list would not pay for one facet.
        OccluderList occluder_list = all_occluders(pairing);
        bool is_split = add_or_split(
            facet.x, walk, pairing, emitter, receiver, occluder_list, facet_shape_of(emitter), true
        );
        walk = next_of(walk, is_split);
    }
    n_cut += float(n_edge_facets - walk.s);
    n_edge_facets = 0u;
    share_iteration_count();
}

// Adds what the sources of a pairing from `s` on send to the receiver, and moves `s`.
void gather(
    uint i_pairing, Pairing pairing, Region emitter, Receiver receiver, OccluderList occluder_list,
    inout uint s, uint end
) {
    FacetShape facet_shape = facet_shape_of(emitter);
    // Deferred facets are finished in the same dispatch, which needs room for them.
    while (s < end && n_iterations < BATCH_ITERATIONS && n_edge_facets < MAX_EDGE_FACETS) {
        uint n_deferred = 0u;
        while (s < end && n_iterations < BATCH_ITERATIONS && n_deferred < MAX_DEFERRED
               && n_edge_facets < MAX_EDGE_FACETS) {
            uint i = pairing.i_source + s;
            LoadedSource source = load_source(i, emitter, facet_shape);
            SourceView view =
                view_of(source, i, start_walk(s), 1.0, facet_shape, emitter, receiver);
            bool cluster = is_cluster(source);
            // A cloud's facet has no width and so no cells.
            bool closer = view.is_too_wide;
            float share = closer ? 0.0 : form_of(source, view, facet_shape, emitter, receiver);
            bool may_split = share > 0.0 && may_have_edge(source, view);
            vec2 visibility = visible_part(
                pairing, occluder_list, receiver.position, view.position, source.radius, share > 0.0
            );
            share *= visibility.x;
            bool coarse = view.width > push.pair_size * SINGLE_EDGE_WIDTH;
            bool has_edge =
                may_split && visibility.y > 0.0 && (cluster || coarse || source.is_partly_shadowed);
            closer = closer || has_edge || (coarse && source.is_partly_shadowed && share > 0.0);
            share = closer ? 0.0 : share;
#if MARCH
            share *= attenuation(receiver.position, view.position, share > 0.0);
#endif
            add_whole(i, source, view, emitter, receiver, share);
            bool by_cells = closer && !cluster;
            bool is_split = by_cells && source.is_partly_shadowed && view.is_split;
            edge_facets[OWN(n_edge_facets)] = uvec2(i, i_pairing);
            n_edge_facets += is_split ? 1u : 0u;
            deferred[OWN(n_deferred)] = i;
            n_deferred += by_cells && !is_split ? 1u : 0u;
            s += closer && cluster ? 1u : source.n_nodes;
            n_iterations += STEP_ITERATIONS;
        }
        gather_cells(pairing, emitter, receiver, occluder_list, facet_shape, n_deferred);
        n_iterations += 1u;
        share_iteration_count();
    }
    share_iteration_count();
}

// Returns where the walk through a pairing's sources begins; `reached` is the first source not
// looked at yet.
uint begin_of(Pairing pairing, uint reached) {
    return clamp(reached, pairing.i_source, pairing.i_source + pairing.n_sources)
           - pairing.i_source;
}

void main() {
    Block block = blocks[push.i_first_block + gl_WorkGroupID.x];
    bool is_receiver = gl_LocalInvocationID.x < block.n_facets;
    uint j = order[block.i_first + min(gl_LocalInvocationID.x, block.n_facets - 1u)];
    uint next = push.i_round == 0u ? 0u : reached[j];
    if (next == DONE) {
        return;
    }
    uint begun = next;
    KEEP_LIGHTS
    Facet facet = facets[j];
    // All receivers of a block are of one region. The compiler knows so where the block gives it.
    Region own = region_at(facets[order[block.i_first]].i_region);
    vec3 to_eye = push.eye - facet.position;
    vec3 albedo = own.kd * facet.color * PI_INVERSE;
    Receiver receiver = Receiver(facet.position, facet.normal, normalize(to_eye), albedo, own);
    front = dot(to_eye, facet.normal) > 0.0 ? 1.0 : 0.0;
    uint last = 0u;
#if AGAIN
    do {
#endif
    for (uint k = 0u; k < block.n_pairings; ++k) {
        Pairing pairing = pairings[block.i_pairing + k];
        last = pairing.i_source + pairing.n_sources;
        bool open =
            n_iterations < BATCH_ITERATIONS && n_edge_facets < MAX_EDGE_FACETS && next < last;
        Region emitter = region_at(pairing.i_region);
        uint s = begin_of(pairing, next);
        uint n = open ? pairing.n_sources : 0u;
        OccluderList occluder_list = find_occluders(pairing, emitter, facet.position, open);
#if STORES_PAIRINGS
        clear();
#endif
        uint end = occluder_list.closed ? 0u : n;
#if STORES_PAIRINGS
        do {
#endif
        gather(block.i_pairing + k, pairing, emitter, receiver, occluder_list, s, end);
#if STORES_PAIRINGS
        gather_edge_facets(receiver);
        // A full list has ended the gather before its last source.
        } while (s < end && n_iterations < BATCH_ITERATIONS);
#endif
        s = occluder_list.closed && open ? pairing.n_sources : s;
        next = open ? pairing.i_source + s : next;
        n_iterations += 4u;
#if STORES_PAIRINGS
        if (is_receiver) {
            store_pairing(j, own, emitter);
        }
#endif
    }
#if !STORES_PAIRINGS
    gather_edge_facets(receiver);
#endif
#if AGAIN
    } while (next < last && n_iterations < BATCH_ITERATIONS);
#endif
    if (is_receiver) {
        // What is left counts as lost until a later round has looked at it: that round may not run.
        // At the end there is no bound then.
        uint left = last - min(next, last);
        uint before = push.i_round == 0u ? 0u : last - min(begun, last);
        bool is_last = push.i_round + 1u == push.n_rounds;
        bool is_bounded = n_cut == 0.0 && (left == 0u || !is_last);
        store_receiver(j, receiver, n_cut + float(left) - float(before), is_bounded);
        reached[j] = next >= last ? DONE : next;
        if (next < last) {
            atomicMax(rounds[3u * (push.i_round + 1u)], gl_WorkGroupID.x + 1u);
        }
    }
}
