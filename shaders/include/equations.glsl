// The equations of cells: sum w (phi - phi_n) + sink phi = source. Needs diffusion.glsl,
// `TEXELS operators` [set][cell], and PHI(at), the phi of the cell at a place. An operator has w
// toward the next cell along each axis, and sink. n_all in the push constants is the number of
// cells of all levels.

vec4 operator_at(int c, int set) {
    return uintBitsToFloat(TEXEL(operators, c + set * int(push.n_all)));
}

// Returns the equations of cell c, a column a channel.
#if N_SETS == 3
#define FACTORS mat3x4
mat3x4 factors(int c) {
    return mat3x4(operator_at(c, 0), operator_at(c, 1), operator_at(c, 2));
}
vec3 factor(mat3x4 of, int k) { return vec3(of[0][k], of[1][k], of[2][k]); }
#else
#define FACTORS vec4
vec4 factors(int c) { return operator_at(c, 0); }
vec3 factor(vec4 of, int k) { return vec3(of[k]); }
#endif

// Sets `flows` to sum w (phi_n - phi) - sink phi of a cell, and `all` to the sum of w and sink.
// Differences of neighbours keep the digits that their values share.
void around(Level level, ivec3 at, vec3 own_phi, out vec3 flows, out vec3 all) {
    int c = index_of(level, at);
    ivec3 stride = strides_of(level);
    FACTORS own = factors(c);
    all = factor(own, 3);
    flows = -all * own_phi;
    for (int axis = 0; axis < 3; ++axis) {
        ivec3 to = ivec3(axis == 0, axis == 1, axis == 2);
        if (at[axis] + 1 < int(level.n_cells[axis])) {
            vec3 w = factor(own, axis);
            flows += w * (PHI(at + to) - own_phi);
            all += w;
        }
        if (at[axis] > 0) {
            vec3 w = factor(factors(c - stride[axis]), axis);
            flows += w * (PHI(at - to) - own_phi);
            all += w;
        }
    }
}
