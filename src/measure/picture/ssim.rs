//! Structural similarity of one channel in [0, 1], here the luminance of display values, with the
//! constants of Wang, Bovik, Sheikh and Simoncelli 2004.

/// Standard deviation of the Gaussian window, in pixels.
const SIGMA: f64 = 1.5;
/// Pixels a side of the window, whose weights sum to 1.
pub const WINDOW: usize = 11;
/// C₁ = (K₁ L)², with the range L = 1 of the values.
const C1: f64 = 0.01 * 0.01;
/// C₂ = (K₂ L)².
const C2: f64 = 0.03 * 0.03;

/// Returns the luminance of display values by the weights of Rec. 709.
pub fn luminance(rgb: [f64; 3]) -> f64 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

/// Returns the mean index over every place of the window inside the pictures; none if they are
/// smaller than the window.
///
/// # Panics
/// Panics if a picture has not one number a pixel.
pub fn ssim(width: usize, height: usize, a: &[f64], b: &[f64]) -> Option<f64> {
    assert!(a.len() == width * height && b.len() == a.len(), "a number a pixel");
    if width < WINDOW || height < WINDOW {
        return None;
    }
    let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).collect::<Vec<f64>>();
    let mean = |x: &[f64]| blurred(width, x);
    let (mean_a, mean_b) = (mean(a), mean(b));
    let (aa, bb, ab) = (mean(&product(a, a)), mean(&product(b, b)), mean(&product(a, b)));
    let index = |i: usize| {
        let (m, n) = (mean_a[i], mean_b[i]);
        let (var_a, var_b, covariance) = (aa[i] - m * m, bb[i] - n * n, ab[i] - m * n);
        (2.0 * m * n + C1) * (2.0 * covariance + C2) / ((m * m + n * n + C1) * (var_a + var_b + C2))
    };
    let sum: f64 = (0..mean_a.len()).map(index).sum();
    Some(sum / mean_a.len() as f64)
}

/// Returns the weighted means over every place of the window inside the picture, row by row.
fn blurred(width: usize, x: &[f64]) -> Vec<f64> {
    let weights = weights();
    let n_across = width - WINDOW + 1;
    let row =
        |row: &[f64]| (0..n_across).map(|i| dot(&weights, row[i..].iter())).collect::<Vec<f64>>();
    let across: Vec<f64> = x.chunks(width).flat_map(row).collect();
    let n_down = x.len() / width - WINDOW + 1;
    let at = |k: usize| dot(&weights, across[k..].iter().step_by(n_across));
    (0..n_down * n_across).map(at).collect()
}

fn dot<'a>(weights: &[f64; WINDOW], x: impl Iterator<Item = &'a f64>) -> f64 {
    weights.iter().zip(x).map(|(w, x)| w * x).sum()
}

fn weights() -> [f64; WINDOW] {
    let raw = |i: usize| {
        let x = (i as f64 - (WINDOW / 2) as f64) / SIGMA;
        (-0.5 * x * x).exp()
    };
    let sum: f64 = (0..WINDOW).map(raw).sum();
    std::array::from_fn(|i| raw(i) / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 24 × 17 numbers in [0, 1] without a pattern.
    fn noise() -> Vec<f64> {
        (0..24 * 17).map(|i| (f64::from(i) * 12.9898).sin().abs()).collect()
    }

    fn of(a: &[f64], b: &[f64]) -> f64 {
        ssim(24, 17, a, b).unwrap()
    }

    #[test]
    fn a_picture_is_like_itself() {
        assert!((of(&noise(), &noise()) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn constants_by_the_formula() {
        // No structure: (2·0.25·0.75 + 10⁻⁴)/(0.0625 + 0.5625 + 10⁻⁴) = 0.3751/0.6251.
        let (a, b) = (vec![0.25; 24 * 17], vec![0.75; 24 * 17]);
        assert!((of(&a, &b) - 0.3751 / 0.6251).abs() < 1e-12);
        // Black against white: 10⁻⁴/(1 + 10⁻⁴).
        assert!((of(&[0.0; 24 * 17], &[1.0; 24 * 17]) - 1e-4 / 1.0001).abs() < 1e-12);
    }

    #[test]
    fn one_window_by_the_definition() {
        // 11 × 11: one place, its means by plain sums over all pixels.
        let (a, b): (Vec<f64>, Vec<f64>) =
            noise().chunks(2).take(121).map(|c| (c[0], 0.5 * c[0] + 0.3 * c[1])).unzip();
        let weight = |k: usize| {
            let (x, y) = ((k % 11) as f64 - 5.0, (k / 11) as f64 - 5.0);
            (-(x * x + y * y) / 4.5).exp()
        };
        let total: f64 = (0..121).map(weight).sum();
        let mean =
            |f: &dyn Fn(usize) -> f64| (0..121).map(|k| weight(k) * f(k)).sum::<f64>() / total;
        let (m, n) = (mean(&|k| a[k]), mean(&|k| b[k]));
        let spread = |x: &[f64], y: &[f64], m: f64, n: f64| mean(&|k| (x[k] - m) * (y[k] - n));
        let index = (2.0 * m * n + 1e-4) * (2.0 * spread(&a, &b, m, n) + 9e-4)
            / ((m * m + n * n + 1e-4) * (spread(&a, &a, m, m) + spread(&b, &b, n, n) + 9e-4));
        assert!((ssim(11, 11, &a, &b).unwrap() - index).abs() < 1e-12);
        assert!(index < 0.95, "the case tells something: {index}");
    }

    #[test]
    fn structure_that_is_turned_over_is_unlike() {
        let turned: Vec<f64> = noise().iter().map(|v| 1.0 - v).collect();
        assert!(of(&noise(), &turned) < -0.5);
        assert_eq!(ssim(10, 40, &[0.0; 400], &[0.0; 400]), None);
    }
}
