use super::*;
use crate::measure::random::{SplitMix64, normal};

/// Twice what the solver allows itself: the test's own gradient rounds as well.
fn tolerance(n_rows: usize, n_columns: usize) -> f64 {
    2.0 * HOUSEHOLDER_CONSTANT * (n_rows * n_columns) as f64 * f64::EPSILON
}

fn residual(columns: &[Vec<f64>], b: &[f64], x: &[f64]) -> Vec<f64> {
    (0..b.len())
        .map(|i| b[i] - columns.iter().zip(x).map(|(column, x)| column[i] * x).sum::<f64>())
        .collect()
}

/// The conditions of Karush, Kuhn and Tucker, which a least distance over x ≥ 0 has and nothing
/// else: the gradient is 0 where x > 0, and leads outward where x = 0.
fn assert_least(columns: &[Vec<f64>], b: &[f64], x: &[f64]) {
    let left = residual(columns, b, x);
    let lengths: Vec<f64> = columns.iter().map(|column| length(column)).collect();
    let size = length(b) + x.iter().zip(&lengths).map(|(x, length)| x * length).sum::<f64>();
    let tolerance = tolerance(b.len(), columns.len());
    for (j, column) in columns.iter().enumerate() {
        let gradient = inner(column, &left);
        let allowed = tolerance * size * lengths[j];
        assert!(x[j] >= 0.0 && x[j].is_finite(), "x[{j}] = {}", x[j]);
        assert!(
            gradient <= allowed,
            "column {j}: {gradient:e} of {allowed:e} allowed, x = {:?}",
            x
        );
        assert!(
            x[j] == 0.0 || gradient >= -allowed,
            "column {j}: {gradient:e} of {allowed:e} allowed, x = {:?}",
            x
        );
    }
}

/// k columns of m normal values and b, the shapes from 1 × 1 to 12 × 8 in turn.
fn problems(seed: u64, n: usize) -> impl Iterator<Item = (Vec<Vec<f64>>, Vec<f64>)> {
    let mut random = SplitMix64(seed);
    (0..n).map(move |i| {
        let (k, m) = (1 + i % MAX_COLUMNS, 1 + i / MAX_COLUMNS % 12);
        let columns = (0..k).map(|_| normal(&mut random, m)).collect();
        (columns, normal(&mut random, m))
    })
}

/// Columns `set` of the normal equations by elimination with pivots, or None where they depend on
/// one another.
fn by_normal_equations(columns: &[Vec<f64>], b: &[f64], set: usize) -> Option<Vec<f64>> {
    let set: Vec<usize> = (0..columns.len()).filter(|j| set >> j & 1 == 1).collect();
    let n = set.len();
    let row = |i: &usize| {
        let products = set.iter().map(|j| inner(&columns[*i], &columns[*j]));
        products.chain([inner(&columns[*i], b)]).collect()
    };
    let mut rows: Vec<Vec<f64>> = set.iter().map(row).collect();
    for p in 0..n {
        let pivot = (p..n).max_by(|i, j| rows[*i][p].abs().total_cmp(&rows[*j][p].abs()))?;
        rows.swap(p, pivot);
        // Below this the squared condition leaves less than four digits.
        if rows[p][p].abs() < 1e-6 {
            return None;
        }
        for i in (0..n).filter(|i| *i != p) {
            let factor = rows[i][p] / rows[p][p];
            let pivot_row = rows[p].clone();
            rows[i].iter_mut().zip(&pivot_row).for_each(|(value, pivot)| *value -= factor * pivot);
        }
    }
    let mut x = vec![0.0; columns.len()];
    set.iter().enumerate().for_each(|(p, j)| x[*j] = rows[p][n] / rows[p][p]);
    Some(x)
}

#[test]
fn a_line_through_three_points_by_hand() {
    // Heights 1, 3, 4 over 0, 1, 2: slope 3/2, height 8/3 − 3/2 = 7/6, both above 0.
    let x = solve(&[vec![1.0; 3], vec![0.0, 1.0, 2.0]], &[1.0, 3.0, 4.0]).unwrap();
    assert!((x[0] - 7.0 / 6.0).abs() < 1e-14 && (x[1] - 1.5).abs() < 1e-14, "{x:?}");
}

