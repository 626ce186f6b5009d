// Constants that the kernels of `cull` share (passes.md "cull").

// Particles of a tile: eight words of a bit each.
const uint TILE = 256;
const uint WORDS = 8;
