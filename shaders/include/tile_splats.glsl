// How the invocations of a tile share the splats that they have found and loaded: by subgroup
// operations, or by shared memory (passes.md "tiles"). Needs the buffers of
// tiles.comp.

// A splat as it lies in the buffers, by fours: a Splat, a SplatTexture where splats have textures,
// the changes of its light where it is shaded, and the conic of an ellipsoid, in two fours where
// ellipsoids are turned.
const uint I_SHADE = 2 + 3 * TEXTURED;
const uint N_FOURS = I_SHADE + SHADED + ELLIPSOIDS;
// Slices that are open at once (tile_slices.glsl).
const uint OPEN = SLICES;
struct Loaded {
    uvec4 fours[N_FOURS];
#if OWN_EDGE
    // The exponent at which the splat ends.
    float lowest;
#endif
#if SLICES
    // The boundary of slices nearest to its centre, counted from the eye.
    int boundary;
    // Shares of its optical depth within that boundary and the two before, near to far.
    float within[OPEN - 1];
#if SHADED
    // Density of a normal distribution at these boundaries.
    float density[OPEN - 1];
#endif
    // Distance of its centre in those of the near plane, and that of the near plane in sigma.
    float distance;
    float near_in_sigmas;
#endif
};

#if !QUEUE
// Splats that reach the tile, collected before they are composed.
const uint MOST = 8 * INVOCATIONS;
shared uint found[MOST];
// They are composed from this number on.
const uint ENOUGH = MOST - INVOCATIONS + 1u;
#endif

#if ONE_SUBGROUP
#if QUEUE
#include "tile_queue.glsl"
#else
// Appends the splats that the invocations found, in the order of invocations; returns the new
// number of found ones.
uint append(uint n, bool hit, uint r) {
    uvec4 hits = subgroupBallot(hit);
    if (hit) {
        found[n + subgroupBallotExclusiveBitCount(hits)] = r;
    }
    return n + subgroupBallotBitCount(hits);
}
#endif

bool all_agree(bool b) { return subgroupAll(b); }
#else
shared uint votes[INVOCATIONS];
shared uvec4 shared_splats[N_FOURS][INVOCATIONS];
#if OWN_EDGE
shared float shared_lowest[INVOCATIONS];
#endif
#if SLICES
shared int shared_boundary[INVOCATIONS];
shared float shared_within[OPEN - 1][INVOCATIONS];
#if SHADED
shared float shared_density[OPEN - 1][INVOCATIONS];
#endif
shared vec2 shared_sizes[INVOCATIONS];
#endif

uint append(uint n, bool hit, uint r) {
    uint t = gl_LocalInvocationID.x;
    votes[t] = uint(hit);
    barrier();
    uint before = 0, all_of = 0;
    for (uint k = 0; k < INVOCATIONS; ++k) {
        before += k < t ? votes[k] : 0u;
        all_of += votes[k];
    }
    if (hit) {
        found[n + before] = r;
    }
    barrier();
    return n + all_of;
}

bool all_agree(bool b) {
    votes[gl_LocalInvocationID.x] = uint(b);
    barrier();
    uint n = 0;
    for (uint k = 0; k < INVOCATIONS; ++k) {
        n += votes[k];
    }
    barrier();
    return n == INVOCATIONS;
}
#endif

Loaded load_splat(int r) {
    Loaded splat;
    [[unroll]] for (int k = 0; k < 2; ++k) { splat.fours[k] = TEXEL(splats, 2 * r + k); }
#if TEXTURED
    [[unroll]] for (int k = 0; k < 3; ++k) {
        splat.fours[2 + k] = TEXEL(splat_textures, 3 * r + k);
    }
#endif
#if SHADED
    splat.fours[I_SHADE] = TEXEL(shades, r);
#endif
#if ELLIPSOIDS
    [[unroll]] for (int k = 0; k < ELLIPSOIDS; ++k) {
        splat.fours[N_FOURS - ELLIPSOIDS + k] = TEXEL(conics, ELLIPSOIDS * r + k);
    }
#endif
    return splat;
}

// Returns the splat that invocation m has loaded.
Loaded of_invocation(Loaded splat, uint m) {
#if ONE_SUBGROUP
    [[unroll]] for (uint k = 0; k < N_FOURS; ++k) {
        splat.fours[k] = subgroupShuffle(splat.fours[k], m);
    }
#if OWN_EDGE
    splat.lowest = subgroupShuffle(splat.lowest, m);
#endif
#if SLICES
    splat.boundary = subgroupShuffle(splat.boundary, m);
    [[unroll]] for (uint k = 0; k < OPEN - 1u; ++k) {
        splat.within[k] = subgroupShuffle(splat.within[k], m);
    }
#if SHADED
    [[unroll]] for (uint k = 0; k < OPEN - 1u; ++k) {
        splat.density[k] = subgroupShuffle(splat.density[k], m);
    }
#endif
    splat.distance = subgroupShuffle(splat.distance, m);
    splat.near_in_sigmas = subgroupShuffle(splat.near_in_sigmas, m);
#endif
#else
    [[unroll]] for (uint k = 0; k < N_FOURS; ++k) { splat.fours[k] = shared_splats[k][m]; }
#if OWN_EDGE
    splat.lowest = shared_lowest[m];
#endif
#if SLICES
    splat.boundary = shared_boundary[m];
    [[unroll]] for (uint k = 0; k < OPEN - 1u; ++k) { splat.within[k] = shared_within[k][m]; }
#if SHADED
    [[unroll]] for (uint k = 0; k < OPEN - 1u; ++k) { splat.density[k] = shared_density[k][m]; }
#endif
    splat.distance = shared_sizes[m].x;
    splat.near_in_sigmas = shared_sizes[m].y;
#endif
#endif
    return splat;
}

#if SLICES
int boundary_of(Loaded splat, uint m) {
#if ONE_SUBGROUP
    return subgroupShuffle(splat.boundary, m);
#else
    return shared_boundary[m];
#endif
}
#endif

#if !ONE_SUBGROUP
void share_splat(Loaded splat, uint t) {
    [[unroll]] for (uint k = 0; k < N_FOURS; ++k) { shared_splats[k][t] = splat.fours[k]; }
#if OWN_EDGE
    shared_lowest[t] = splat.lowest;
#endif
#if SLICES
    shared_boundary[t] = splat.boundary;
    [[unroll]] for (uint k = 0; k < OPEN - 1u; ++k) { shared_within[k][t] = splat.within[k]; }
#if SHADED
    [[unroll]] for (uint k = 0; k < OPEN - 1u; ++k) { shared_density[k][t] = splat.density[k]; }
#endif
    shared_sizes[t] = vec2(splat.distance, splat.near_in_sigmas);
#endif
    barrier();
}
#endif
