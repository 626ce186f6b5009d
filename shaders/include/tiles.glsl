// Constants that the kernels of `tiles` share (passes.md "tiles").

// Splats of a block: what one workgroup of tiles_splat makes.
const uint BLOCK = 256;
// A bin has 4 x 4 tiles: a pair holds one bit for each beside the bin's number.
const uint TILES_ACROSS = 4;
const uint BIN_BITS = 16;
