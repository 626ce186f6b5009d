// q at the face between two cells of the diffusion solver (passes.md "diffusion").

// 1: q is that of a change by a bounce, and the two halves of the way are in series.
#ifndef CHANGE
#define CHANGE 0
#endif

// Returns q at the face between two cells of D `reach`.
vec3 at_face(vec3 q, vec3 reach, vec3 other_q, vec3 other_reach) {
#if CHANGE
    return (other_reach * q + reach * other_q) / (reach + other_reach);
#else
    return 0.5 * (q + other_q);
#endif
}
