//! The BRDF basis (model.md §6) against its definition, closed forms, and the table that the page
//! prints.

use nimbus::model::basis::{Basis, MAX_BASES, N_NODES, Sampling, evaluate, node, node_t};
use nimbus::model::material::Brdf;

/// ∫ f g 4 cos γ sin γ dγ = ∫ 16 t³ (1 − t⁴) f g dt by plain trapezoids, independent of the
/// module's quadrature.
fn product(f: &[f64], g: &[f64]) -> f64 {
    (0..N_NODES).map(|i| term(f, g, i)).sum()
}

/// 0 at either end.
fn term(f: &[f64], g: &[f64], i: usize) -> f64 {
    let t = node_t(i);
    16.0 * t.powi(3) * (1.0 - t.powi(4)) * f[i] * g[i] / (N_NODES - 1) as f64
}

/// Greatest distance of [`product`] from Gregory's rule: weights 299/240, 211/240 and 739/720
/// instead of 1 at the nodes next to the ends, and the roundings of 1025 terms.
fn rules_differ(f: &[f64], g: &[f64]) -> f64 {
    let ends = [(1, 0.25), (2, 0.13), (3, 0.03)]
        .map(|(k, d)| d * (term(f, g, k).abs() + term(f, g, N_NODES - 1 - k).abs()));
    ends.iter().sum::<f64>() + N_NODES as f64 * f64::EPSILON
}

/// Range of n_s, N_b, greatest relative error with C's sampling and with the default, as printed in
/// model.md §6.
const PRINTED: [([f64; 2], u32, f64, f64); 5] = [
    ([1.0, 64.0], 8, 6.1e-3, 2.6e-3),
    ([1.0, 256.0], 8, 5.0e-2, 1.2e-2),
    ([1.0, 256.0], 12, 1.5e-2, 4.2e-4),
    ([1.0, 1024.0], 12, 1.2e-1, 2.0e-3),
    ([1.0, 10000.0], 16, 4.8e-1, 1.2e-3),
];

#[test]
fn the_table_of_the_page_comes_out() {
    for (range, n_bases, uniform, log) in PRINTED {
        for (sampling, printed) in [(Sampling::Uniform, uniform), (Sampling::Log, log)] {
            let basis = Basis::new(range, n_bases, sampling);
            let found = basis.worst().1;
            assert_eq!(
                format!("{found:.1e}"),
                format!("{printed:.1e}"),
                "{range:?}, {n_bases}, {sampling:?}: {found}"
            );
            // A basis counted differently would have another error: the diffuse basis counts.
            let more = Basis::new(range, n_bases + 1, sampling).worst().1;
            assert_ne!(format!("{more:.1e}"), format!("{printed:.1e}"));
        }
    }
}

#[test]
fn nodes_and_interpolation_at_worked_points() {
    assert_eq!((node(0), node(512), node(N_NODES - 1)), (0.0, 1.0 / 16.0, 1.0));
    let squares: Vec<f64> = (0..N_NODES).map(|i| (i * i) as f64).collect();
    for (i, square) in squares.iter().enumerate() {
        // ∜ of t⁴ is within 2⁻⁵² of t: 1025 · 2 · 1024 · 2⁻⁵² of the squares near the greatest.
        assert!((evaluate(&squares, node(i)) - square).abs() < 1e-9);
    }
    // Half way between nodes 2 and 3 in t, not in w: (4 + 9)/2.
    assert!((evaluate(&squares, (2.5f64 / 1024.0).powi(4)) - 6.5).abs() < 1e-9);
    assert_eq!((evaluate(&squares, -0.5), evaluate(&squares, 1.5)), (0.0, 1024.0 * 1024.0));
    assert!(evaluate(&squares, f64::NAN).is_nan());
}

/// Greatest |d²/dt²| of (1 − t⁴)^{n_s} over [0, 1]. It is 12 and 32 at t = 1 for n_s = 1 and 2, and
/// was found on 4·10⁵ points for the others. In the limit it is 3.8343 √n_s, of exp(−n_s t⁴).
const CURVATURE: [(f64, f64); 6] =
    [(1.0, 12.0), (2.0, 32.0), (8.0, 13.56), (100.0, 38.97), (1e4, 383.5), (1e6, 3834.4)];

