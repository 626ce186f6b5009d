// The push constants of the impostors' two shaders.

// The homography from pixels off the picture's middle to texels off the shell's middle: (column,
// row) over under.
layout(push_constant) uniform Push {
    vec3 column;
    float depth;
    vec3 row;
    uint width;
    vec3 under;
    uint height;
    vec2 middle;
    vec2 low;
    vec2 high;
} push;
