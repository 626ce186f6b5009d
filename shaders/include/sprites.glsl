// The push constants of the sprites' two shaders. Needs records.glsl.
layout(push_constant) uniform Push {
    Camera camera;
    vec2 pixel;
    float cutoff;
    uint i_first_facet;
    float inv_threshold;
    float least_cut;
    uint i_first;
} push;
