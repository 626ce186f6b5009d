#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "one_subgroup.glsl"

// Replaces each run of blobs of one key and region by one blob (passes.md "lod"). In: sorted
// entries, placed particles. Out: places and particles in which the run's blob has the number of
// the member nearest to its centre. The others have no extinction, and nothing else of them is
// written. Law: mass, mean place and mean variance of the members, and their mean colour by mass. A
// run of one is copied. Error: some roundings of sums of at most RUN terms.
//
// A workgroup looks for the runs of RUN entries first. Then each invocation has a run: one entry in
// many begins a run, and invocations that follow the entries would mostly wait.

#include "lod.glsl"

// 1: there are several regions, whose blobs are not merged.
#ifndef REGIONS
#define REGIONS 1
#endif

#ifndef WORKGROUP
#define WORKGROUP 32
#endif
layout(local_size_x = WORKGROUP) in;

layout(push_constant) uniform Push { uint n_particles; } push;
// (key, particle), in ascending key
READS(0, uvec2, entries)
TEXELS(1, placed)
TEXELS(2, particles)
READS(3, uint, i_group)
READS(4, Group, groups)
TEXEL_STORES(5, drawn_placed)
TEXEL_STORES(6, drawn_particles)

// The first entries of the runs, in any order, and their number.
shared uint firsts[RUN];
shared uint n_runs;

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

// Writes what is read of a blob that is drawn.
void store(uint i, Placed blob, vec3 color, float kappa) {
    Particle particle = PARTICLE_AT(i);
    STORE_TEXEL(drawn_placed, int(i), floatBitsToUint(vec4(blob.position, blob.sigma)));
    STORE_TEXEL(drawn_particles, int(3u * i + 1u), floatBitsToUint(vec4(color, kappa)));
    uvec2 aspects = floatBitsToUint(vec2(particle.aspect, particle.aspect_z));
    STORE_TEXEL(drawn_particles, int(3u * i + 2u), uvec4(aspects, particle.turn));
}

// Replaces the run from entry k on. Masses, lengths and colours are taken relative to the first
// member's: that keeps rounding small, and cubes of sigma cannot overflow.
void merge(uint k) {
    uint first = entries[k].y;
    Placed of_first = PLACED_AT(first), merged = of_first;
    Particle particle = PARTICLE_AT(first);
    float mass = 1.0, variance = 1.0;
    vec3 position = vec3(0.0), color_sum = vec3(0.0);
    uint end = k + 1u;
    while (end < push.n_particles && follows(end)) {
        uint i = entries[end].y;
        Placed blob = PLACED_AT(i);
        Particle other = PARTICLE_AT(i);
        float size = blob.sigma / of_first.sigma;
        float m = other.kappa / particle.kappa * size * size * size;
        vec3 d = (blob.position - of_first.position) / of_first.sigma;
        mass += m;
        variance += m * (size * size + dot(d, d) / 3.0);
        position += m * d;
        color_sum += m * (other.color - particle.color);
        ++end;
    }
    uint own = first;
    float kappa = particle.kappa;
    vec3 color = particle.color;
    if (end > k + 1u) {
        vec3 d = position / mass;
        // The places' spread about their mean is that about the first one less d.
        float size = sqrt(variance / mass - dot(d, d) / 3.0);
        merged.position += d * of_first.sigma;
        merged.sigma *= size;
        kappa *= mass / (size * size * size);
        color += color_sum / mass;
        float nearest = 3.4e38;
        for (uint at = k; at < end; ++at) {
            uint i = entries[at].y;
            vec3 off = (PLACED_AT(i).position - merged.position) / of_first.sigma;
            float square = dot(off, off);
            own = square < nearest ? i : own;
            nearest = min(nearest, square);
            STORE_TEXEL(drawn_particles, int(3u * i + 1u), uvec4(0u));
        }
    }
    store(own, merged, color, kappa);
}

void main() {
    uint n_blocks = (push.n_particles + RUN - 1u) / RUN;
    for (uint block = gl_WorkGroupID.x; block < n_blocks; block += gl_NumWorkGroups.x) {
        if (lane() == 0u) {
            n_runs = 0u;
        }
        wait_for_all();
        for (uint j = lane(); j < RUN; j += WORKGROUP) {
            uint k = block * RUN + j;
            if (k < push.n_particles && !follows(k)) {
                firsts[atomicAdd(n_runs, 1u)] = k;
            }
        }
        wait_for_all();
        for (uint j = lane(); j < n_runs; j += WORKGROUP) {
            merge(firsts[j]);
        }
        wait_for_all();
    }
}