#[test]
fn interpolation_keeps_its_bound() {
    for (ns, curvature) in CURVATURE {
        let table: Vec<f64> = (0..N_NODES).map(|i| Brdf::lobe(ns, node(i))).collect();
        let peak = Brdf::lobe(ns, 0.0);
        let at = |k: u32| (f64::from(k) / (8.0 * 1024.0)).powi(4);
        let wrong = |k: u32| (evaluate(&table, at(k)) - Brdf::lobe(ns, at(k))).abs() / peak;
        let greatest = (0..=8 * 1024).map(wrong).fold(0.0, f64::max);
        // h²/8 of the curvature, reached in the middle of a cell, which the eighths contain.
        let bound = curvature / (8.0 * 1024.0 * 1024.0);
        assert!(
            greatest <= bound * 1.001 && greatest > 0.95 * bound,
            "n_s = {ns}: {greatest}, bound {bound}"
        );
    }
}

/// Ranges and counts at and beyond the limits of a scene.
fn all_kinds() -> Vec<Basis> {
    let ranges = [
        [1.0, 256.0],
        [0.0, 1.0],
        [0.0, 1e6],
        [1.0, 1e6],
        [0.5, 0.6],
        [100.0, 101.0],
        [7.0, 7.0],
        [0.0, 0.0],
    ];
    let kinds = ranges.iter().flat_map(|r| [Sampling::Log, Sampling::Uniform].map(|s| (*r, s)));
    kinds.flat_map(|(r, s)| [1, 2, 8, MAX_BASES].map(|n| Basis::new(r, n, s))).collect()
}

#[test]
fn vectors_are_orthonormal_and_their_greatest_entry_is_positive() {
    for basis in all_kinds() {
        for (a, v) in basis.vectors().iter().enumerate() {
            assert!(v.len() == N_NODES && v.iter().all(|value| value.is_finite()));
            for (b, u) in basis.vectors()[..=a].iter().enumerate() {
                let expected = if a == b { 1.0 } else { 0.0 };
                let found = product(v, u);
                assert!(
                    (found - expected).abs() < rules_differ(v, u),
                    "{:?}: {a} {b} {found}",
                    basis.exponents()
                );
            }
            let greatest = v.iter().fold(0.0f64, |g, x| g.max(x.abs()));
            assert_eq!(v.iter().find(|x| x.abs() == greatest), Some(&greatest));
        }
    }
}

#[test]
fn the_lobe_of_the_basis_is_the_projection() {
    let basis = Basis::new([1.0, 10000.0], 16, Sampling::Log);
    for ns in [1.0, 30.0, 1e4] {
        let (coefficients, lobe) = (basis.coefficients(ns), basis.lobe(ns));
        assert_eq!((coefficients.len(), lobe.len()), (15, N_NODES));
        let sum =
            |i: usize| coefficients.iter().zip(basis.vectors()).map(|(c, v)| c * v[i]).sum::<f64>();
        let peak = Brdf::lobe(ns, 0.0);
        assert!((0..N_NODES).all(|i| (lobe[i] - sum(i)).abs() < 1e-13 * peak));
        // Pythagoras: ‖lobe‖² = Σ c² + (error ‖lobe‖)², and ‖lobe‖² in closed form.
        let norm = ((ns + 2.0) / std::f64::consts::TAU).powi(2) * 4.0 / (2.0 * ns + 2.0);
        let kept = coefficients.iter().map(|c| c * c).sum::<f64>() / norm;
        let error = basis.error(ns);
        assert!((kept + error * error - 1.0).abs() < 1e-9, "n_s = {ns}: {kept} {error}");
    }
}

