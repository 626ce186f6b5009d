//! The BRDF basis, C (12): the diffuse lobe and the principal components of Blinn–Phong lobes
//! (model.md §6).
//!
//! f = K_d·(1/π) + K_s Σ_b c_b(n_s) v_b(γ). Basis 0 is 1/π with coefficient K_d; the lobes use the
//! other vectors only.

use nalgebra::{DMatrix, SVD};

use super::material::Brdf;
use super::named::named;

named! {
    /// Spacing of the lobes that the basis is made from over the range of exponents.
    pub enum Sampling {
        /// Even spacing in ln n_s, each lobe of unit norm. If the range begins below 1, even in
        /// ln(1 + n_s).
        Log = "log",
        /// Even spacing in n_s, each lobe unscaled, as C has it.
        Uniform = "uniform",
    }
}

/// Greatest number of bases: the diffuse one and 31 of lobes.
pub const MAX_BASES: u32 = 32;

/// Number of nodes of a tabulated lobe, even in t = (1 − cos γ)^¼. A lobe is nearly exp(−n_s t⁴),
/// whose second derivative by t is at most 3.83 √n_s of its peak. Linear interpolation therefore
/// errs by at most 3.83 √n_s/(8·1024²): 4.6·10⁻⁵ at n_s = 10⁴, 4.6·10⁻⁴ at 10⁶. With 1025 nodes the
/// spacing is 2⁻¹⁰, so nodes are exact in f32.
pub const N_NODES: usize = 1025;

/// N_s of model.md §6: number of lobes that the basis is made from.
const N_SAMPLES: usize = 64;

/// Number of exponents that [`Basis::worst`] tries. The error rises and falls about once a vector,
/// at most 31 times. With 33 points a swing its maximum is found to (π/66)²/2 = 0.1 %.
const N_PROBES: usize = 1024;

/// Weights of the outermost nodes in Gregory's rule with three differences; all others are 1. Plain
/// trapezoids would err by 6·10⁻⁸ in the norm of n_s = 10⁶ and by 3·10⁻⁶ in that of n_s = 0.
const GREGORY: [f64; 4] = [251.0 / 720.0, 299.0 / 240.0, 211.0 / 240.0, 739.0 / 720.0];

/// Returns t at node `i`, from 0 (γ = 0) to 1 (γ = π/2).
pub fn node_t(i: usize) -> f64 {
    i as f64 / (N_NODES - 1) as f64
}

/// Returns 1 − cos γ at node `i`.
pub fn node(i: usize) -> f64 {
    node_t(i).powi(4)
}

/// Interpolates a table linearly in t at w = 1 − cos γ, clamped to [0, 1]. *Shape*: `table` has
/// [`N_NODES`] values.
pub fn evaluate(table: &[f64], w: f64) -> f64 {
    let x = w.clamp(0.0, 1.0).sqrt().sqrt() * (N_NODES - 1) as f64;
    let i = (x as usize).min(N_NODES - 2);
    let part = x - i as f64;
    table[i] + part * (table[i + 1] - table[i])
}

/// Tabulated basis vectors, with the quadrature that projects lobes onto them.
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    exponents: [f64; 2],
    n_asked: u32,
    /// Quadrature weights of 4 cos γ sin γ dγ at the nodes.
    weights: Vec<f64>,
    vectors: Vec<Vec<f64>>,
    singular_values: Vec<f64>,
}

impl Basis {
    /// Computes the basis for a range of exponents.
    ///
    /// `exponents` are the least and greatest n_s, finite and not negative. `n_bases` is N_b and
    /// counts the diffuse one. *Source*: C (12), model.md §6.
    pub fn new(exponents: [f64; 2], n_bases: u32, sampling: Sampling) -> Basis {
        let weights = quadrature();
        let lobes = samples(exponents, sampling, &weights);
        // Lobes are the columns here, so the right-singular vectors of §6 are the left ones.
        let weighted =
            DMatrix::from_fn(N_NODES, lobes.len(), |i, k| weights[i].sqrt() * lobes[k][i]);
        let svd = SVD::new(weighted, false, true);
        let singular_values: Vec<f64> = svd.singular_values.iter().copied().collect();
        let least = singular_values[0] * N_NODES as f64 * f64::EPSILON;
        let rank = singular_values.iter().filter(|s| **s > least).count();
        let n_vectors = rank.min(n_bases.saturating_sub(1) as usize);
        let Some(shares) = svd.v_t else { unreachable!("the decomposition was asked for them") };
        let mut vectors: Vec<Vec<f64>> = Vec::with_capacity(n_vectors);
        for (b, singular_value) in singular_values.iter().enumerate().take(n_vectors) {
            // A sum of the lobes' own values is smooth, and defined where the weight is 0 (the
            // first and the last node).
            let mut vector = vec![0.0; N_NODES];
            for (share, lobe) in shares.row(b).iter().zip(&lobes) {
                add(&mut vector, share / singular_value, lobe);
            }
            orthonormalise(&mut vector, &vectors, &weights);
            fix_sign(&mut vector);
            vectors.push(vector);
        }
        Basis { exponents, n_asked: n_bases, weights, vectors, singular_values }
    }

