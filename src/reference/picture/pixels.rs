//! The pixels that a reference is computed at: all of them, or one in each cell of a square grid.

use crate::model::philox::{philox4x32_10, uniform};

/// Second word of the Philox key: pixels share no random numbers with particles and paths.
const KEY: u32 = 0x7069_7873;

/// A rectangle of pixels of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tile {
    /// First column.
    pub left: u32,
    /// First row, counted from the top.
    pub top: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl Tile {
    /// Returns the tile that is the whole picture.
    pub fn whole(width: u32, height: u32) -> Tile {
        Tile { left: 0, top: 0, width, height }
    }

    /// Returns the number of pixels.
    pub fn n_pixels(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Returns [column, row] of every pixel, row by row.
    pub fn pixels(self) -> impl Iterator<Item = [u32; 2]> {
        let Tile { left, top, width, height } = self;
        (top..top + height).flat_map(move |j| (left..left + width).map(move |i| [i, j]))
    }
}

/// Pixels of a picture or of one of its tiles, one a cell, rows of cells from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pixels {
    /// Columns of the whole picture.
    pub width: u32,
    /// Rows of the whole picture.
    pub height: u32,
    /// The tile that the pixels lie in.
    pub tile: Tile,
    /// Side of a cell, in pixels.
    pub cell: u32,
    /// [column, row] of the whole picture, one a cell.
    pub at: Vec<[u32; 2]>,
}

impl Pixels {
    /// Selects one random pixel in each cell, at most `n` apart from the cells that the picture's
    /// edges cut. The mean over the pixels estimates the picture's mean, with cut cells weighted as
    /// whole ones.
    pub fn sample(width: u32, height: u32, n: usize) -> Pixels {
        let all = f64::from(width) * f64::from(height);
        let cell = ((all / n.max(1) as f64).sqrt().ceil() as u32).max(1);
        let (columns, rows) = (width.div_ceil(cell), height.div_ceil(cell));
        let place = |i: u32, j: u32| {
            let words = philox4x32_10([0, KEY], [i, j, cell, 0]);
            let within = |k: u32, size: u32, word: u32| {
                let (first, end) = (k * cell, size.min((k + 1) * cell));
                first + ((uniform(word) * f64::from(end - first)) as u32).min(end - first - 1)
            };
            [within(i, width, words[0]), within(j, height, words[1])]
        };
        let at = (0..rows)
            .flat_map(|j| (0..columns).map(move |i| (i, j)))
            .map(|(i, j)| place(i, j))
            .collect();
        Pixels { width, height, tile: Tile::whole(width, height), cell, at }
    }

    /// Selects all pixels of `tile`, which lies within the picture.
    pub fn tile(width: u32, height: u32, tile: Tile) -> Pixels {
        Pixels { width, height, tile, cell: 1, at: tile.pixels().collect() }
    }

    /// Selects all pixels of the picture.
    pub fn all(width: u32, height: u32) -> Pixels {
        Pixels::sample(width, height, usize::MAX)
    }

    /// Returns the number of cells in a row.
    pub fn n_columns(&self) -> u32 {
        self.tile.width.div_ceil(self.cell)
    }

    /// Returns the number of rows of cells.
    pub fn n_rows(&self) -> u32 {
        self.tile.height.div_ceil(self.cell)
    }

    /// Returns the index of a pixel in the whole picture, row by row.
    pub fn index(&self, [i, j]: [u32; 2]) -> usize {
        j as usize * self.width as usize + i as usize
    }

    /// Returns a number that identifies pixel `k`, the same in a whole picture and in its tiles.
    pub fn number(&self, k: usize) -> usize {
        if self.cell == 1 { self.index(self.at[k]) } else { k }
    }

    /// Picks the pixels' values from a whole picture, row 0 at the top.
    pub fn pick<T: Copy>(&self, whole: &[T]) -> Vec<T> {
        self.at.iter().map(|&at| whole[self.index(at)]).collect()
    }

    /// Picks the pixels' values from those of all pixels of their tile.
    pub fn pick_tile<T: Copy>(&self, of_tile: &[T]) -> Vec<T> {
        let Tile { left, top, width, .. } = self.tile;
        let place = |[i, j]: [u32; 2]| (j - top) as usize * width as usize + (i - left) as usize;
        self.at.iter().map(|&at| of_tile[place(at)]).collect()
    }

    /// Returns a whole picture that shows its pixel's value in every cell. The pixels are of the
    /// whole picture.
    pub fn spread<T: Copy>(&self, values: &[T]) -> Vec<T> {
        let columns = self.n_columns();
        let of = |i: u32, j: u32| values[((j / self.cell) * columns + i / self.cell) as usize];
        (0..self.height).flat_map(|j| (0..self.width).map(move |i| of(i, j))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_has_one_pixel_in_each_cell() {
        let pixels = Pixels::sample(80, 61, 500);
        // 4880/500 = 9.76: cells of 4, 20 by 16 of them.
        assert_eq!(
            (pixels.cell, pixels.n_columns(), pixels.n_rows(), pixels.at.len()),
            (4, 20, 16, 320)
        );
        for (k, [i, j]) in pixels.at.iter().enumerate() {
            assert_eq!((i / 4, j / 4), (k as u32 % 20, k as u32 / 20));
            assert!(*i < 80 && *j < 61);
        }
        // Every place within a cell is selected somewhere.
        let mut places: Vec<u32> = pixels.at.iter().map(|[i, j]| i % 4 + 4 * (j % 4)).collect();
        places.sort_unstable();
        places.dedup();
        assert_eq!(places.len(), 16);
    }

    #[test]
    fn whole_pictures_and_tiles_pick_and_spread_their_pixels() {
        let pixels = Pixels::all(5, 3);
        let whole: Vec<u32> = (0..15).collect();
        assert_eq!((pixels.pick(&whole), pixels.spread(&whole)), (whole.clone(), whole.clone()));
        let tile = Tile { left: 3, top: 1, width: 2, height: 2 };
        let of_tile = Pixels::tile(5, 3, tile);
        assert_eq!(of_tile.pick(&whole), [8, 9, 13, 14]);
        assert_eq!(of_tile.pick_tile(&[5, 6, 7, 8]), [5, 6, 7, 8]);
        assert_eq!(pixels.pick_tile(&whole), whole);
        assert_eq!((0..4).map(|k| of_tile.number(k)).collect::<Vec<_>>(), [8, 9, 13, 14]);
        assert_eq!((of_tile.n_columns(), of_tile.n_rows()), (2, 2));
        let pixels = Pixels::sample(4, 4, 4);
        assert_eq!(pixels.spread(&[1, 2, 3, 4])[..6], [1, 1, 2, 2, 1, 1]);
    }
}
