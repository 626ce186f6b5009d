// The records of src/layout/, in std430. tests/layout.rs compares names, offsets and sizes.

struct Particle { vec3 position; float sigma; vec3 color; float kappa; };
struct Box { vec3 extent; float radius_max; float sigma_factor; float kappa; uint seed; uint i_box; uint i_first; uint n_particles; uint form; uint unused; };
struct Placed { vec3 position; float sigma; };
struct Group { vec3 offset; uint i_region; vec3 cloud_center; float sigma_mean; vec3 kd; uint n_modes; vec3 center; uint i_mode; };
struct Mode { vec3 k; float phase; vec3 a; uint unused; };
struct Facet { vec3 position; float area; vec3 normal; uint i_region; };
struct Lit { vec4 irradiance; vec4 radiance; };
struct Light { vec3 toward; uint kind; vec3 irradiance; float constant; };
struct Grid { vec3 low; float cell; uvec3 n_cells; float inv_cell; };
struct Camera { vec3 eye; float tan_x; vec3 right; float tan_y; vec3 up; float near; vec3 forward; float unused; };

const uint FORM_CENTRED = 0;
const uint FORM_PRINTED = 1;
const uint FORM_GIVEN = 2;

const uint LIGHT_DIRECTIONAL = 0;
const uint LIGHT_SKY = 1;
