// The equations of cells: sum w (phi - phi_n) + sink phi = source. Needs diffusion.glsl, and
// OPERATOR(k), element k of the operators [set][cell]. An operator has w toward the next cell along
// each axis, and sink. n_all in the push constants is the number of cells of all levels. A
// solver defines SOURCE(k), the right-hand side of cell k, and PHI(level, at), the phi of the cell
// at a place.

vec4 operator_at(int c, int set) { return OPERATOR(c + set * int(push.n_all)); }

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

// Returns the sum of the factors of phi in a cell's equation.
vec3 diagonal(Level level, ivec3 at) {
    int c = index_of(level, at);
    ivec3 stride = strides_of(level);
    FACTORS own = factors(c);
    vec3 sum = factor(own, 0) + factor(own, 1) + factor(own, 2) + factor(own, 3);
    for (int axis = 0; axis < 3; ++axis) {
        if (at[axis] > 0) {
            sum += factor(factors(c - stride[axis]), axis);
        }
    }
    return sum;
}

// The cells from `first` to before `end` that are merged to one of a coarser grid.
struct Merging {
    ivec3 first;
    ivec3 end;
};

// Returns the cells that are merged to the one at a place. `halved` is 1 along merged axes.
Merging merging(Level fine, ivec3 halved, ivec3 at) {
    ivec3 first = at << halved;
    return Merging(first, min(first + 1 + halved, ivec3(fine.n_cells)));
}

// Returns the operator of merged cells. Sinks add up, and so do the w of faces between merged
// cells. Along a merged axis w counts half, as centres lie twice as far apart.
vec4 merged_operator(Level fine, ivec3 halved, ivec3 at, int set) {
    Merging of = merging(fine, halved, at);
    vec3 weight = vec3(1.0) - 0.5 * vec3(halved);
    vec4 sum = vec4(0.0);
    for (int z = of.first.z; z < of.end.z; ++z) {
        for (int y = of.first.y; y < of.end.y; ++y) {
            for (int x = of.first.x; x < of.end.x; ++x) {
                vec4 own = operator_at(index_of(fine, ivec3(x, y, z)), set);
                // Of the faces along a merged axis, those of the second cell lead on.
                bvec3 leads = equal(ivec3(x, y, z) - of.first, halved);
                sum.xyz += mix(vec3(0.0), own.xyz * weight, leads);
                sum.w += own.w;
            }
        }
    }
    return sum;
}

#ifdef PHI
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
            flows += w * (PHI(level, at + to) - own_phi);
            all += w;
        }
        if (at[axis] > 0) {
            vec3 w = factor(factors(c - stride[axis]), axis);
            flows += w * (PHI(level, at - to) - own_phi);
            all += w;
        }
    }
}

// Returns phi of a cell after a sweep of Jacobi's: it moves toward the solution of its own equation
// by the given step.
vec3 swept(Level level, ivec3 at, float step) {
    vec3 own = PHI(level, at), flows, all;
    around(level, at, own, flows, all);
    return own + step * (SOURCE(index_of(level, at)) + flows) / all;
}

// Returns what the equations of cells leave over that are merged to the one at a place.
vec3 left_over(Level fine, ivec3 halved, ivec3 at) {
    Merging of = merging(fine, halved, at);
    vec3 left = vec3(0.0);
    for (int z = of.first.z; z < of.end.z; ++z) {
        for (int y = of.first.y; y < of.end.y; ++y) {
            for (int x = of.first.x; x < of.end.x; ++x) {
                ivec3 from = ivec3(x, y, z);
                vec3 flows, all;
                around(fine, from, PHI(fine, from), flows, all);
                left += SOURCE(index_of(fine, from)) + flows;
            }
        }
    }
    return left;
}
#endif
