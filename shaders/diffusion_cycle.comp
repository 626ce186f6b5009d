#version 460
#extension GL_GOOGLE_include_directive : require
#include "buffers.glsl"
#include "diffusion.glsl"

// Runs a cycle through small grids in one workgroup, as one dispatch in place of four a grid
// (passes.md "diffusion").
// In: right-hand sides of the finest of these grids, and its phi: in the first cycle `phi`, after a
// sweep from phi = 0, later `next_phi`. In, out: operators; where they are new, those of the
// coarser grids are made. Out: `next_phi` of the finest grid. The rest is scratch. Law: two sweeps,
// a correction by the coarser grid, and two sweeps. The coarsest grid has sweeps of Gauss and
// Seidel, the cells of one colour of a chessboard at once. They begin from phi = 0; where it is the
// only grid, later cycles go on from its phi.

#ifndef WORKGROUP
#define WORKGROUP 64
#endif
layout(local_size_x = WORKGROUP) in;

layout(push_constant) uniform Push {
    // The finest grid.
    Level level;
    // From grid to grid, three bits that are 1 where an axis is halved; the finest lowest.
    uint halvings;
    uint n_levels;
    uint n_all;
    // Sweeps of the coarsest grid, which has at most 64 cells.
    uint n_sweeps;
    uint is_new;
    uint is_first;
} push;
TEXEL_UPDATES(0, operators)
TEXEL_UPDATES(1, source)
TEXEL_UPDATES(2, phi)
TEXEL_UPDATES(3, next_phi)

vec4 load(uvec4 words) { return uintBitsToFloat(words); }
uvec4 words_of(vec3 v) { return floatBitsToUint(vec4(v, 0.0)); }

// Whether phi is in `next_phi`, and whether that of the coarser grid is to be added.
bool is_next = false, is_corrected = false;
Level coarse;
ivec3 halved;

vec3 phi_at(Level level, ivec3 at) {
    int c = index_of(level, at);
    vec3 own = is_next ? load(LOAD_TEXEL(next_phi, c)).rgb : load(LOAD_TEXEL(phi, c)).rgb;
    if (is_corrected) {
        own += load(LOAD_TEXEL(next_phi, index_of(coarse, at >> halved))).rgb;
    }
    return own;
}

#define OPERATOR(k) load(LOAD_TEXEL(operators, k))
#define SOURCE(k) load(LOAD_TEXEL(source, k)).rgb
#define PHI(level, at) phi_at(level, at)
#include "equations.glsl"

// Runs its body for each of n cells. All must be done before other cells read what it wrote.
#define FOR_CELLS(i, n) for (uint i = gl_LocalInvocationID.x; i < (n); i += WORKGROUP)
void all_done() {
    groupMemoryBarrier();
    barrier();
}

ivec3 halved_after(uint i) {
    uint bits = push.halvings >> 3u * i;
    return ivec3(bits & 1u, bits >> 1 & 1u, bits >> 2 & 1u);
}

// Returns grid i of them.
Level level_at(uint i) {
    Level level = push.level;
    for (uint k = 0; k < i; ++k) {
        uvec3 by = uvec3(halved_after(k));
        level = Level(level.n_cells + by >> by, level.i_first + n_total(level));
    }
    return level;
}

void sweep(Level level, float step) {
    FOR_CELLS(i, n_total(level)) {
        ivec3 at = place_of(level, i);
        uvec4 now = words_of(swept(level, at, step));
        if (is_next) {
            STORE_TEXEL(phi, index_of(level, at), now);
        } else {
            STORE_TEXEL(next_phi, index_of(level, at), now);
        }
    }
    all_done();
}

void make_operators(Level fine) {
    FOR_CELLS(i, n_total(coarse)) {
        ivec3 at = place_of(coarse, i);
        for (int set = 0; set < N_SETS; ++set) {
            vec4 merged = merged_operator(fine, halved, at, set);
            int k = index_of(coarse, at) + set * int(push.n_all);
            STORE_TEXEL(operators, k, floatBitsToUint(merged));
        }
    }
    all_done();
}

// Writes what the equations of the finer grid leave over, and phi after a sweep from phi = 0.
void restrict_from(Level fine) {
    FOR_CELLS(i, n_total(coarse)) {
        ivec3 at = place_of(coarse, i);
        vec3 left = left_over(fine, halved, at);
        int k = index_of(coarse, at);
        STORE_TEXEL(source, k, words_of(left));
        STORE_TEXEL(phi, k, words_of(LONG_STEP * left / diagonal(coarse, at)));
    }
    all_done();
}

void solve_coarsest(Level level) {
    uint c = gl_LocalInvocationID.x;
    bool is_cell = c < n_total(level);
    ivec3 at = place_of(level, c);
    int k = index_of(level, at);
    is_next = true;
    if (is_cell && (push.n_levels > 1u || push.is_first != 0u)) {
        STORE_TEXEL(next_phi, k, uvec4(0u));
    }
    all_done();
    for (uint i = 0; i < 2u * push.n_sweeps; ++i) {
        if (is_cell && (uint(at.x + at.y + at.z) + i) % 2u == 0u) {
            STORE_TEXEL(next_phi, k, words_of(swept(level, at, 1.0)));
        }
        all_done();
    }
}

void main() {
    uint last = push.n_levels - 1u;
    for (uint i = 0; i < last; ++i) {
        Level level = level_at(i);
        coarse = level_at(i + 1);
        halved = halved_after(i);
        if (push.is_new != 0u) {
            make_operators(level);
        }
        if (i == 0 && push.is_first == 0u) {
            is_next = true;
            sweep(level, LONG_STEP);
        }
        is_next = false;
        sweep(level, SHORT_STEP);
        is_next = true;
        restrict_from(level);
    }
    solve_coarsest(level_at(last));
    for (uint i = last; i > 0; --i) {
        Level level = level_at(i - 1);
        coarse = level_at(i);
        halved = halved_after(i - 1);
        is_next = is_corrected = true;
        sweep(level, LONG_STEP);
        is_next = is_corrected = false;
        sweep(level, SHORT_STEP);
    }
}