    /// Returns the least and greatest n_s that the basis was made for.
    pub fn exponents(&self) -> [f64; 2] {
        self.exponents
    }

    /// Returns N_b as asked for.
    pub fn n_asked(&self) -> u32 {
        self.n_asked
    }

    /// Returns the number of bases kept, the diffuse one included. It is less than asked for if the
    /// lobes have fewer independent components.
    pub fn n_bases(&self) -> u32 {
        self.vectors.len() as u32 + 1
    }

    /// Returns bases 1.. at the nodes, orthonormal under the weight 4 cos γ sin γ dγ.
    pub fn vectors(&self) -> &[Vec<f64>] {
        &self.vectors
    }

    /// Returns the product of two tabulated functions under that weight.
    pub fn product(&self, a: &[f64], b: &[f64]) -> f64 {
        product(a, b, &self.weights)
    }

    /// Returns the singular values of all lobes, in falling order. The first `n_bases` − 1 belong
    /// to the vectors.
    pub fn singular_values(&self) -> &[f64] {
        &self.singular_values
    }

    /// Returns c_b(n_s) of the vectors: the weighted projection of the lobe.
    pub fn coefficients(&self, ns: f64) -> Vec<f64> {
        self.project(&lobe_table(ns))
    }

    /// Returns Σ_b c_b v_b at the nodes: the lobe as the basis represents it.
    pub fn lobe(&self, ns: f64) -> Vec<f64> {
        self.combine(&self.coefficients(ns))
    }

    /// Returns ‖lobe − its projection‖/‖lobe‖; 1 without vectors.
    pub fn error(&self, ns: f64) -> f64 {
        let lobe = lobe_table(ns);
        let mut rest = lobe.clone();
        add(&mut rest, -1.0, &self.combine(&self.project(&lobe)));
        norm(&rest, &self.weights) / norm(&lobe, &self.weights)
    }

    /// Returns the exponent of the range with the greatest [`Basis::error`], and that error.
    pub fn worst(&self) -> (f64, f64) {
        let tried = even(self.exponents, N_PROBES, true).into_iter().map(|ns| (ns, self.error(ns)));
        tried.fold(
            (self.exponents[0], 0.0),
            |worst, next| if next.1 > worst.1 { next } else { worst },
        )
    }

    /// Returns `n` exponents over the range, ends included, even in ln(1 + n_s).
    pub fn spread(&self, n: usize) -> Vec<f64> {
        even(self.exponents, n, true)
    }

    fn project(&self, table: &[f64]) -> Vec<f64> {
        self.vectors.iter().map(|v| product(v, table, &self.weights)).collect()
    }

    fn combine(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; N_NODES];
        for (c, vector) in coefficients.iter().zip(&self.vectors) {
            add(&mut sum, *c, vector);
        }
        sum
    }
}

/// Returns the lobes that the basis is made from: a single one if the range is a point.
fn samples(exponents: [f64; 2], sampling: Sampling, weights: &[f64]) -> Vec<Vec<f64>> {
    let n = if exponents[0] == exponents[1] { 1 } else { N_SAMPLES };
    let sampled = match sampling {
        Sampling::Uniform => even_by(exponents, n, |ns| ns, |x| x),
        Sampling::Log => even(exponents, n, exponents[0] < 1.0),
    };
    let mut lobes: Vec<Vec<f64>> = sampled.into_iter().map(lobe_table).collect();
    if sampling == Sampling::Log {
        lobes.iter_mut().for_each(|lobe| normalise(lobe, weights));
    }
    lobes
}

/// Returns exponents even in ln n_s, or in ln(1 + n_s) if `from_zero`. In the latter the product of
/// two lobes of unit norm, 1/cosh(½ ln((1 + a)/(1 + b))), depends on their distance alone, and n_s
/// = 0 has a finite place.
fn even(exponents: [f64; 2], n: usize, from_zero: bool) -> Vec<f64> {
    if from_zero {
        even_by(exponents, n, f64::ln_1p, f64::exp_m1)
    } else {
        even_by(exponents, n, f64::ln, f64::exp)
    }
}

/// Returns `n` values from `low` to `high`, even under `law`. Both ends are exact.
fn even_by(
    [low, high]: [f64; 2],
    n: usize,
    law: fn(f64) -> f64,
    inverse: fn(f64) -> f64,
) -> Vec<f64> {
    let (a, b) = (law(low), law(high));
    let at = |i: usize| match i {
        0 => low,
        _ if i == n - 1 => high,
        _ => inverse(a + (b - a) * i as f64 / (n - 1) as f64).clamp(low, high),
    };
    (0..n).map(at).collect()
}

fn lobe_table(ns: f64) -> Vec<f64> {
    (0..N_NODES).map(|i| Brdf::lobe(ns, node(i))).collect()
}

