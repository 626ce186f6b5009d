#version 460
#extension GL_GOOGLE_include_directive : require
#include "strip.glsl"

// Covers the whole picture at the nearest depth (passes.md "chunks").

void main() { gl_Position = vec4(corner_of_strip(vec2(-1.0), vec2(1.0)), 1.0, 1.0); }
