// How a receiver goes through the sources of a pairing (docs/model.md §11 "second"): wholes one by
// one, and those set aside
// cell by cell. Who includes it says what is taken, and from where (`own`: the cell's light is its
// own, not its facet's):
//   void take_whole(uint i, Sender source, View view, Region emitter, Taker taker, float share);
//   void take_cell(uint i, Sender source, View view, Region emitter, Taker taker, Stencil seen,
//   Walk walk, Cell cell, float part,
//       uint i_own, const bool own);
//   void take_doubt(uint i, Sender source, View view, Region emitter, Taker taker, float area): a
//   cell that stayed too wide.

// Facets whose cells a driver cut short all the same.
float n_cut = 0.0;

// Facets that a shadow of a light tears and that are to be quartered: their cells' own light is
// found when all else is done, so that no other cell has to wait for it. Source and pairing.
uvec2 torn[MAX_TORN];
uint n_torn = 0u;

// One cell of a facet; whether it is quartered.
bool take_or_quarter(uint i, Walk walk, Pairing pairing, Region emitter, Taker taker, Veil veil, Pane pane, const bool own) {
    Sender source = sender_at(i, emitter, pane);
    View view = look(source, i, walk, BROAD, pane, emitter, taker);
    bool quartered = view.wide && walk.level < push.pair_levels && n_turns < QUARTER_TURNS;
    float scale = cell_scale(walk.level);
    Cell cell = Cell(view.position, scale * pane.half_u, scale * pane.half_v);
    // Of the facet, and a sixteenth to each point.
    float part = quartered ? 0.0 : 0.0625 * scale * scale;
    Stencil seen = forms(cell, source.normal, taker.normal, taker.position, scale * scale * source.area);
    shade_all(seen, pairing, veil, taker.position, cell, quartered ? 0u : veil.n);
#if MARCH
    part *= attenuation(taker.position, view.position, part > 0.0);
#endif
    take_cell(i, source, view, emitter, taker, seen, walk, cell, part, pairing.i_region, own);
    for (uint k = 0u; k < (view.wide && !quartered ? 1u : 0u); ++k) {
        take_doubt(i, source, view, emitter, taker, scale * scale * source.area);
        n_turns += 1u;
    }
    n_turns += CELL_TURNS;
    return quartered;
}

// One step is one cell, so that neighbouring invocations need not wait for each other's facets.
void gather_cells(Pairing pairing, Region emitter, Taker taker, Veil veil, Pane pane, uint aside[MAX_ASIDE], uint n_aside) {
    Walk walk = start_walk(0u);
    while (walk.s < n_aside) {
        walk = advance(walk, take_or_quarter(aside[walk.s], walk, pairing, emitter, taker, veil, pane, false));
    }
    n_cut += float(n_aside - walk.s);
}

// The torn facets of all pairings.
void gather_torn(Taker taker) {
    Walk walk = start_walk(0u);
    while (walk.s < n_torn) {
        uvec2 facet = torn[walk.s];
        Pairing pairing = pairings[facet.y];
        Region emitter = region_at(pairing.i_region);
        // All that may stand between the surfaces: a veil of its own would be looked at for one
        // facet.
        Veil veil = whole_veil(pairing);
        walk = advance(walk, take_or_quarter(facet.x, walk, pairing, emitter, taker, veil, pane_of(emitter), true));
    }
    n_cut += float(n_torn - walk.s);
    n_torn = 0u;
    count_together();
}

// Adds what the sources of a pairing from `s` on send to the receiver, and moves `s`.
void gather(uint i_pairing, Pairing pairing, Region emitter, Taker taker, Veil veil, inout uint s, uint end) {
    Pane pane = pane_of(emitter);
    uint aside[MAX_ASIDE];
    // What is set aside is finished: it needs room.
    while (s < end && n_turns < BATCH_TURNS && n_torn < MAX_TORN) {
        uint n_aside = 0u;
        while (s < end && n_turns < BATCH_TURNS && n_aside < MAX_ASIDE && n_torn < MAX_TORN) {
            uint i = pairing.i_source + s;
            Sender source = sender_at(i, emitter, pane);
            View view = look(source, i, start_walk(s), 1.0, pane, emitter, taker);
            bool cluster = is_cluster(source);
            // A cloud's facet has no width and so no cells.
            bool closer = view.wide;
            float share = closer ? 0.0 : form_of(source, view, pane, emitter, taker);
            bool rims = share > 0.0 && may_be_torn(source, view);
            vec2 veiling = veils_ball(pairing, veil, taker.position, view.position, source.radius, share > 0.0);
            share *= veiling.x;
            bool coarse = view.width > push.pair_size * SINGLE;
            bool is_torn = rims && veiling.y > 0.0 && (cluster || coarse || source.in_part);
            closer = closer || is_torn || (coarse && source.in_part && share > 0.0);
            share = closer ? 0.0 : share;
#if MARCH
            share *= attenuation(taker.position, view.position, share > 0.0);
#endif
            take_whole(i, source, view, emitter, taker, share);
            bool by_cells = closer && !cluster;
            bool quartered = by_cells && source.in_part && view.quartered;
            torn[n_torn] = uvec2(i, i_pairing);
            n_torn += quartered ? 1u : 0u;
            aside[n_aside] = i;
            n_aside += by_cells && !quartered ? 1u : 0u;
            s += closer && cluster ? 1u : source.n_nodes;
            n_turns += STEP_TURNS;
        }
        gather_cells(pairing, emitter, taker, veil, pane, aside, n_aside);
        n_turns += 1u;
        count_together();
    }
    count_together();
}

// Where the walk through a pairing's sources begins, `reached` being the first source that is still
// to be looked at.
uint begin_of(Pairing pairing, uint reached) {
    return clamp(reached, pairing.i_source, pairing.i_source + pairing.n_sources) - pairing.i_source;
}
