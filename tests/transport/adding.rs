//! Even slabs by adding and doubling (van de Hulst 1980, chapter 4), and Chandrasekhar's H.
//!
//! Light is averaged over azimuth. I(μ) is the radiance along the cosine μ, and an operator is a
//! matrix over the nodes that leads from the radiance that enters to the one that leaves.

use nalgebra::DMatrix;

/// Nodes in (0, 1) of a Gauss–Legendre quadrature, and its weights; last the node 1 with the weight
/// 0, which only leaves.
pub fn nodes(n: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut x, mut w) = (Vec::new(), Vec::new());
    for i in 0..n {
        // Newton's method from the asymptotic zeros.
        let mut t = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        for _ in 0..50 {
            let (p, slope) = legendre_and_slope(n, t);
            t -= p / slope;
        }
        let (_, slope) = legendre_and_slope(n, t);
        x.push(0.5 * (1.0 + t));
        w.push(1.0 / ((1.0 - t * t) * slope * slope));
    }
    x.push(1.0);
    w.push(0.0);
    (x, w)
}

fn legendre_and_slope(n: usize, t: f64) -> (f64, f64) {
    let (mut before, mut p) = (1.0, t);
    for l in 2..=n {
        let l = l as f64;
        (before, p) = (p, ((2.0 * l - 1.0) * t * p - (l - 1.0) * before) / l);
    }
    (p, n as f64 * (t * p - before) / (t * t - 1.0))
}

fn legendre(n: usize, t: f64) -> Vec<f64> {
    let mut all = vec![1.0, t];
    for l in 2..n {
        let k = l as f64;
        all.push(((2.0 * k - 1.0) * t * all[l - 1] - (k - 1.0) * all[l - 2]) / k);
    }
    all
}

/// A slab's reflection and transmission.
pub struct Operators {
    pub nodes: Vec<f64>,
    pub weights: Vec<f64>,
    pub reflected: DMatrix<f64>,
    /// Without what passes straight through.
    pub transmitted: DMatrix<f64>,
}

impl Operators {
    /// Returns the operators of a slab of that depth, albedo and asymmetry of Henyey and Greenstein.
    pub fn of_slab(depth: f64, albedo: f64, g: f64, n: usize) -> Operators {
        let (nodes, weights) = nodes(n);
        let size = nodes.len();
        let polynomials: Vec<Vec<f64>> = nodes.iter().map(|t| legendre(2 * n, *t)).collect();
        let phase = |i: usize, j: usize, sign: f64| {
            let term = |l: usize| {
                let sign = if l % 2 == 1 { sign } else { 1.0 };
                (2 * l + 1) as f64 * g.powi(l as i32) * sign * polynomials[i][l] * polynomials[j][l]
            };
            (0..2 * n).map(term).sum::<f64>()
        };
        let n_doublings = 30;
        let thin = depth / 2f64.powi(n_doublings);
        let once = |sign: f64| {
            DMatrix::from_fn(size, size, |i, j| {
                0.5 * albedo * thin / nodes[i] * phase(i, j, sign) * weights[j]
            })
        };
        let (mut r, mut t) = (once(-1.0), once(1.0));
        let mut passed = thin;
        for _ in 0..n_doublings {
            let direct =
                DMatrix::from_fn(
                    size,
                    size,
                    |i, j| {
                        if i == j { (-passed / nodes[i]).exp() } else { 0.0 }
                    },
                );
            let whole = &t + &direct;
            let between = (DMatrix::identity(size, size) - &r * &r).try_inverse().expect("a slab");
            // What goes down between the halves: (1 − r r)⁻¹ (t + e).
            let down = &between * &whole;
            r = &r + &whole * &r * &down;
            t = &whole * &down - &direct * &direct;
            passed *= 2.0;
        }
        Operators { nodes, weights, reflected: r, transmitted: t }
    }

    /// Returns the radiance reflected along node `i` of a sky of radiance 1: the share of parallel
    /// light from there that the slab reflects.
    pub fn albedo(&self, i: usize) -> f64 {
        self.reflected.row(i).sum()
    }

