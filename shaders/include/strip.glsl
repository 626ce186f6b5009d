// Returns the corner of a strip of four vertices over the rectangle [low, high].
vec2 corner_of_strip(vec2 low, vec2 high) {
    bvec2 end = bvec2((gl_VertexIndex & 1) != 0, (gl_VertexIndex & 2) != 0);
    return mix(low, high, end);
}
