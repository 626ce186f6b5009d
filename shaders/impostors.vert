#version 460
#extension GL_GOOGLE_include_directive : require
#include "strip.glsl"

// Covers the rectangle where the shell shows anything, at the shell's depth
// (passes.md "impostors").

#include "impostors.glsl"

void main() { gl_Position = vec4(corner_of_strip(push.low, push.high), push.depth, 1.0); }
