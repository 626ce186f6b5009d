#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"

// Where the shell shows anything, as far off as that is (docs/model.md §11 "impostors").

layout(push_constant) uniform Push { vec3 column; float depth; vec3 row; uint width; vec3 under; uint height; vec2 middle; vec2 low; vec2 high; } push;

void main() {
    bvec2 end = bvec2((gl_VertexIndex & 1) != 0, (gl_VertexIndex & 2) != 0);
    gl_Position = vec4(mix(push.low, push.high, end), push.depth, 1.0);
}
