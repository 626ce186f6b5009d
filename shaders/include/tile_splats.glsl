// How the invocations of a tile share the splats that they have found and loaded: by subgroup
// operations, or by shared memory (docs/explanation/passes.md "tiles"). Needs the buffers of
// tiles.comp.

// A splat as it lies in the buffers.
struct Loaded {
    // Centre's slopes, scale, tau.
    vec4 place;
    // Radiance, near/z.
    vec4 light;
#if TEXTURED
    vec4 turn;
    // Gain; first texel.
    uvec4 gain;
    // Log2 of the level's side.
    uint side;
#endif
#if ELLIPSOIDS
    vec4 conic;
#endif
};

// Splats that reach the tile, collected before they are composed.
const uint MOST = 8 * INVOCATIONS;
shared uint found[MOST];

#if ONE_SUBGROUP
// Appends the splats that the invocations found, in the order of invocations; returns the new
// number of found ones.
uint append(uint n, bool hit, uint r) {
    uvec4 hits = subgroupBallot(hit);
    if (hit) {
        found[n + subgroupBallotExclusiveBitCount(hits)] = r;
    }
    return n + subgroupBallotBitCount(hits);
}

bool all_agree(bool b) { return subgroupAll(b); }
#else
shared uint votes[INVOCATIONS];
// As words: bits that are no float stay what they are.
shared uvec4 shared_splats[2 + 3 * TEXTURED + ELLIPSOIDS][INVOCATIONS];

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
    splat.place = uintBitsToFloat(texelFetch(splats, 2 * r));
    splat.light = uintBitsToFloat(texelFetch(splats, 2 * r + 1));
#if TEXTURED
    splat.turn = uintBitsToFloat(texelFetch(splat_textures, 3 * r));
    splat.gain = texelFetch(splat_textures, 3 * r + 1);
    splat.side = texelFetch(splat_textures, 3 * r + 2).x;
#endif
#if ELLIPSOIDS
    splat.conic = uintBitsToFloat(texelFetch(conics, r));
#endif
    return splat;
}

#if ONE_SUBGROUP
// Returns the splat that invocation m has loaded.
Loaded of_invocation(Loaded splat, uint m) {
    splat.place = subgroupShuffle(splat.place, m);
    splat.light = subgroupShuffle(splat.light, m);
#if TEXTURED
    splat.turn = subgroupShuffle(splat.turn, m);
    splat.gain = subgroupShuffle(splat.gain, m);
    splat.side = subgroupShuffle(splat.side, m);
#endif
#if ELLIPSOIDS
    splat.conic = subgroupShuffle(splat.conic, m);
#endif
    return splat;
}
#else
void share_splat(Loaded splat, uint t) {
    shared_splats[0][t] = floatBitsToUint(splat.place);
    shared_splats[1][t] = floatBitsToUint(splat.light);
#if TEXTURED
    shared_splats[2][t] = floatBitsToUint(splat.turn);
    shared_splats[3][t] = splat.gain;
    shared_splats[4][t] = uvec4(splat.side);
#endif
#if ELLIPSOIDS
    shared_splats[2 + 3 * TEXTURED][t] = floatBitsToUint(splat.conic);
#endif
    barrier();
}

Loaded of_invocation(uint m) {
    Loaded splat;
    splat.place = uintBitsToFloat(shared_splats[0][m]);
    splat.light = uintBitsToFloat(shared_splats[1][m]);
#if TEXTURED
    splat.turn = uintBitsToFloat(shared_splats[2][m]);
    splat.gain = shared_splats[3][m];
    splat.side = shared_splats[4][m].x;
#endif
#if ELLIPSOIDS
    splat.conic = uintBitsToFloat(shared_splats[2 + 3 * TEXTURED][m]);
#endif
    return splat;
}
#endif
