// The layout of T2: [light][row / TILE][column][row % TILE]. Rows of neighbouring facets lie side
// by side, and a sum over columns walks on through memory. The number of rows is a multiple of TILE
// (src/frame/tensor_shape.rs).

const uint TILE = 64u;

// Returns the index of a light's first column; column c lies c * TILE further.
uint second_at(uint i_light, uint row, uint n_rows, uint n_columns) {
    return (i_light * n_rows + row / TILE * TILE) * n_columns + row % TILE;
}
