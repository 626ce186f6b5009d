// What the kernels of `tiles` share (docs/model.md §11 "tiles").

// Splats of a block: what one workgroup of tiles_splat makes.
const uint BLOCK = 256;
// A bin has 4 x 4 tiles: as many as bits are left beside its number in a pair.
const uint TILES_ACROSS = 4;
const uint BIN_BITS = 16;

// A round: as many blocks of splats as there is room for the pairs of at once. `extent`: workgroups that sort, 1, 1, pairs;
// `blocks`: how many, 1, 1, the first; `bins`: workgroups that look for the bins' pairs, 1, 1, whether a later round has any;
// `tiles`: workgroups that compose along x, along y, 1, tiles of bins that have pairs.
struct Round { uvec4 extent; uvec4 blocks; uvec4 bins; uvec4 tiles; };
