// Extinction and D of the cells between which light diffuses, and q at their faces (passes.md
// "diffusion"). Needs `density`, and of the push constants densest, kept and inverse_chord.

// 1: q is that of a change by a bounce, and the two halves of the way are in series.
#ifndef CHANGE
#define CHANGE 0
#endif

float extinction_of(int c) { return min(FLOAT(density, c), push.densest); }

// D
vec3 reach_of(int c) { return 1.0 / (3.0 * extinction_of(c) * push.kept + push.inverse_chord); }

// Returns q at the face between two cells of D `reach`.
vec3 at_face(vec3 q, vec3 reach, vec3 other_q, vec3 other_reach) {
#if CHANGE
    return (other_reach * q + reach * other_q) / (reach + other_reach);
#else
    return 0.5 * (q + other_q);
#endif
}