#[test]
fn a_line_that_would_begin_below_zero_begins_at_it() {
    // Heights 0, 1, 3 over 0, 1, 2: slope 3/2 and height 4/3 − 3/2 = −1/6. Without a height the
    // slope is (0·0 + 1·1 + 2·3)/(0 + 1 + 4) = 7/5, and the height's gradient 4 − 3 · 7/5 < 0.
    let x = solve(&[vec![1.0; 3], vec![0.0, 1.0, 2.0]], &[0.0, 1.0, 3.0]).unwrap();
    assert!(x[0] == 0.0 && (x[1] - 1.4).abs() < 1e-14, "{x:?}");
}

#[test]
fn a_column_goes_out_again_by_hand() {
    // b = (1, 1, −1/10) is nearest by angle to (1, 1, 1/10), which enters first; what is left then
    // points along (1, 0, 0), after that along (0, 1, 0). The three together are b with −1, 11/10
    // and 11/10, so the first goes out: (0, 1, 1), and what is left, (0, 0, −1/10), has the
    // gradient −1/100 along it.
    let columns = [vec![1.0, 1.0, 0.1], vec![1.0, 0.0, 0.0], vec![0.0, 1.0, 0.0]];
    let b = [1.0, 1.0, -0.1];
    let x = solve(&columns, &b).unwrap();
    assert!(x[0] == 0.0 && (x[1] - 1.0).abs() < 1e-14 && (x[2] - 1.0).abs() < 1e-14, "{x:?}");
    // Three enter, and a fourth turn finds nothing to do.
    let scaled: Vec<Scaled> = columns.iter().map(|column| Scaled::of(column)).collect();
    assert_eq!(Problem::new(&scaled, Scaled::of(&b).unit).solve().1, 4);
}

#[test]
fn what_a_column_adds_is_seen_down_to_rounding() {
    // The second column's gradient is 1e-10 of b's length; rounding makes 1e-14 at most.
    let x = solve(&[vec![1.0, 0.0], vec![0.0, 1.0]], &[1.0, 1e-10]).unwrap();
    assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] / 1e-10 - 1.0).abs() < 1e-9, "{x:?}");
}

#[test]
fn the_distance_falls_with_every_column_that_enters() {
    for (columns, b) in problems(6, 2000) {
        let scaled: Vec<Scaled> = columns.iter().map(|column| Scaled::of(column)).collect();
        let problem = Problem::new(&scaled, Scaled::of(&b).unit);
        let unit: Vec<Vec<f64>> = scaled.iter().map(|column| column.unit.clone()).collect();
        let distance = |x: &[f64]| length(&residual(&unit, &problem.b, x));
        let (mut x, mut set) = (vec![0.0; columns.len()], 0);
        // Far more than rounding, so that the fall is, too.
        let enters = |x: &[f64], set: usize| {
            let gradient = problem.gradient(x);
            (0..columns.len()).find(|j| set >> j & 1 == 0 && gradient[*j] > 1e-4)
        };
        while let Some((next, next_set)) = enters(&x, set).and_then(|j| problem.enter(&x, set, j)) {
            assert!(distance(&next) < distance(&x), "{} after {}", distance(&next), distance(&x));
            (x, set) = (next, next_set);
        }
    }
}

#[test]
fn everything_that_points_away_is_zero() {
    assert_eq!(solve(&[vec![1.0, 0.0], vec![1.0, 1.0]], &[-1.0, 0.0]), Ok(vec![0.0, 0.0]));
    assert_eq!(solve(&[vec![1.0, 2.0]], &[0.0, 0.0]), Ok(vec![0.0]));
    assert_eq!(solve(&[], &[1.0]), Ok(vec![]));
    assert_eq!(solve(&[vec![], vec![]], &[]), Ok(vec![0.0, 0.0]));
}

#[test]
fn conditions_hold_and_turns_are_bounded_over_random_problems() {
    for (columns, b) in problems(1, 4000) {
        let x = solve(&columns, &b).unwrap();
        assert_least(&columns, &b, &x);
        let scaled: Vec<Scaled> = columns.iter().map(|column| Scaled::of(column)).collect();
        let (_, n_turns) = Problem::new(&scaled, Scaled::of(&b).unit).solve();
        assert!(n_turns < most_turns(columns.len()), "{n_turns} turns");
    }
}

