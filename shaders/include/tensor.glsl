// Where T2 holds its numbers: [light][row / TILE][column][row % TILE], so that rows of neighbouring
// facets lie side by side, and a sum over columns walks on through memory. There are a multiple of
// TILE rows (src/frame/tensor.rs).

const uint TILE = 64u;

// Of the first column of a light; column c lies c * TILE further.
uint second_at(uint i_light, uint row, uint n_rows, uint n_columns) {
    return (i_light * n_rows + row / TILE * TILE) * n_columns + row % TILE;
}
