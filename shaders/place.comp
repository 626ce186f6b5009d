#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
#include "each.glsl"
#include "functions.glsl"

// Places particles for this frame: position, as it has grown, + its group's offset + the gusts'
// displacement (passes.md "place", model.md §12, §13).
// In: particles, groups, gust modes. Out: positions relative to the lighting origin, and sigma.
// Error: a few roundings, and sine()'s.

layout(push_constant) uniform Push { uint n_particles; } push;
TEXELS(0, particles)
READS(1, uint, i_group)
READS(2, Group, groups)
READS(3, Mode, modes)
TEXEL_STORES(4, placed)

void main() {
    FOR_EACH(i, push.n_particles) {
        Group group = groups[i_group[i]];
        Particle particle = PARTICLE_AT(i);
        vec3 rest = particle.position * group.scale;
        vec3 x = rest + group.center;
        vec3 d = vec3(0.0);
        for (uint m = group.i_mode; m < group.i_mode + group.n_modes; ++m) {
            d += modes[m].a * sine(dot(modes[m].k, x) + modes[m].phase);
        }
        STORE_PLACED(i, rest + group.offset + d, particle.sigma * group.scale);
    }
}
