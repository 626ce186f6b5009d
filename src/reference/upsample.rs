//! Composition of the blobs' low-resolution picture over the full one, passes.md "upsample", in
//! f64.
//!
//! In: the small picture, of blobs alone; with surfaces their picture, and near/z of small and full
//! pixels. Out: [row][column] of [C_r, C_g, C_b, A], row 0 at the top, and the sum of the
//! magnitudes of each value's terms.

use crate::model::resolution::{ALIKE, LowResLayout};

/// Surfaces under the blobs.
#[derive(Debug, Clone, Copy)]
pub struct OpaqueLayer<'a> {
    /// Picture of the surfaces.
    pub picture: &'a [[f64; 4]],
    /// near/z of the full pixels; 0 where nothing is seen.
    pub depths: &'a [f64],
    /// near/z of the small pixels; 0 where nothing is seen.
    pub small_depths: &'a [f64],
}

/// A value and the sum of its terms' magnitudes, which bounds its rounding.
pub type Summed = ([f64; 4], [f64; 4]);

/// Returns Lagrange's weights of the n taps from −(n/2 − 1) on, at t in [0, 1).
fn lagrange(n: i32, t: f64) -> Vec<f64> {
    let taps = || 1 - n / 2..=n / 2;
    let weight = |k: i32| {
        let others = taps().filter(|m| *m != k);
        others.map(|m| (t - f64::from(m)) / f64::from(k - m)).product()
    };
    taps().map(weight).collect()
}

/// Returns the relative difference of two depths; 0 if it is at most `alike`, so that they are of
/// one surface.
pub fn apart(a: f64, b: f64, alike: f64) -> f64 {
    let (nearer, by) = (a.max(b), (a - b).abs());
    if by <= alike * nearer { 0.0 } else { by / nearer }
}

/// Composes the whole picture.
pub fn render(
    small: &LowResLayout,
    blobs: &[[f64; 4]],
    under: Option<&OpaqueLayer<'_>>,
) -> Vec<Summed> {
    render_alike(small, blobs, under, ALIKE)
}

/// Composes with another tolerance of depths of one surface.
pub fn render_alike(
    small: &LowResLayout,
    blobs: &[[f64; 4]],
    under: Option<&OpaqueLayer<'_>>,
    alike: f64,
) -> Vec<Summed> {
    let rows = (0..small.full[1]).flat_map(|j| (0..small.full[0]).map(move |i| [i, j]));
    rows.map(|pixel| {
        let (mut sum, mut of_terms) = interpolated(small, blobs, under, pixel, alike);
        for (k, v) in sum.iter_mut().enumerate() {
            *v = if k < 3 { v.max(0.0) } else { v.clamp(0.0, 1.0) };
        }
        if let Some(under) = under {
            let behind = under.picture[(pixel[1] * small.full[0] + pixel[0]) as usize];
            let (passed, of_alpha) = (1.0 - sum[3], of_terms[3]);
            for k in 0..4 {
                sum[k] += passed * behind[k];
                of_terms[k] += (1.0 + of_alpha) * behind[k].abs();
            }
        }
        (sum, of_terms)
    })
    .collect()
}

/// Interpolates the small picture at a full pixel.
fn interpolated(
    small: &LowResLayout,
    blobs: &[[f64; 4]],
    under: Option<&OpaqueLayer<'_>>,
    pixel: [u32; 2],
    alike: f64,
) -> Summed {
    let (o, whole) = (small.offsets(), 2 * small.n);
    let q = [0, 1].map(|k| o[k] + 2 * pixel[k]);
    let (base, t) = (q.map(|q| q / whole), q.map(|q| f64::from(q % whole) / f64::from(whole)));
    let at = |x: u32, y: u32| ((base[1] + y - 2) * small.size[0] + base[0] + x - 2) as usize;
    let of_order = |n: u32, within: &dyn Fn(u32, u32) -> bool| {
        let w = [0, 1].map(|k| lagrange(n as i32, t[k]));
        let first = 3 - n / 2;
        let mut taps = Vec::new();
        for y in first..first + n {
            for x in first..first + n {
                if within(x, y) {
                    taps.push((at(x, y), w[0][(x - first) as usize] * w[1][(y - first) as usize]));
                }
            }
        }
        taps
    };
    let Some(under) = under else { return summed(blobs, &of_order(6, &|_, _| true)) };
    let depth = under.depths[(pixel[1] * small.full[0] + pixel[0]) as usize];
    let away = |x: u32, y: u32| apart(under.small_depths[at(x, y)], depth, alike);
    for n in [6, 4] {
        let range = 3 - n / 2..3 + n / 2;
        if range.clone().all(|y| range.clone().all(|x| away(x, y) == 0.0)) {
            return summed(blobs, &of_order(n, &|_, _| true));
        }
    }
    let mut taps = of_order(2, &|x, y| away(x, y) == 0.0);
    let total: f64 = taps.iter().map(|(_, w)| w).sum();
    if total > 0.0 {
        taps.iter_mut().for_each(|(_, w)| *w /= total);
        return summed(blobs, &taps);
    }
    let mut best = (f64::INFINITY, f64::INFINITY, 0);
    for (x, y) in (0..6).flat_map(|y| (0..6).map(move |x| (x, y))) {
        let far = (f64::from(x) - 2.0 - t[0]).powi(2) + (f64::from(y) - 2.0 - t[1]).powi(2);
        if (away(x, y), far) < (best.0, best.1) {
            best = (away(x, y), far, at(x, y));
        }
    }
    summed(blobs, &[(best.2, 1.0)])
}

