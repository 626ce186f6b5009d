// The records of src/layout/, in std430. tests/layout.rs compares names, offsets and sizes.

#include "buffers.glsl"

struct Particle {
    vec3 position;
    float sigma;
    vec3 color;
    float kappa;
    float aspect;
    float aspect_z;
    uvec2 turn;
};
struct Box {
    vec3 extent;
    float radius_max;
    float sigma_factor;
    float kappa;
    uint seed;
    uint i_box;
    uint i_first;
    uint n_particles;
    uint form;
    uint unused;
};
struct Disc {
    vec3 center;
    float radius;
    vec3 drift;
    float outflow;
    float sigma;
    float sigma_spread;
    float rise;
    float warmth_spread;
    float core;
    float life_spread;
    float cooling;
    float growth;
    float kappa;
    float inv_fade_in;
    float inv_fade_out;
    float base;
    float inv_over;
    float lift;
    uint dilution;
    uint seed;
    uint i_first;
    uint n_particles;
    uint generation;
    uint phase;
};
struct Placed {
    vec3 position;
    float sigma;
};
struct Group {
    vec3 offset;
    uint i_region;
    vec3 cloud_center;
    float sigma_mean;
    vec3 center;
    uint i_mode;
    uint n_modes;
    float scale;
    uvec2 unused;
};
struct Drawn {
    uint shift;
    uint end;
    float kappa_scale;
    float last_weight;
};
struct Kept {
    uvec4 sort;
    uvec4 draw;
    uvec4 splat;
    uvec4 points;
};
struct SplatTexture {
    vec4 turn;
    vec3 gain;
    uint i_texel;
    uint log2_side;
    uint unused;
    uvec2 unused_too;
};
struct Round {
    uvec4 extent;
    uvec4 blocks;
    uvec4 bins;
    uvec4 tiles;
    uvec4 alone;
};
struct Splat {
    vec2 center;
    float scale;
    float tau;
    vec3 radiance;
    float depth;
};
struct Textured {
    uint seed;
    uint i_box;
    uint i_first;
    uint i_field;
    float strength;
};
struct Mode {
    vec3 k;
    float phase;
    vec3 a;
    uint unused;
};
struct Facet {
    vec3 position;
    float area;
    vec3 normal;
    uint i_region;
    vec3 color;
    float sigma;
};
struct Run {
    uint i_first;
    uint n_particles;
};
struct Lit {
    vec3 direct;
    float n_unresolved;
    vec3 indirect;
    float unresolved;
    vec3 first;
    float n_lost;
    vec3 second;
    float unused;
};
struct Slope {
    vec3 relative;
    uint unused;
    vec3 position;
    uint unused_too;
};
struct Region {
    vec3 kd;
    uint kind;
    vec3 ks;
    uint i_lobe;
    vec3 center;
    uint i_first_facet;
    vec3 u;
    uint n_facets;
    vec3 v;
    uint n_u;
    vec3 normal;
    uint n_v;
    float lobe_width;
    float lobe_width_most;
    uint i_column;
    uint i_row;
};
struct RegionBounds {
    vec3 low;
    uint unused;
    vec3 scale;
    uint unused_too;
};
struct Source {
    vec4 place;
    vec4 sent;
    vec4 face;
    vec4 extent;
    vec4 leaning;
};
struct Packed {
    uvec4 ab;
    uvec4 cd;
};
struct Block {
    uint i_first;
    uint n_facets;
    uint i_pairing;
    uint n_pairings;
};
struct Pairing {
    uint i_region;
    uint i_occluder;
    uint n_occluders;
    uint i_source;
    uint n_sources;
};
struct Node {
    uint n_nodes;
};
struct ReliefNode {
    vec3 low;
    uint end;
    vec3 high;
    uint i_cell;
};
struct Light {
    vec3 toward;
    uint kind;
    vec3 energy;
    float constant;
    vec3 position;
    float radius;
    float cone_scale;
    float cone_offset;
    vec2 unused;
    vec3 tilt_x;
    float unused_a;
    vec3 tilt_y;
    float unused_b;
    vec3 tilt_z;
    float unused_c;
};
struct Medium {
    vec3 reflected;
    uint is_given;
    float g;
    float straight;
    float lobe;
    float mean;
    float draine_lobe;
    float draine_alpha;
    float draine_share;
    uint unused;
};
struct Grid {
    vec3 low;
    float cell;
    uvec3 n_cells;
    float inv_cell;
    float aspect;
    float inv_aspect;
    vec2 unused;
};
struct Camera {
    vec3 eye;
    float tan_x;
    vec3 right;
    float tan_y;
    vec3 up;
    float near;
    vec3 forward;
    float unused;
};
struct Sky {
    Camera camera;
    vec3 a;
    float height;
    vec3 b;
    float unit;
    vec3 c;
    float flatness;
    vec3 d;
    float haze;
    vec3 e;
    uint has_ground;
    vec3 f;
    float inv_molecules;
    vec3 g;
    float inv_aerosol;
    vec3 h;
    float inv_sun;
    vec3 i;
    float unused;
    vec3 scale;
    float unused_a;
    vec3 toward_sun;
    float unused_b;
    vec3 disc;
    float unused_c;
    vec3 molecules;
    float unused_d;
    vec3 aerosol;
    float unused_e;
    vec3 ground;
    float slopes;
    vec3 sun;
    float unused_f;
};

// In place of a particle's number: an entry that draws nothing.
const uint NO_PARTICLE = 0xFFFFFFFFu;

const uint FORM_CENTRED = 0;
const uint FORM_PRINTED = 1;
const uint FORM_GIVEN = 2;

const uint LIGHT_DIRECTIONAL = 0;
const uint LIGHT_SKY = 1;
const uint LIGHT_POINT = 2;

const uint REGION_SURFACE = 0;
const uint REGION_CLOUD = 1;
const uint REGION_COLORED = 2;
const uint REGION_TERRAIN = 3;
const uint NO_LOBE = 0xFFFFFFFFu;
