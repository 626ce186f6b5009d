#version 460

// Covers the whole window.
void main() {
    vec2 at = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    gl_Position = vec4(2.0 * at - 1.0, 0.0, 1.0);
}
