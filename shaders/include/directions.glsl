// Directions over which bounces sum (model.md §18).

// Parts of a direction, in each order and with each sign. The means of 1, of a cosine over its half
// and of its square over these directions are those over the sphere.
const float LONG_PART = 0.908248290463863, SHORT_PART = 0.295875854768068;
const uint N_DIRECTIONS = 24;
// Five times the means of the squares of the harmonics of the second order (second_order.glsl),
// which are 1 over the sphere.
const float SECOND_MEANS[5] = float[](
    0.760469818460, 0.760469818460, 0.760469818460, 1.359295272310, 1.359295272310
);

vec3 direction(uint i) {
    vec3 d = vec3(SHORT_PART);
    d[i >> 3] = LONG_PART;
    return d * (1.0 - 2.0 * vec3(i & 1u, i >> 1 & 1u, i >> 2 & 1u));
}
