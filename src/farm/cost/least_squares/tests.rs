use super::*;
use crate::measure::random::{SplitMix64, normal};

/// The columns of the widest problem.
const N_COLUMNS: usize = 8;

fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length(values: &[f64]) -> f64 {
    inner(values, values).sqrt()
}

fn residual(columns: &[Vec<f64>], b: &[f64], x: &[f64]) -> Vec<f64> {
    (0..b.len())
        .map(|i| b[i] - columns.iter().zip(x).map(|(column, x)| column[i] * x).sum::<f64>())
        .collect()
}

/// Checks the conditions of Karush, Kuhn and Tucker: the gradient is 0 where x > 0, and not
/// positive where x = 0. Both hold at the least distance over x ≥ 0 alone.
///
/// Two sets of columns whose distances round to the same are not told apart. A unit column with the
/// gradient g shortens a distance d by g²/2d at least. Distances are off by 2 c m k ε of the sizes
/// involved, so that gradients up to √(4 c m k ε) of those may be left over.
fn assert_least(columns: &[Vec<f64>], b: &[f64], x: &[f64]) {
    let left = residual(columns, b, x);
    let lengths: Vec<f64> = columns.iter().map(|column| length(column)).collect();
    let size = length(b) + x.iter().zip(&lengths).map(|(x, length)| x * length).sum::<f64>();
    let rounding = HOUSEHOLDER_CONSTANT * (b.len() * columns.len()) as f64 * f64::EPSILON;
    for (j, column) in columns.iter().enumerate() {
        let gradient = inner(column, &left);
        let scale = size * lengths[j];
        assert!(x[j] >= 0.0 && x[j].is_finite(), "x[{j}] = {}", x[j]);
        assert!(gradient <= (4.0 * rounding).sqrt() * scale, "{j}: {gradient:e} of {scale:e}");
        assert!(x[j] == 0.0 || gradient.abs() <= 4.0 * rounding * scale, "{j}: {gradient:e}");
    }
}

/// Problems of k columns of m normal values and b, in the shapes from 1 × 1 to 12 × 8 in turn.
fn problems(seed: u64, n: usize) -> impl Iterator<Item = (Vec<Vec<f64>>, Vec<f64>)> {
    let mut random = SplitMix64(seed);
    (0..n).map(move |i| {
        let (k, m) = (1 + i % N_COLUMNS, 1 + i / N_COLUMNS % 12);
        let columns = (0..k).map(|_| normal(&mut random, m)).collect();
        (columns, normal(&mut random, m))
    })
}

#[test]
fn a_line_through_three_points() {
    // Heights 1, 3, 4 over 0, 1, 2: slope 3/2, height 8/3 − 3/2 = 7/6, both above 0.
    let x = solve(&[vec![1.0; 3], vec![0.0, 1.0, 2.0]], &[1.0, 3.0, 4.0]).unwrap();
    assert!((x[0] - 7.0 / 6.0).abs() < 1e-14 && (x[1] - 1.5).abs() < 1e-14, "{x:?}");
}

#[test]
fn a_line_that_would_begin_below_zero_begins_at_zero() {
    // Heights 0, 1, 3 over 0, 1, 2: slope 3/2 and height 4/3 − 3/2 = −1/6. Without a height the
    // slope is (0·0 + 1·1 + 2·3)/(0 + 1 + 4) = 7/5, and the height's gradient 4 − 3 · 7/5 < 0.
    let x = solve(&[vec![1.0; 3], vec![0.0, 1.0, 2.0]], &[0.0, 1.0, 3.0]).unwrap();
    assert!(x[0] == 0.0 && (x[1] - 1.4).abs() < 1e-14, "{x:?}");
}

#[test]
fn the_column_nearest_by_angle_may_be_left_out() {
    // b = (1, 1, −1/10) is nearest by angle to the first column. All three together give b with −1,
    // 11/10 and 11/10. Without the first x is (0, 1, 1), whose residual (0, 0, −1/10) has the
    // gradient −1/100 along the first.
    let columns = [vec![1.0, 1.0, 0.1], vec![1.0, 0.0, 0.0], vec![0.0, 1.0, 0.0]];
    let x = solve(&columns, &[1.0, 1.0, -0.1]).unwrap();
    assert!(x[0] == 0.0 && (x[1] - 1.0).abs() < 1e-14 && (x[2] - 1.0).abs() < 1e-14, "{x:?}");
}

