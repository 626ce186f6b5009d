// The facet on a blob's shell (passes.md "facets"). Needs
// records.glsl and functions.glsl.

layout(push_constant) uniform Push {
    Grid grid;
    uint n_facets;
    uint i_first_facet;
} push;
READS(0, Placed, placed)
READS(1, Particle, particles)
READS(2, uint, i_group)
READS(3, Group, groups)
FLOATS(4, density)
WRITES(5, Facet, facets)

#include "density.glsl"

// 1: blobs may be ellipsoids (model.md §14).
#ifndef ELLIPSOIDS
#define ELLIPSOIDS 0
#endif

// 0: facets lie at the blobs' centres, where clouds are a medium. Their normals are up.
#ifndef SHELL
#define SHELL 1
#endif

const float SHELL_SIGMA = 1.5;
// Radius of the quadrature's sphere: 14 points at sqrt(5) s integrate a Gaussian of standard
// deviation s, here 2 sigma, to degree 5.
const float SMOOTH_SIGMA = 4.47213595499958;
const float CONDITION_LOW = 0.02;
const float CONDITION_HIGH = 0.10;
const float SQRT_TAU = 2.50662827463;
// Least aspect of a blob, and least inverse of one.
const float MIN_ASPECT = 1e-3;

vec3 unit_or(vec3 v, vec3 otherwise) {
    float l = length(v);
    return l > 1e-30 ? v / l : otherwise;
}

// Returns the unit normal against the gradient of the density smoothed to 2 scale where that is
// well conditioned, else away from the cloud's centre.
vec3 normal_at(vec3 p, float scale, float aspect, vec3 cloud_center) {
#if !SHELL
    return vec3(0.0, 1.0, 0.0);
#endif
    vec3 axes = vec3(1.0, ELLIPSOIDS != 0 ? aspect : 1.0, 1.0);
    vec3 gradient = vec3(0.0);
    float sum = 0.0;
    // A quadrature of degree 5 on the sphere: 6 axes and 8 diagonals.
    for (int k = 0; k < 14; ++k) {
        vec3 d;
        float w;
        if (k < 6) {
            d = vec3(0.0);
            d[k >> 1] = (k & 1) == 0 ? 1.0 : -1.0;
            w = 1.0 / 15.0;
        } else {
            d = vec3((k & 1) == 0 ? 1.0 : -1.0, (k & 2) == 0 ? 1.0 : -1.0, k < 10 ? 1.0 : -1.0)
                * 0.57735026919;
            w = 3.0 / 40.0;
        }
        float rho = w * density_at(p + SMOOTH_SIGMA * scale * (axes * d));
        gradient += rho * d;
        sum += rho;
    }
    float condition = sum > 0.0 ? length(gradient) / sum : 0.0;
    // The gradient was taken in coordinates that make the ellipsoid a ball.
    gradient /= axes;
    float slope = length(gradient);
    vec3 outward = unit_or(p - cloud_center, vec3(0.0, 1.0, 0.0));
    float t = smoothstep(CONDITION_LOW, CONDITION_HIGH, condition);
    return t > 0.0 ? unit_or(t * (-gradient / slope) + (1.0 - t) * outward, outward) : outward;
}

// Returns the place where the shell of a blob about p has the normal n.
vec3 shell_at(vec3 p, float scale, float aspect, vec3 n) {
#if !SHELL
    return p;
#elif ELLIPSOIDS
    vec3 to = vec3(n.x, aspect * aspect * n.y, n.z);
    return p + SHELL_SIGMA * scale / sqrt(dot(n, to)) * to;
#else
    return p + SHELL_SIGMA * scale * n;
#endif
}

// Returns pi R^2 (1 - e^-tau) of a blob, R = 3 sigma; of an ellipsoid the mean over all directions
// it is seen from.
float area_of(float sigma, float aspect, float kappa) {
    float radius = 3.0 * sigma;
    float area = PI * radius * radius, tau = SQRT_TAU * kappa * sigma;
#if ELLIPSOIDS
    // Knud Thomsen's formula for an ellipsoid's surface, a quarter of which is that mean.
    float wider = exp2(log2((1.0 + 2.0 * exp2(1.6075 * log2(aspect))) / 3.0) / 1.6075);
    area *= wider;
    tau *= aspect / wider;
#endif
    return area * one_minus_exp(tau);
}
