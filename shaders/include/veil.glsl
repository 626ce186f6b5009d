// The pairing's surfaces that may hide something of an emitting surface from one receiver: looked
// at once, before the emitter's many sources (docs/model.md §11 "second"). Never leaves out what
// `hides` would find.

// Most occluders that a veil remembers; where more remain it is the whole list.
const uint MAX_VEIL = 8u;
// Of these at hand.
const uint N_AT_HAND = 3u;
// Planes through p are trusted to this share of the lengths that make them up: some hundred units
// of round-off.
const float PLANE_TRUST = 1e-5;

struct Veil {
    // Surfaces to look at; the whole list where `whole`.
    uint n;
    bool whole;
    // Eight numbers of 8 bits, counted from the pairing's first.
    uvec2 list;
    // One surface alone hides all of the emitter.
    bool closed;
    // The first three, at hand unless it is the whole list: most veils are no more.
    Region first;
    Region second;
    Region third;
};

vec3 corner(Region r, uint k) {
    float x = (k + 1u & 2u) == 0u ? -1.0 : 1.0, y = (k & 2u) == 0u ? -1.0 : 1.0;
    return r.center + x * r.u + y * r.v;
}

// How the emitter's corners lie to the pyramid of p over the occluder: 0 outside, 1 partly inside,
// 2 inside.
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

uint occluder_of(Pairing pairing, Veil veil, uint k) {
    uint word = k < 4u ? veil.list.x : veil.list.y;
    uint i = veil.whole ? k : (word >> (8u * (k & 3u))) & 255u;
    return occluders[pairing.i_occluder + i];
}

// Nothing is looked at where nothing is `wanted`.
Veil veil_of(Pairing pairing, Region emitter, vec3 p, bool wanted) {
    Veil veil;
    veil.n = 0u;
    veil.list = uvec2(0u);
    veil.closed = false;
    uint n = wanted && emitter.kind == REGION_SURFACE ? min(pairing.n_occluders, 256u) : 0u;
    for (uint k = 0u; k < n; ++k) {
        uint covers = cover(region_at(occluders[pairing.i_occluder + k]), emitter, p);
        veil.closed = veil.closed || covers == 2u;
        uint entry = k << (8u * (veil.n & 3u));
        veil.list |= uvec2(covers == 0u || veil.n >= 4u ? 0u : entry, covers == 0u || veil.n < 4u ? 0u : entry);
        veil.n += covers == 0u ? 0u : 1u;
        // Of `cover`'s own loops, too.
        n_turns += 24u;
    }
    veil.whole = veil.n > MAX_VEIL || emitter.kind != REGION_SURFACE || pairing.n_occluders > 256u;
    veil.n = veil.whole ? pairing.n_occluders : veil.n;
    uint last = max(veil.n, 1u) - 1u;
    for (uint k = 0u; k < (veil.whole ? 0u : min(veil.n, 1u)); ++k) {
        veil.first = region_at(occluder_of(pairing, veil, 0u));
        veil.second = region_at(occluder_of(pairing, veil, min(1u, last)));
        veil.third = region_at(occluder_of(pairing, veil, min(2u, last)));
    }
    return veil;
}

// All of a pairing's surfaces, looked at one by one.
Veil whole_veil(Pairing pairing) {
    Veil veil;
    veil.n = pairing.n_occluders;
    veil.whole = true;
    veil.list = uvec2(0u);
    veil.closed = false;
    return veil;
}