    /// Returns the radiance of that sky that arrives scattered along node `i` on the other side.
    pub fn transmittance(&self, i: usize) -> f64 {
        self.transmitted.row(i).sum()
    }

    /// Returns the radiance reflected along node `j` of light along the normal of unit irradiance.
    /// The operator's last row is what leaves along the normal, and by reciprocity what comes from
    /// there: R(μ, 1) = R(1, μ), where r = 2 R μ w.
    pub fn of_zenith(&self, j: usize) -> f64 {
        let last = self.nodes.len() - 1;
        self.reflected[(last, j)] / (2.0 * self.nodes[j] * self.weights[j]) / std::f64::consts::PI
    }
}

/// Chandrasekhar's H(μ) of isotropic scattering, at the nodes. *Source*: Radiative Transfer (1950),
/// chapter V, H(μ) = 1/(√(1 − ϖ) + ϖ/2 ∫ μ' H(μ')/(μ + μ') dμ').
pub fn chandrasekhar(albedo: f64, n: usize) -> (Vec<f64>, Vec<f64>) {
    let (nodes, weights) = nodes(n);
    let mut h = vec![1.0; nodes.len()];
    for _ in 0..2000 {
        let of = |mu: f64| {
            let sum: f64 =
                (0..nodes.len()).map(|k| weights[k] * nodes[k] * h[k] / (mu + nodes[k])).sum();
            1.0 / ((1.0 - albedo).sqrt() + 0.5 * albedo * sum)
        };
        let next: Vec<f64> = nodes.iter().map(|mu| of(*mu)).collect();
        h.iter_mut().zip(&next).for_each(|(a, b)| *a = 0.5 * (*a + b));
    }
    (nodes, h)
}

#[test]
fn quadrature_is_exact_for_polynomials() {
    let (x, w) = nodes(8);
    for power in 0..16 {
        let sum: f64 = x.iter().zip(&w).map(|(x, w)| w * x.powi(power)).sum();
        assert!((sum - 1.0 / f64::from(power + 1)).abs() < 1e-14, "{power}: {sum}");
    }
}

/// H(1) without absorption is 2.90781 (Chandrasekhar 1950, table XI).
#[test]
fn h_functions_are_those_of_the_table() {
    let (_, h) = chandrasekhar(1.0, 64);
    assert!((h[h.len() - 1] - 2.907_81).abs() < 2e-3, "{}", h[h.len() - 1]);
    // The moment ∫ H dμ = 2 (1 − √(1 − ϖ))/ϖ holds for all albedos.
    for albedo in [0.5, 0.9, 0.99] {
        let (_, weights) = nodes(64);
        let (_, h) = chandrasekhar(albedo, 64);
        let moment: f64 = weights.iter().zip(&h).map(|(w, h)| w * h).sum();
        let expected = 2.0 * (1.0 - (1.0 - albedo).sqrt()) / albedo;
        assert!((moment / expected - 1.0).abs() < 1e-9, "{albedo}: {moment}");
    }
}

/// Nothing is lost without absorption, and a thick isotropic slab reflects as the half space does.
#[test]
fn adding_conserves_light_and_agrees_with_chandrasekhar() {
    for g in [0.0, 0.85] {
        for depth in [0.1, 1.0, 10.0] {
            let slab = Operators::of_slab(depth, 1.0, g, 64);
            for i in (0..64).step_by(9) {
                let direct = (-depth / slab.nodes[i]).exp();
                let all = slab.albedo(i) + slab.transmittance(i) + direct;
                assert!((all - 1.0).abs() < 2e-5, "{g} {depth} {i}: {all}");
            }
        }
    }
    for albedo in [0.9, 0.99] {
        let slab = Operators::of_slab(400.0, albedo, 0.0, 48);
        let (nodes, h) = chandrasekhar(albedo, 48);
        for i in (0..nodes.len()).step_by(7) {
            let r = 1.0 - h[i] * (1.0 - albedo).sqrt();
            assert!(
                (slab.albedo(i) / r - 1.0).abs() < 1e-4,
                "{albedo} {i}: {} {r}",
                slab.albedo(i)
            );
        }
    }
}
