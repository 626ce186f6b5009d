// The facet on a blob's shell (passes.md "facets"). Needs
// records.glsl and functions.glsl.

#include "particles.glsl"

layout(push_constant) uniform Push {
    Grid grid;
    uint n_facets;
    uint i_first_facet;
} push;
TEXELS(0, placed)
TEXELS(1, particles)
READS(2, uint, i_group)
READS(3, Group, groups)
FLOATS(4, density)
WRITES(5, Facet, facets)

#include "density.glsl"

// 1: blobs may be upright ellipsoids, 2: any (model.md §14).
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

// The form of a blob.
#if ELLIPSOIDS == 2
#include "turn.glsl"
struct Form {
    // Lengths of its axes over sigma, and their directions.
    vec3 lengths;
    mat3 axes;
};

Form upright_form(float aspect) { return Form(vec3(1.0, aspect, 1.0), mat3(1.0)); }

Form form_of(Particle particle) {
    vec3 y, z;
    axes_of(particle.turn, y, z);
    return Form(vec3(1.0, particle.aspect, particle.aspect_z), mat3(cross(y, z), y, z));
}

float volume_of(Form form) { return form.lengths.y * form.lengths.z; }
#else
struct Form {
    float aspect;
};

Form upright_form(float aspect) { return Form(aspect); }

Form form_of(Particle particle) { return Form(particle.aspect); }

float volume_of(Form form) { return form.aspect; }
#endif

vec3 unit_or(vec3 v, vec3 otherwise) {
    float l = length(v);
    return l > 1e-30 ? v / l : otherwise;
}

// Returns the unit normal against the gradient of the density smoothed to 2 scale where that is
// well conditioned, else away from the cloud's centre.
vec3 normal_at(vec3 p, float scale, Form form, vec3 cloud_center) {
#if !SHELL
    return vec3(0.0, 1.0, 0.0);
#endif
#if ELLIPSOIDS == 2
    vec3 axes = form.lengths;
#else
    vec3 axes = vec3(1.0, ELLIPSOIDS != 0 ? form.aspect : 1.0, 1.0);
#endif
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
        vec3 at = axes * d;
#if ELLIPSOIDS == 2
        at = form.axes * at;
#endif
        float rho = w * density_at(p + SMOOTH_SIGMA * scale * at);
        gradient += rho * d;
        sum += rho;
    }
    float condition = sum > 0.0 ? length(gradient) / sum : 0.0;
    // The gradient was taken in coordinates that make the ellipsoid a ball.
    gradient /= axes;
#if ELLIPSOIDS == 2
    gradient = form.axes * gradient;
#endif
    float slope = length(gradient);
    vec3 outward = unit_or(p - cloud_center, vec3(0.0, 1.0, 0.0));
    float t = smoothstep(CONDITION_LOW, CONDITION_HIGH, condition);
    return t > 0.0 ? unit_or(t * (-gradient / slope) + (1.0 - t) * outward, outward) : outward;
}

// Returns the place where the shell of a blob about p has the normal n.
vec3 shell_at(vec3 p, float scale, Form form, vec3 n) {
#if !SHELL
    return p;
#elif ELLIPSOIDS == 2
    vec3 own = n * form.axes, to = form.lengths * form.lengths * own;
    return p + SHELL_SIGMA * scale / sqrt(dot(own, to)) * (form.axes * to);
#elif ELLIPSOIDS
    vec3 to = vec3(n.x, form.aspect * form.aspect * n.y, n.z);
    return p + SHELL_SIGMA * scale / sqrt(dot(n, to)) * to;
#else
    return p + SHELL_SIGMA * scale * n;
#endif
}

// Returns pi R^2 (1 - e^-tau) of a blob, R = 3 sigma; of an ellipsoid the mean over all directions
// it is seen from.
float area_of(float sigma, Form form, float kappa) {
    float radius = 3.0 * sigma;
    float area = PI * radius * radius, tau = SQRT_TAU * kappa * sigma;
    // Knud Thomsen's formula for an ellipsoid's surface, a quarter of which is that mean.
#if ELLIPSOIDS == 2
    vec2 powers = exp2(1.6075 * log2(form.lengths.yz));
    float wider =
        exp2(log2((powers.x + powers.y + powers.x * powers.y) / 3.0) / 1.6075);
#elif ELLIPSOIDS
    float wider = exp2(log2((1.0 + 2.0 * exp2(1.6075 * log2(form.aspect))) / 3.0) / 1.6075);
#endif
#if ELLIPSOIDS
    area *= wider;
    tau *= volume_of(form) / wider;
#endif
    return area * one_minus_exp(tau);
}
