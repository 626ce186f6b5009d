//! The distribution of the positions, by the χ² test.

use super::*;

/// Two-sample χ² of equally large samples over the bins that either meets, and its bins less one.
fn chi_squared(a: &[u32], b: &[u32]) -> (f64, usize) {
    let (a_total, b_total) = (a.iter().sum::<u32>(), b.iter().sum::<u32>());
    assert_eq!(a_total, b_total);
    let met = || a.iter().zip(b).filter(|(a, b)| **a + **b > 0);
    let term = |(a, b): (&u32, &u32)| (f64::from(*a) - f64::from(*b)).powi(2) / f64::from(a + b);
    (met().map(term).sum(), met().count() - 1)
}

/// The value that χ² of `n` degrees of freedom exceeds with a chance of 1e-6 (z = 4.753): Wilson
/// and Hilferty, whose error at n ≥ 30 is far below the distance between 1e-6 and any p that a
/// wrong law would give.
fn critical(n: usize) -> f64 {
    let v = 2.0 / (9.0 * n as f64);
    n as f64 * (1.0 - v + 4.753 * v.sqrt()).powi(3)
}

/// Bins of equal width of the three axes alone (50 each), and of the box in 10³ cells.
fn histograms(positions: impl Iterator<Item = DVec3>, extent: DVec3) -> Vec<Vec<u32>> {
    let mut bins = vec![vec![0; 50], vec![0; 50], vec![0; 50], vec![0; 1000]];
    for p in positions {
        let share = p / extent + 0.5;
        let bin = |axis: usize, n: usize| ((share[axis] * n as f64) as usize).min(n - 1);
        for (axis, bins) in bins[..3].iter_mut().enumerate() {
            bins[bin(axis, 50)] += 1;
        }
        bins[3][bin(0, 10) + 10 * (bin(1, 10) + 10 * bin(2, 10))] += 1;
    }
    bins
}

#[test]
fn positions_are_distributed_as_the_references() {
    let mut gpu = Gpu::new();
    for form in FORMS {
        let boxes = [one_box(200_000, [7.4, 4.0, 6.0], 2.1)];
        let other_seed = SeededLaw { seed: 99, ..law(form) };
        let truth = reference(&boxes, &law(form));
        let expected = histograms(truth.iter().map(|(g, _)| g.position), boxes[0].extent);
        let of_gpu = |made: Made| {
            let positions =
                made.0.into_iter().map(|p| glam::Vec3::from_array(p.position).as_dvec3());
            histograms(positions, boxes[0].extent)
        };
        let found = of_gpu(generate(&mut gpu, &boxes, &other_seed));
        let wrong = Gpu::wrong_compiler(
            "generate.comp",
            "0.5 * PI * sine(0.5 * x.z)",
            "0.3 * PI * sine(0.5 * x.z)",
        );
        let wrong = of_gpu(generate_with(&mut gpu, &wrong, &boxes, &other_seed));
        for (axis, name) in ["x", "y", "z", "all"].into_iter().enumerate() {
            let (value, n) = chi_squared(&found[axis], &expected[axis]);
            println!(
                "{form:?} {name}: χ² {value:.1} of {n} degrees of freedom, p > 1e-6 below {:.1}",
                critical(n)
            );
            assert!(value < critical(n));
        }
        let (value, n) = chi_squared(&wrong[3], &expected[3]);
        assert!(value > critical(n), "a wrong phase passes: {value} of {n}");
    }
    // By hand: (30 − 10)²/40 + (10 − 30)²/40 = 20; the tables give 112.3 at n = 50 and p = 1e-6
    // within half a percent.
    assert_eq!(chi_squared(&[30, 10, 0], &[10, 30, 0]), (20.0, 1));
}