#[test]
fn a_target_on_the_other_side_gives_zeros() {
    assert_eq!(solve(&[vec![1.0, 0.0], vec![1.0, 1.0]], &[-1.0, 0.0]), Ok(vec![0.0, 0.0]));
    assert_eq!(solve(&[vec![1.0, 2.0]], &[0.0, 0.0]), Ok(vec![0.0]));
    assert_eq!(solve(&[], &[1.0]), Ok(vec![]));
    assert_eq!(solve(&[vec![], vec![]], &[]), Ok(vec![0.0, 0.0]));
}

#[test]
fn random_problems_meet_the_conditions_of_the_least_distance() {
    for (columns, b) in problems(1, 1000) {
        assert_least(&columns, &b, &solve(&columns, &b).unwrap());
    }
}

#[test]
fn units_do_not_matter() {
    for (i, (columns, b)) in problems(3, 400).enumerate() {
        // Powers of two from 1 to about 1e12, by which only the lengths round.
        let scale = |j: usize| 2f64.powi((7 * (i + j) % 41) as i32);
        let other = |j: usize, column: &Vec<f64>| column.iter().map(|a| a * scale(j)).collect();
        let scaled: Vec<Vec<f64>> =
            columns.iter().enumerate().map(|(j, column)| other(j, column)).collect();
        let (x, y) = (solve(&columns, &b).unwrap(), solve(&scaled, &b).unwrap());
        assert_least(&scaled, &b, &y);
        if columns.len() <= b.len() {
            let mut pairs = x.iter().zip(&y).enumerate();
            // Conditions of random columns are below 1e4, beside 4 · 12 · 8 ε = 9e-14.
            let agree = pairs.all(|(j, (x, y))| (x - y * scale(j)).abs() <= 1e-9 * (1.0 + x));
            assert!(agree, "{x:?} and {y:?}");
        }
    }
}

#[test]
fn coefficients_of_seconds_and_of_pixels_are_found_again() {
    // Set-ups, and counts around 1e6, 1e9 and 1e12, with the coefficients of a device.
    let mut random = SplitMix64(4);
    let sizes = [1.0, 1e6, 1e9, 1e12];
    let columns: Vec<Vec<f64>> = sizes
        .iter()
        .map(|size| normal(&mut random, 12).iter().map(|z| size * z.exp()).collect())
        .collect();
    let truth = [3.0, 2e-7, 4e-9, 1e-12];
    let b: Vec<f64> =
        (0..12).map(|i| columns.iter().zip(truth).map(|(column, x)| column[i] * x).sum()).collect();
    let x = solve(&columns, &b).unwrap();
    for (x, truth) in x.iter().zip(truth) {
        // A condition of about ten, beside 4 · 12 · 4 ε = 4e-14.
        assert!((x / truth - 1.0).abs() < 1e-12, "{x:e} for {truth:e}");
    }
}

#[test]
fn dependent_columns_are_found() {
    let mut random = SplitMix64(5);
    let (a, c, b) = (normal(&mut random, 6), normal(&mut random, 6), normal(&mut random, 6));
    let sum: Vec<f64> = a.iter().zip(&c).map(|(a, c)| a + 3.0 * c).collect();
    let zeros = vec![0.0; 6];
    for b in [b, a.clone(), sum.clone(), zeros.clone()] {
        let columns = [a.clone(), zeros.clone(), a.clone(), c.clone(), sum.clone(), zeros.clone()];
        let x = solve(&columns, &b).unwrap();
        assert_least(&columns, &b, &x);
        assert!(x[1] == 0.0 && x[5] == 0.0 && (x[0] == 0.0 || x[2] == 0.0), "{x:?}");
    }
    let found = independent(&[a.clone(), zeros, a.clone(), c.clone()]).unwrap();
    assert_eq!(found, [false, false, false, true]);
    assert_eq!(independent(&[a.clone(), c.clone(), sum]), Ok(vec![false; 3]));
    assert_eq!(independent(&[a, c]), Ok(vec![true; 2]));
    assert_eq!(independent(&[vec![1.0]]), Ok(vec![true]));
    assert_eq!(independent(&[]), Ok(vec![]));
}

#[test]
fn more_columns_than_rows_fit_exactly() {
    let x = solve(&[vec![1.0], vec![2.0], vec![4.0]], &[8.0]).unwrap();
    assert!((x[0] + 2.0 * x[1] + 4.0 * x[2] - 8.0).abs() < 1e-14, "{x:?}");
}

#[test]
fn impossible_input_is_refused() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        assert!(solve(&[vec![1.0, bad]], &[1.0, 1.0]).unwrap_err().contains("expected finite"));
    }
    assert!(solve(&[vec![1.0]], &[f64::NAN]).unwrap_err().contains("expected finite"));
}
