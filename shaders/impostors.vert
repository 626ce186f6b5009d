#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"

// The whole picture, as far off as what the shell shows (docs/model.md §11 "impostors").

layout(push_constant) uniform Push { vec3 column; float depth; vec3 row; uint width; vec3 under; uint height; vec2 middle; vec2 unused; } push;

void main() {
    gl_Position = vec4((gl_VertexIndex & 1) != 0 ? 1.0 : -1.0, (gl_VertexIndex & 2) != 0 ? 1.0 : -1.0, push.depth, 1.0);
}
