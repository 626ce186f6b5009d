// The surfaces of a pairing that may hide part of an emitting surface from one receiver. They are
// found once, before the emitter's many sources (passes.md "second"), and include
// every surface that hides() would find.

// Greatest number of listed occluders; where more remain, all of the pairing's occluders are looked
// at.
const uint MAX_LISTED = 8u;
// Listed occluders that are held in registers.
const uint MAX_LOADED = WIDE != 0 ? 0u : 3u;
// Planes through p are trusted to this share of the lengths that define them: some hundred units of
// round-off.
const float PLANE_TRUST = 1e-5;

struct OccluderList {
    // Number of surfaces to look at; is all of the pairing's where `whole`.
    uint n;
    bool whole;
    // Eight numbers of 8 bits, counted from the pairing's first occluder.
    uvec2 list;
    // One surface alone hides all of the emitter.
    bool closed;
#if !WIDE
    // The first three, loaded unless `whole`: most lists are no longer.
    Region first;
    Region second;
    Region third;
#endif
};

vec3 corner(Region r, uint k) {
    float x = (k + 1u & 2u) == 0u ? -1.0 : 1.0, y = (k & 2u) == 0u ? -1.0 : 1.0;
    return r.center + x * r.u + y * r.v;
}

// Returns how the emitter's corners lie to the pyramid of p over the occluder: 0 outside, 1 partly
// inside, 2 inside.
uint cover(Region occluder, Region emitter, vec3 p) {
    float side = side_of(occluder, p);
    float count = 0.0;
    bool outside = side == 0.0;
    for (uint m = 0u; m < 4u; ++m) {
        vec3 a = corner(occluder, m) - p, b = corner(occluder, (m + 1u) & 3u) - p;
        vec3 plane = cross(a, b);
        plane *= dot(plane, occluder.center - p) < 0.0 ? -1.0 : 1.0;
        float trust = PLANE_TRUST * length(a) * length(b);
        float most = -3.4e38, least = 3.4e38;
        for (uint c = 0u; c < 4u; ++c) {
            vec3 e = corner(emitter, c) - p;
            float reach = dot(plane, e) / length(e);
            most = max(most, reach);
            least = min(least, reach);
        }
        outside = outside || most < -trust;
        count += least > trust ? 1.0 : 0.0;
    }
    float beyond = 0.0, before = 0.0;
    for (uint c = 0u; c < 4u; ++c) {
        vec3 o = corner(emitter, c) - occluder.center;
        float e = dot(occluder.normal, o) * sign(side);
        float trust = PLANE_TRUST * (abs(o.x) + abs(o.y) + abs(o.z));
        beyond += e < -trust ? 1.0 : 0.0;
        before += e > trust ? 1.0 : 0.0;
    }
    outside = outside || before == 4.0;
    return outside ? 0u : (count == 4.0 && beyond == 4.0 ? 2u : 1u);
}

uint occluder_of(Pairing pairing, OccluderList occluder_list, uint k) {
    uint word = k < 4u ? occluder_list.list.x : occluder_list.list.y;
    uint i = occluder_list.whole ? k : (word >> (8u * (k & 3u))) & 255u;
    return occluders[pairing.i_occluder + i];
}

// Finds the occluders of an emitter; none unless `wanted`.
OccluderList find_occluders(Pairing pairing, Region emitter, vec3 p, bool wanted) {
    OccluderList occluder_list;
    occluder_list.n = 0u;
    occluder_list.list = uvec2(0u);
    occluder_list.closed = false;
    uint n = wanted && emitter.kind == REGION_SURFACE ? min(pairing.n_occluders, 256u) : 0u;
    for (uint k = 0u; k < n; ++k) {
        uint covers = cover(region_at(occluders[pairing.i_occluder + k]), emitter, p);
        occluder_list.closed = occluder_list.closed || covers == 2u;
        uint entry = k << (8u * (occluder_list.n & 3u));
        occluder_list.list |= uvec2(
            covers == 0u || occluder_list.n >= 4u ? 0u : entry,
            covers == 0u || occluder_list.n < 4u ? 0u : entry
        );
        occluder_list.n += covers == 0u ? 0u : 1u;
        // Includes cover()'s own loops.
        n_iterations += 24u;
    }
    occluder_list.whole = occluder_list.n > MAX_LISTED || emitter.kind != REGION_SURFACE
                          || pairing.n_occluders > 256u;
    occluder_list.n = occluder_list.whole ? pairing.n_occluders : occluder_list.n;
#if !WIDE
    uint last = max(occluder_list.n, 1u) - 1u;
    for (uint k = 0u; k < (occluder_list.whole ? 0u : min(occluder_list.n, 1u)); ++k) {
        occluder_list.first = region_at(occluder_of(pairing, occluder_list, 0u));
        occluder_list.second = region_at(occluder_of(pairing, occluder_list, min(1u, last)));
        occluder_list.third = region_at(occluder_of(pairing, occluder_list, min(2u, last)));
    }
#endif
    return occluder_list;
}

// Returns all of a pairing's occluders.
OccluderList all_occluders(Pairing pairing) {
    OccluderList occluder_list;
    occluder_list.n = pairing.n_occluders;
    occluder_list.whole = true;
    occluder_list.list = uvec2(0u);
    occluder_list.closed = false;
    return occluder_list;
}