#[test]
fn it_is_the_least_of_all_sets_of_columns() {
    let mut n_compared = 0;
    for (columns, b) in problems(2, 1500) {
        let x = solve(&columns, &b).unwrap();
        let sets = (0..1 << columns.len()).filter_map(|set| by_normal_equations(&columns, &b, set));
        let allowed = sets.filter(|x| x.iter().all(|x| *x >= 0.0));
        let distance = |x: &Vec<f64>| length(&residual(&columns, &b, x));
        let best = allowed.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
        // Pivots of 1e-6 leave 1e-10 of a coefficient, and coefficients of a thousand at most.
        assert!(distance(&x) < distance(&best) + 1e-7 * length(&b), "{x:?} for {best:?}");
        // No set was left out where all columns are well apart, and then the nearest point is one
        // alone.
        if by_normal_equations(&columns, &b, (1 << columns.len()) - 1).is_some() {
            n_compared += 1;
            let to_best: Vec<f64> = best.iter().zip(&x).map(|(best, x)| best - x).collect();
            let apart = residual(&columns, &vec![0.0; b.len()], &to_best);
            assert!(length(&apart) < 1e-6 * length(&b), "{x:?} for {best:?}");
        }
    }
    assert!(n_compared > 700, "{n_compared}");
}

#[test]
fn units_do_not_matter() {
    for (i, (columns, b)) in problems(3, 800).enumerate() {
        // Powers of two of 1 to about 1e12, by which nothing rounds but the lengths.
        let scale = |j: usize| 2f64.powi((7 * (i + j) % 41) as i32);
        let other = |j: usize, column: &Vec<f64>| column.iter().map(|a| a * scale(j)).collect();
        let scaled: Vec<Vec<f64>> =
            columns.iter().enumerate().map(|(j, column)| other(j, column)).collect();
        let (x, y) = (solve(&columns, &b).unwrap(), solve(&scaled, &b).unwrap());
        assert_least(&scaled, &b, &y);
        if columns.len() <= b.len() {
            let agree = x
                .iter()
                .zip(&y)
                .enumerate()
                .all(|(j, (x, y))| (x - y * scale(j)).abs() <= 1e-9 * (1.0 + x));
            assert!(agree, "{x:?} and {y:?}");
        }
    }
}

#[test]
fn columns_of_seconds_and_of_pixels_give_their_coefficients_back() {
    // Set-ups, and counts around 1e6, 1e9 and 1e12; coefficients as of a device.
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
fn columns_that_add_nothing_are_zero() {
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
    let apart = told_apart(&[a.clone(), zeros, a.clone(), c.clone()]).unwrap();
    assert_eq!(apart, [false, false, false, true]);
    assert_eq!(told_apart(&[a.clone(), c.clone(), sum]), Ok(vec![false; 3]));
    assert_eq!(told_apart(&[a, c]), Ok(vec![true; 2]));
}

#[test]
fn more_columns_than_rows_fit_exactly_or_end() {
    let x = solve(&[vec![1.0], vec![2.0], vec![4.0]], &[8.0]).unwrap();
    assert!((x[0] + 2.0 * x[1] + 4.0 * x[2] - 8.0).abs() < 1e-14, "{x:?}");
}

#[test]
fn lengths_beyond_squares_of_f64_are_solved() {
    for size in [1e-300, 1e-160, 1e160, 1e300] {
        let x = solve(&[vec![size, 0.0], vec![size, size]], &[3.0 * size, size]).unwrap();
        assert!((x[0] - 2.0).abs() < 1e-14 && (x[1] - 1.0).abs() < 1e-14, "{x:?}");
    }
    assert!(solve(&[vec![1e-300]], &[1e300]).unwrap_err().contains("beyond f64"));
}

#[test]
fn what_is_no_number_is_refused() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(solve(&[vec![1.0, bad]], &[1.0, 1.0]).unwrap_err().contains("expected finite"));
        assert!(solve(&[vec![1.0, 1.0]], &[bad, 1.0]).unwrap_err().contains("expected finite"));
    }
    assert!(
        solve(&[vec![1.0]], &[1.0, 1.0]).unwrap_err().contains("a column of 1 rows, expected 2")
    );
    assert!(solve(&vec![vec![1.0]; 9], &[1.0]).unwrap_err().contains("expected at most 8"));
}
