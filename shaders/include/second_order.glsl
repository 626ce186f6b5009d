// The second order of what cells send out (model.md §18).

// 1: bounces have it.
#ifndef SECOND
#define SECOND 0
#endif

const int N_SECOND = 5;

// Returns the spherical harmonics of the second order at w, over sqrt(5/(4 pi)). The sum of their
// products at two directions is Legendre's polynomial of the cosine between these.
float[N_SECOND] second_order(vec3 w) {
    vec3 s = w * w;
    return float[](
        1.7320508075688772 * w.x * w.y, 1.7320508075688772 * w.y * w.z,
        1.7320508075688772 * w.z * w.x, 0.8660254037844386 * (s.x - s.y), 1.5 * s.z - 0.5
    );
}
