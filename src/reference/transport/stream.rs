//! Random numbers of one path.

use crate::model::philox::philox4x32_10;

/// First word of the Philox key: paths in media share no random numbers with particles and with
/// paths between facets.
const KEY: u32 = 0x7472_616e;

/// The random numbers of one path, by its pixel and sample: the same whatever thread follows it.
#[derive(Debug, Clone)]
pub struct Stream {
    counter: [u32; 4],
    words: [u32; 4],
    n_left: usize,
}

impl Stream {
    /// Returns the numbers of sample `i_sample` of the pixel of that number.
    pub fn new(i_pixel: u32, i_sample: u32) -> Stream {
        Stream { counter: [0, 0, i_pixel, i_sample], words: [0; 4], n_left: 0 }
    }

    /// Returns the next number, uniform in (0, 1): the middle of one of 2³² equal parts.
    pub fn uniform(&mut self) -> f64 {
        if self.n_left == 0 {
            self.words = philox4x32_10([KEY, 0], self.counter);
            self.n_left = 4;
            self.counter[0] = self.counter[0].wrapping_add(1);
            if self.counter[0] == 0 {
                self.counter[1] = self.counter[1].wrapping_add(1);
            }
        }
        self.n_left -= 1;
        (f64::from(self.words[self.n_left]) + 0.5) * (1.0 / 4_294_967_296.0)
    }

    /// Returns the next optical depth to a collision: exponential of mean 1.
    pub fn exponential(&mut self) -> f64 {
        -self.uniform().ln()
    }
}