fn summed(blobs: &[[f64; 4]], taps: &[(usize, f64)]) -> Summed {
    let (mut sum, mut of_terms) = ([0.0; 4], [0.0; 4]);
    for (i, w) in taps {
        for k in 0..4 {
            sum[k] += w * blobs[*i][k];
            of_terms[k] += (w * blobs[*i][k]).abs();
        }
    }
    (sum, of_terms)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by_hand(
        depths: [f64; 2],
        small_depth: &dyn Fn(u32) -> f64,
        value: &dyn Fn(u32) -> f64,
    ) -> Vec<f64> {
        // Two full pixels; 2 n = 4, o = 1 + 8·2 − 2 − 2 = 13: the pixels lie at 13/4 and 15/4 of 8
        // columns.
        let small = LowResLayout::of([2, 1], 2);
        assert_eq!((small.size, small.offsets()), ([8, 8], [13, 14]));
        let columns = || (0..64).map(|i| i % 8);
        let blobs: Vec<[f64; 4]> = columns().map(|x| [value(x); 4]).collect();
        let small_depths: Vec<f64> = columns().map(small_depth).collect();
        let under =
            OpaqueLayer { picture: &[[0.0; 4]; 2], depths: &depths, small_depths: &small_depths };
        render(&small, &blobs, Some(&under)).iter().map(|(v, _)| v[0]).collect()
    }

    #[test]
    fn weights_are_the_textbooks() {
        assert_eq!(lagrange(4, 0.5), [-1.0, 9.0, 9.0, -1.0].map(|w| w / 16.0));
        let six = [3.0, -25.0, 150.0, 150.0, -25.0, 3.0].map(|w| w / 256.0);
        assert!(lagrange(6, 0.5).iter().zip(six).all(|(a, b)| (a - b).abs() < 1e-15));
        assert_eq!(lagrange(2, 0.25), [0.75, 0.25]);
        assert_eq!(lagrange(6, 0.0), [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn polynomials_of_degree_five_are_met() {
        let f =
            |x: f64| 0.5 + 0.1 * (x - 3.5) - 0.02 * (x - 3.5).powi(3) + 0.003 * (x - 3.5).powi(5);
        let got = by_hand([0.5; 2], &|_| 0.5, &|x| f(f64::from(x)));
        assert!((got[0] - f(3.25)).abs() < 1e-14 && (got[1] - f(3.75)).abs() < 1e-14, "{got:?}");
    }

    #[test]
    fn edges_of_depth_part_what_is_interpolated() {
        // Columns 0 to 3 have near/z = 0.5, the others 0.2, and so do the pixels: each gets its own
        // side's value.
        let step = |low: f64, high: f64| move |x: u32| if x < 4 { low } else { high };
        let got = by_hand([0.5, 0.2], &step(0.5, 0.2), &step(0.9, 0.1));
        assert!((got[0] - 0.9).abs() < 1e-15 && (got[1] - 0.1).abs() < 1e-15, "{got:?}");
        // At 13/4 = 3 + 1/4 the edge is between 6 and 7: cubic through columns 2 to 5, (x − 2)/10.
        let far = |x: u32| if x < 6 { 0.5 } else { 0.1 };
        let got = by_hand([0.5, 0.5], &far, &|x| 0.1 * f64::from(x));
        assert!((got[0] - 0.325).abs() < 1e-15 && (got[1] - 0.375).abs() < 1e-15, "{got:?}");
        // Neither 3 nor 4 is alike: the nearest that are, column 2 of the first pixel and column 5
        // of the second.
        let gap = |x: u32| if x == 3 || x == 4 { 0.9 } else { 0.3 };
        let got = by_hand([0.3, 0.3], &gap, &|x| 0.1 * f64::from(x));
        assert!((got[0] - 0.2).abs() < 1e-15 && (got[1] - 0.5).abs() < 1e-15, "{got:?}");
        // No tap is alike: the nearest in depth counts.
        let got = by_hand([0.25, 0.6], &gap, &|x| 0.1 * f64::from(x));
        assert!((got[0] - 0.2).abs() < 1e-15 && (got[1] - 0.4).abs() < 1e-15, "{got:?}");
    }
}