/// Quadrature weights of 4 cos γ sin γ dγ = 4 (1 − w) dw = 16 t³ (1 − t⁴) dt.
fn quadrature() -> Vec<f64> {
    let weight = |i: usize| {
        let t = node_t(i);
        let end = i.min(N_NODES - 1 - i);
        GREGORY.get(end).copied().unwrap_or(1.0) * 16.0 * t.powi(3) * (1.0 - t.powi(4))
            / (N_NODES - 1) as f64
    };
    (0..N_NODES).map(weight).collect()
}

fn product(a: &[f64], b: &[f64], weights: &[f64]) -> f64 {
    a.iter().zip(b).zip(weights).map(|((a, b), w)| w * a * b).sum()
}

fn norm(a: &[f64], weights: &[f64]) -> f64 {
    product(a, a, weights).sqrt()
}

fn add(to: &mut [f64], share: f64, table: &[f64]) {
    to.iter_mut().zip(table).for_each(|(sum, value)| *sum += share * value);
}

/// Orthogonalises `vector` against `others` and normalises it. Division by a small singular value
/// amplifies roundings along the greater ones; the second round removes the first one's own
/// rounding.
fn orthonormalise(vector: &mut [f64], others: &[Vec<f64>], weights: &[f64]) {
    for _ in 0..2 {
        for other in others {
            let share = product(vector, other, weights);
            add(vector, -share, other);
        }
        normalise(vector, weights);
    }
}

fn normalise(vector: &mut [f64], weights: &[f64]) {
    let scale = norm(vector, weights).recip();
    vector.iter_mut().for_each(|value| *value *= scale);
}

/// Flips signs so that the first of the values of greatest magnitude is positive.
fn fix_sign(vector: &mut [f64]) {
    let greatest = vector.iter().fold(0.0f64, |g, v| if v.abs() > g.abs() { *v } else { g });
    if greatest < 0.0 {
        vector.iter_mut().for_each(|value| *value = -*value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_even_and_meet_the_ends_of_the_range() {
        assert_eq!(even_by([1.0, 4.0], 4, |x| x, |x| x), [1.0, 2.0, 3.0, 4.0]);
        let octaves = even([1.0, 64.0], 7, false);
        assert!(
            octaves
                .iter()
                .zip([1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
                .all(|(a, b)| (a / b - 1.0).abs() < 1e-14)
        );
        let from_zero = even([0.0, 63.0], 7, true);
        assert!(
            from_zero
                .iter()
                .zip([0.0, 1.0, 3.0, 7.0, 15.0, 31.0, 63.0])
                .all(|(a, b)| (a - b).abs() < 1e-12)
        );
        assert_eq!((from_zero[0], from_zero[6]), (0.0, 63.0));
    }

    #[test]
    fn the_quadrature_knows_the_norms_of_lobes() {
        let weights = quadrature();
        // ‖lobe‖² = ((n + 2)/2π)² · 4/(2n + 2). Gregory's next term is 3/160 h Δ⁴g: near t = 0 g =
        // 16 t³ (1 − 2 n t⁴) of the peak's square, Δ⁴ t⁷ = 8400 h⁷ and the norm 2/n, together 2520
        // n² h⁸ of it. At t = 1 it is greatest for n = 1, g = 16·64 (1 − t)³ and steeper terms:
        // some 10⁵ · 3/160 h⁵ = 2·10⁻¹².
        for ns in [0.0, 1.0, 2.0, 10.0, 1e3, 1e4, 1e5, 1e6] {
            let exact = ((ns + 2.0) / std::f64::consts::TAU).powi(2) * 4.0 / (2.0 * ns + 2.0);
            let measured = product(&lobe_table(ns), &lobe_table(ns), &weights);
            let bound = 5e-12 + 2520.0 * ns * ns * 1024f64.powi(-8);
            assert!(
                (measured / exact - 1.0).abs() < bound,
                "n_s = {ns}: {}",
                measured / exact - 1.0
            );
        }
        // 1/cosh(½ ln((1 + a)/(1 + b))) for lobes of unit norm: a = 1, b = 7 gives 1/cosh(ln 2) =
        // 0.8.
        let (a, b) = (lobe_table(1.0), lobe_table(7.0));
        let cosine = product(&a, &b, &weights) / (norm(&a, &weights) * norm(&b, &weights));
        assert!((cosine - 0.8).abs() < 1e-9, "{cosine}");
    }

    #[test]
    fn the_greatest_entry_becomes_positive_the_first_of_equal_ones() {
        for (given, fixed) in
            [([1.0, -3.0, 2.0], [-1.0, 3.0, -2.0]), ([-2.0, 2.0, 0.0], [2.0, -2.0, 0.0])]
        {
            let mut vector = given;
            fix_sign(&mut vector);
            assert_eq!(vector, fixed);
            fix_sign(&mut vector);
            assert_eq!(vector, fixed);
        }
    }
}
