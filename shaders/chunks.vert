#version 460

// All of the picture, nearer than anything (docs/model.md §11 "chunks").

void main() {
    bvec2 end = bvec2((gl_VertexIndex & 1) != 0, (gl_VertexIndex & 2) != 0);
    gl_Position = vec4(mix(vec2(-1.0), vec2(1.0), end), 1.0, 1.0);
}
