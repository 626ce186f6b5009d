// Spherical harmonics of the second and the third order (model.md §18), over sqrt((2l+1)/4 pi): for
// two directions, the sum of the products over an order is Legendre's polynomial of their cosine.

// Number of harmonics that bounces have: 5 of the second order, 12 with those of the third, or 0.
#ifndef HIGH
#define HIGH 12
#endif

// The first of the third order.
const int FIRST_THIRD = 5;
// Numbers of what suns and lamps make a cell send out: even, along each axis, high orders.
const int N_ARRIVED = 4 + HIGH;

#if HIGH
void high_orders(vec3 w, out float y[HIGH]) {
    vec3 s = w * w;
    y[0] = 1.7320508075688772 * w.x * w.y;
    y[1] = 1.7320508075688772 * w.y * w.z;
    y[2] = 1.7320508075688772 * w.z * w.x;
    y[3] = 0.8660254037844386 * (s.x - s.y);
    y[4] = 1.5 * s.z - 0.5;
#if HIGH > 5
    y[5] = 3.872983346207417 * w.x * w.y * w.z;
    y[6] = 0.7905694150420949 * w.x * (s.x - 3.0 * s.y);
    y[7] = 0.7905694150420949 * w.y * (3.0 * s.x - s.y);
    y[8] = 1.9364916731037085 * w.z * (s.x - s.y);
    y[9] = 0.6123724356957945 * w.x * (5.0 * s.z - 1.0);
    y[10] = 0.6123724356957945 * w.y * (5.0 * s.z - 1.0);
    y[11] = w.z * (2.5 * s.z - 1.5);
#endif
}
#endif
