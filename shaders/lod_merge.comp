#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "each.glsl"

// Replaces each run of blobs of one key and region by one blob (passes.md "lod"). In: sorted
// entries, placed particles. Out: places and particles in which the run's blob has the number of
// the member nearest to its centre. The others have no extinction, and nothing else of them is
// written. Law: mass, mean place and mean variance of the members, and their mean colour by mass. A
// run of one is copied. Error: some roundings of sums of at most RUN terms.

#include "lod.glsl"

// 1: there are several regions, whose blobs are not merged.
#ifndef REGIONS
#define REGIONS 1
#endif

layout(push_constant) uniform Push { uint n_particles; } push;
// (key, particle), in ascending key
READS(0, uvec2, entries)
TEXELS(1, placed)
TEXELS(2, particles)
READS(3, uint, i_group)
READS(4, Group, groups)
TEXEL_STORES(5, drawn_placed)
TEXEL_STORES(6, drawn_particles)

#if REGIONS
uint region_at(uint k) { return groups[i_group[entries[k].y]].i_region; }
#endif

// Returns whether the blob at place k is one of the run that has the blob before.
bool follows(uint k) {
    uint key = entries[k].x;
    bool is_alike = k % RUN != 0u && key != NO_KEY && key == entries[k - 1u].x;
#if REGIONS
    is_alike = is_alike && region_at(k) == region_at(k - 1u);
#endif
    return is_alike;
}

float mass_of(Placed blob, Particle particle) {
    return particle.kappa * blob.sigma * blob.sigma * blob.sigma;
}

// Writes what is read of a blob that is drawn.
void store(uint i, Placed blob, vec3 color, float kappa) {
    Particle particle = PARTICLE_AT(i);
    STORE_TEXEL(drawn_placed, int(i), floatBitsToUint(vec4(blob.position, blob.sigma)));
    STORE_TEXEL(drawn_particles, int(3u * i + 1u), floatBitsToUint(vec4(color, kappa)));
    uvec2 aspects = floatBitsToUint(vec2(particle.aspect, particle.aspect_z));
    STORE_TEXEL(drawn_particles, int(3u * i + 2u), uvec4(aspects, particle.turn));
}

void main() {
    FOR_EACH(k, push.n_particles) {
        if (!follows(k)) {
            uint first = entries[k].y;
            Placed of_first = PLACED_AT(first);
            Particle particle = PARTICLE_AT(first);
            // Sums are taken about the first member, which keeps their rounding small.
            float mass = mass_of(of_first, particle);
            float variance = mass * of_first.sigma * of_first.sigma;
            vec3 position = vec3(0.0), color_sum = vec3(0.0);
            uint end = k + 1u;
            while (end < push.n_particles && follows(end)) {
                uint i = entries[end].y;
                Placed blob = PLACED_AT(i);
                Particle other = PARTICLE_AT(i);
                float m = mass_of(blob, other);
                vec3 d = blob.position - of_first.position;
                mass += m;
                variance += m * (blob.sigma * blob.sigma + dot(d, d) / 3.0);
                position += m * d;
                color_sum += m * (other.color - particle.color);
                ++end;
            }
            uint own = first;
            Placed merged = of_first;
            float kappa = particle.kappa;
            vec3 color = particle.color;
            if (end > k + 1u) {
                vec3 d = position / mass;
                merged.position += d;
                // The places' spread about their mean is that about the first one less d.
                merged.sigma = sqrt(variance / mass - dot(d, d) / 3.0);
                kappa = mass / (merged.sigma * merged.sigma * merged.sigma);
                color += color_sum / mass;
                float nearest = 3.4e38;
                for (uint at = k; at < end; ++at) {
                    uint i = entries[at].y;
                    vec3 off = PLACED_AT(i).position - merged.position;
                    float square = dot(off, off);
                    own = square < nearest ? i : own;
                    nearest = min(nearest, square);
                    STORE_TEXEL(drawn_particles, int(3u * i + 1u), uvec4(0u));
                }
            }
            store(own, merged, color, kappa);
        }
    }
}
