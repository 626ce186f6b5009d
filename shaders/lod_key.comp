#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "each.glsl"

// Computes keys by which blobs that one can stand for lie together (passes.md "lod"). In: placed
// particles. Out: entries (key, particle). Law: a key has a class of sizes and a cell, whose edge
// is `lod` times the least sigma of the class. A blob without a class or a cell keeps NO_KEY.
// Error: a blob within rounding of a border may have the key of either side.

#include "lod.glsl"

// first_class: that of the greatest sigma.
layout(push_constant) uniform Push {
    uint n_particles;
    int first_class;
    float lod;
} push;
TEXELS(0, placed)
TEXELS(1, particles)
READS(2, uint, i_group)
READS(3, Textured, textured)
// (key, particle)
WRITES(4, uvec2, entries)

uint key_of(uint i) {
    Placed blob = PLACED_AT(i);
    Particle particle = PARTICLE_AT(i);
    bool is_ball = particle.aspect == 1.0 && particle.aspect_z == 1.0 && particle.turn == uvec2(0);
#if TEXTURED
    is_ball = is_ball && textured[i_group[i]].strength == 0.0;
#endif
    if (!is_ball || !(particle.kappa > 0.0) || !(blob.sigma > 0.0)) {
        return NO_KEY;
    }
    float own = floor(CLASSES_PER_OCTAVE * log2(blob.sigma));
    int size = push.first_class - int(clamp(own, -1e6, 1e6));
    vec3 cell = floor(blob.position / (push.lod * exp2(own / CLASSES_PER_OCTAVE)))
                + float(CELLS_PER_AXIS / 2u);
    bool is_in = all(greaterThanEqual(cell, vec3(0.0)))
                 && all(lessThan(cell, vec3(float(CELLS_PER_AXIS))));
    if (size < 0 || size >= N_CLASSES || !is_in) {
        return NO_KEY;
    }
    uvec3 at = uvec3(cell);
    return uint(size) << 27 | at.z << 18 | at.y << 9 | at.x;
}

void main() {
    FOR_EACH(i, push.n_particles) { entries[i] = uvec2(key_of(i), i); }
}
