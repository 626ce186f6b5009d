#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"
#include "functions.glsl"

// Makes one lighting facet for each run of particles in Morton order (model.md §5, passes.md
// "facets"). In: placed particles, their Morton order, the runs. Out: facets, and the facet of
// every particle. Law: the run counts as one blob of the members' mean position, spread and colour.
// Means are taken about the first member, so that a run of one particle gives that particle's facet
// to the bit.

// Particle at each place of the order.
READS(6, uint, order)
READS(7, Run, runs)
// By particle.
WRITES(8, uint, i_facet)

#include "shell.glsl"

// Sums over a run: position and sigma by mass, colour by area, and the plain sums that replace them
// where mass or area vanish.
struct Sums {
    float mass;
    vec3 position;
    float sigma_mean;
    float area;
    vec3 color;
    vec3 plain_color;
    vec3 plain_position;
    float plain_sigma;
};

float mass_of(Particle particle, float sigma) {
#if ELLIPSOIDS == 2
    // sigma cubed alone may overflow.
    return particle.kappa * sigma * (sigma * particle.aspect) * (sigma * particle.aspect_z);
#else
    return particle.kappa * sigma * sigma * sigma * particle.aspect;
#endif
}

Sums sums_of(Run run, uint first, float sigma_first) {
    Sums s = Sums(0.0, vec3(0.0), 0.0, 0.0, vec3(0.0), vec3(0.0), vec3(0.0), 0.0);
    vec3 from = PLACED_AT(first).position, first_color = PARTICLE_AT(first).color;
    for (uint k = run.i_first; k < run.i_first + run.n_particles; ++k) {
        uint i = order[k];
        Placed blob = PLACED_AT(i);
        Particle particle = PARTICLE_AT(i);
        float m = mass_of(particle, blob.sigma);
        float a = area_of(blob.sigma, form_of(particle), particle.kappa);
        vec3 p = blob.position - from;
        vec3 c = particle.color - first_color;
        float sigma = groups[i_group[i]].sigma_mean - sigma_first;
        s.mass += m;
        s.position += m * p;
        s.sigma_mean += m * sigma;
        s.area += a;
        s.color += a * c;
        s.plain_position += p;
        s.plain_sigma += sigma;
        s.plain_color += c;
    }
    return s;
}

// Returns the run's variance about its mean position: in x, or for ellipsoids along x and z, and
// along y.
vec2 spread_of(Run run, vec3 p, bool by_mass) {
    vec2 sum = vec2(0.0);
    float weight = 0.0;
    for (uint k = run.i_first; k < run.i_first + run.n_particles; ++k) {
        uint i = order[k];
        Placed blob = PLACED_AT(i);
        Particle particle = PARTICLE_AT(i);
        float sigma = blob.sigma;
        float m = by_mass ? mass_of(particle, sigma) : 1.0;
        vec3 d = blob.position - p;
#if ELLIPSOIDS == 2
        Form form = form_of(particle);
        vec3 squares = sigma * sigma * form.lengths * form.lengths;
        vec3 upward = vec3(form.axes[0].y, form.axes[1].y, form.axes[2].y);
        float high = dot(squares, upward * upward);
        float wide = 0.5 * dot(squares, 1.0 - upward * upward);
        sum += m * vec2(wide + 0.5 * (d.x * d.x + d.z * d.z), high + d.y * d.y);
#elif ELLIPSOIDS
        float high = particle.aspect * sigma;
        sum += m * vec2(sigma * sigma + 0.5 * (d.x * d.x + d.z * d.z), high * high + d.y * d.y);
#else
        sum.x += m * (sigma * sigma + dot(d, d) * (1.0 / 3.0));
#endif
        weight += m;
    }
    return sum / weight;
}

void main() {
    FOR_EACH(g, push.n_facets) {
        Run run = runs[g];
        uint first = order[run.i_first];
        Group group = groups[i_group[first]];
        Placed first_blob = PLACED_AT(first);
        Particle first_particle = PARTICLE_AT(first);
        Sums s = sums_of(run, first, group.sigma_mean);
        float n_inverse = 1.0 / float(run.n_particles);
        // Members without mass, or without area, all count alike.
        bool by_mass = s.mass > 0.0, by_area = s.area > 0.0;
        vec3 p =
            first_blob.position + (by_mass ? s.position / s.mass : s.plain_position * n_inverse);
        float sigma_mean =
            group.sigma_mean + (by_mass ? s.sigma_mean / s.mass : s.plain_sigma * n_inverse);
        vec3 color =
            first_particle.color + (by_area ? s.color / s.area : s.plain_color * n_inverse);
        vec2 spread = run.n_particles > 1u ? sqrt(spread_of(run, p, by_mass))
                                           : vec2(first_blob.sigma, 0.0);
        float sigma = spread.x;
        Form form = upright_form(1.0);
#if ELLIPSOIDS
        if (run.n_particles == 1u) {
            form = form_of(first_particle);
        } else if (sigma > 0.0) {
            form = upright_form(clamp(spread.y / sigma, MIN_ASPECT, 1.0 / MIN_ASPECT));
        }
#endif
        float scale = max(sigma, sigma_mean);
        vec3 n = normal_at(p, scale, form, group.cloud_center);
        uint facet = push.i_first_facet + g;
        vec3 place = shell_at(p, scale, form, n);
        facets[facet] = Facet(place, s.area, n, group.i_region, color, sigma);
        for (uint k = run.i_first; k < run.i_first + run.n_particles; ++k) {
            i_facet[order[k]] = facet;
        }
    }
}
