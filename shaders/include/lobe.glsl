// Tabulated lobes over t = (1 - cos gamma)^(1/4), gamma between the normal and the half vector
// (model.md §6). Needs `FLOATS table`, one lobe a row.

const uint N_NODES = 1025;

// The interval of table nodes that w lies in: the same for every row.
struct Knot {
    uint i;
    float part;
};

Knot knot_at(float w) {
    float t = sqrt(sqrt(clamp(w, 0.0, 1.0))) * float(N_NODES - 1u);
    uint i = min(uint(t), N_NODES - 2u);
    return Knot(i, t - float(i));
}

float value_at(uint i_row, Knot knot) {
    int k = int(i_row * N_NODES + knot.i);
    return mix(FLOAT(table, k), FLOAT(table, k + 1), knot.part);
}

float lobe_at(uint i_row, float w) { return value_at(i_row, knot_at(w)); }

// Returns 1 - cos gamma for the half vector of unit a and b without cancellation: half the square
// of the chord from n to it.
float half_vector_gap(vec3 n, vec3 a, vec3 b) {
    vec3 h = a + b;
    vec3 chord = n - h * inversesqrt(max(dot(h, h), 1e-30));
    return 0.5 * dot(chord, chord);
}

float lobe_between(uint i_row, vec3 n, vec3 a, vec3 b) {
    return lobe_at(i_row, half_vector_gap(n, a, b));
}