#[test]
fn enough_bases_leave_roundings_only_whatever_the_exponent() {
    // The lobes that the basis is made from lie in the span of all singular vectors. Between them
    // the range [0, 1] is so narrow that no lobe is farther from the span than the rank's threshold
    // and roundings.
    let basis = Basis::new([0.0, 1.0], MAX_BASES, Sampling::Log);
    assert!(basis.n_bases() < MAX_BASES && basis.worst().1 < 1e-9, "{}", basis.worst().1);
    for (ns, range) in [(0.0, [0.0, 1e6]), (1.0, [0.0, 1e6]), (1e4, [1.0, 1e6]), (1e6, [1.0, 1e6])]
    {
        let error = Basis::new(range, MAX_BASES, Sampling::Log).error(ns);
        assert!(error < 1e-4, "n_s = {ns} of {range:?}: {error}");
    }
    // The singular values left out give the loss: their squares are the squared errors of the 64
    // unit lobes.
    let basis = Basis::new([1.0, 256.0], 8, Sampling::Log);
    let lost: f64 = basis.singular_values()[7..].iter().map(|s| s * s).sum();
    let of_lobes = |i: u32| basis.error(256f64.powf(f64::from(i) / 63.0)).powi(2);
    let found: f64 = (0..64).map(of_lobes).sum();
    assert!((found / lost - 1.0).abs() < 1e-9, "{found} {lost}");
}

#[test]
fn one_exponent_is_one_lobe() {
    for (ns, sampling) in [
        (0.0, Sampling::Log),
        (20.0, Sampling::Log),
        (20.0, Sampling::Uniform),
        (1e6, Sampling::Log),
    ] {
        let basis = Basis::new([ns, ns], 8, sampling);
        assert_eq!((basis.n_asked(), basis.n_bases(), basis.singular_values().len()), (8, 2, 1));
        assert!(basis.worst().1 < 1e-14, "{}", basis.worst().1);
        assert_eq!(basis.worst().0, ns);
        let (lobe, peak) = (basis.lobe(ns), Brdf::lobe(ns, 0.0));
        assert!((0..N_NODES).all(|i| (lobe[i] - Brdf::lobe(ns, node(i))).abs() < 1e-12 * peak));
    }
}

#[test]
fn without_vectors_no_lobe_is_represented() {
    for n_bases in [0, 1] {
        let basis = Basis::new([1.0, 256.0], n_bases, Sampling::Log);
        assert_eq!(
            (basis.n_bases(), basis.vectors().len(), basis.coefficients(5.0).len()),
            (1, 0, 0)
        );
        assert!(
            basis.lobe(5.0).iter().all(|v| *v == 0.0)
                && basis.error(5.0) == 1.0
                && basis.worst().1 == 1.0
        );
    }
}

#[test]
fn a_narrow_range_keeps_the_vectors_that_differ() {
    for (range, most) in
        [([10.0, 10.001], 6), ([10.0, 10.0 + 2e-15], 3), ([1e6, 1e6 + 1.0], 6), ([10.0, 12.0], 12)]
    {
        for sampling in [Sampling::Log, Sampling::Uniform] {
            let basis = Basis::new(range, MAX_BASES, sampling);
            assert!(
                basis.n_asked() == MAX_BASES && (2..=most).contains(&basis.n_bases()),
                "{range:?} {}",
                basis.n_bases()
            );
            let least = basis.singular_values()[0] * N_NODES as f64 * f64::EPSILON;
            let rank = basis.singular_values().iter().filter(|s| **s > least).count();
            assert_eq!(basis.n_bases() as usize, rank + 1);
            assert!(basis.worst().1 < 1e-11, "{range:?}: {}", basis.worst().1);
        }
    }
}

#[test]
fn the_same_basis_every_time() {
    for sampling in [Sampling::Log, Sampling::Uniform] {
        let make = || Basis::new([1.0, 10000.0], 16, sampling);
        assert_eq!(make(), make());
    }
    // Vectors do not depend on how many are kept.
    let (few, many) =
        (Basis::new([1.0, 64.0], 4, Sampling::Log), Basis::new([1.0, 64.0], 8, Sampling::Log));
    assert_eq!(few.vectors(), &many.vectors()[..3]);
}
