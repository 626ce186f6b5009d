//! Running bounds of the shaders' evaluation of a texture.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::sync::Arc;

use glam::DVec2;
use nimbus::layout::particle::TexturedRecord;
use nimbus::reference::texture::{Level, PERIOD_SIGMA, Pool, QUANTUM, SIDE, SplatTexture, side};

use crate::bounded::{Bounded, U};
use crate::picture::Picture;

/// Error of unit_at.
const UNIT_AT: f64 = 10.0 * U;

/// Outputs of the vertex shader for a texture.
pub struct Paper<'a> {
    sheet: SplatTexture,
    pool: &'a Pool,
    level: &'a Level,
    fade: Bounded,
    turn: [Bounded; 2],
    /// Largest change of n from a texel to the next; largest n_l and n_{l+1}.
    slope: f64,
    heights: [f64; 2],
    /// Difference of n between two levels that rounding may exchange.
    step: f64,
}

impl Paper<'_> {
    /// `z_in_sigma`: view depth over σ; `pixel`: difference of slopes between neighbouring pixels.
    pub fn new(sheet: SplatTexture, pool: &Pool, z_in_sigma: Bounded, pixel: f64) -> Paper<'_> {
        let dense =
            Bounded::once(SIDE as f64 / PERIOD_SIGMA).times(z_in_sigma.times(Bounded::once(pixel)));
        let level = &pool.0[sheet.i_field][sheet.level];
        // If the level is uncertain, the numbers of the next level may replace these; they are
        // rounded again.
        let near_step = (dense.value.log2() - dense.value.log2().round()).abs()
            < 2.0 * dense.error / dense.value;
        let fade = Bounded {
            value: sheet.fade,
            error: dense.error / f64::from(1 << sheet.level) + 2.0 * U,
        };
        let stretch = Bounded::once(side(sheet.level) as f64 / PERIOD_SIGMA).times(z_in_sigma);
        let unit = |value| Bounded { value, error: UNIT_AT };
        let turn = [sheet.angle.cos(), sheet.angle.sin()].map(|v| stretch.times(unit(v)));
        // n is continuous and piecewise bilinear: nowhere steeper than the differences of
        // neighbours.
        let slope = (1.0 - sheet.fade) * steepest(&level.own, level.side)
            + sheet.fade * steepest(&level.above, level.side);
        let heights =
            [&level.own, &level.above].map(|n| n.iter().fold(0.0, |a: f64, b| a.max(b.abs())));
        Paper {
            sheet,
            pool,
            level,
            fade,
            turn,
            slope,
            heights,
            step: if near_step { QUANTUM } else { 0.0 },
        }
    }

    /// Evaluates s n − s² ⟨n²⟩/2 as the fragment shader does.
    pub fn exponent(&self, d: [Bounded; 2]) -> Bounded {
        let (sheet, s) = (&self.sheet, self.sheet.strength);
        let [a, b] = self.turn;
        let shift = sheet.shift * self.level.side as f64;
        let x = a.times(d[0]).minus(b.times(d[1])).plus(Bounded::exact(shift.x));
        let y = b.times(d[0]).plus(a.times(d[1])).plus(Bounded::exact(shift.y));
        let delta = DVec2::new(d[0].value, d[1].value);
        let n = sheet.n(self.pool, delta);
        let [own, above] = self.heights;
        let height = (1.0 - sheet.fade) * own + sheet.fade * above;
        // Two gains of three roundings, their products and sum; two interpolations of three
        // roundings, on differences of at most twice the height; the subtraction of the mean.
        let half = sheet.half_square();
        let error = s * self.slope * (x.error + y.error)
            + s * (self.fade.error * (own + above) + self.step)
            + 24.0 * U * s * height
            + s * s * self.fade.error
            + 10.0 * U * half
            + 2.0 * U * (s * n - half).abs();
        Bounded { value: s * n - half, error }
    }
}

/// Returns the greatest difference between neighbours.
fn steepest(n: &[f64], side: usize) -> f64 {
    let at = |i: usize, j: usize| n[i % side + side * (j % side)];
    let of = |k: usize| {
        let (i, j) = (k % side, k / side);
        (at(i + 1, j) - at(i, j)).abs().max((at(i, j + 1) - at(i, j)).abs())
    };
    (0..n.len()).map(of).fold(0.0, f64::max)
}

/// Returns blobs of one texture each, from larger than the picture to smaller than a pixel, so that
/// every level and everything between levels occurs; one blob has no texture.
pub fn textured(mut picture: Picture, pool: &Arc<Pool>) -> Picture {
    let sizes = [1.3, 0.6, 0.41, 0.3, 0.2, 0.13, 0.1, 0.07, 0.05, 0.035, 0.02, 0.012, 0.006];
    for (k, sigma) in sizes.into_iter().enumerate() {
        let turn = 0.5 * k as f64;
        let at = picture.at(1.8 * turn.cos(), 1.3 * turn.sin(), 5.0 + 0.2 * turn);
        picture = picture.blob(at, sigma, 0.9);
    }
    let record = |i: u32| TexturedRecord {
        seed: 9,
        i_box: i,
        i_first: i / 2,
        i_field: i % 8,
        strength: if i == 4 { 0.0 } else { 0.5 + 0.1 * i as f32 },
    };
    let n = picture.placed.len() as u32;
    Picture {
        textured: Some(((0..n).collect(), (0..n).map(record).collect(), pool.clone())),
        ..picture
    }
}
