//! Bound on the change of a pixel by a low-resolution picture, passes.md "upsample": Lagrange's
//! remainder, with the sixth derivatives bounded by majorant power series, and the steps at the
//! blobs' edges. Random pictures keep it.

use nimbus::model::resolution::LowResLayout;
use nimbus::reference::upsample::render;

/// The greatest |Π (t − k)| of the interpolation's six taps along one axis, and Σ |w| of its
/// weights, both at t = ½.
const PRODUCT: f64 = 225.0 / 64.0;
const LEBESGUE: f64 = 356.0 / 256.0;
/// h_k/k! for k from 1 to 6, h_k the greatest |He_k(x) e^{−x²/2}|, rounded up.
const GAUSSIAN: [f64; 6] =
    [0.606_531, 0.5, 1.380_2 / 6.0, 3.0 / 24.0, 5.783_5 / 120.0, 15.0 / 720.0];

/// A blob as a pixel's taps see it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    /// Greatest optical depth.
    tau: f64,
    /// σ, small pixels.
    sigma: f64,
    /// Whether the pixel and its taps lie partly inside and partly outside the blob's edge.
    crosses: bool,
}

/// Returns a bound on the change of a channel of radiances up to `brightest` (1 for alpha). `seen`
/// are the blobs that cover the pixel or one of its taps; `edge` is e^{−cutoff²/2}.
fn bound(seen: &[Seen], edge: f64, brightest: f64) -> f64 {
    let mut q = [0.0; 7];
    let (mut depth, mut steps) = (0.0, 0.0);
    for blob in seen {
        for (k, h) in (1i32..).zip(GAUSSIAN) {
            q[k as usize] += blob.tau * h / blob.sigma.powi(k);
        }
        depth += blob.tau;
        steps += if blob.crosses { blob.tau * edge } else { 0.0 };
    }
    let smooth = (1.0 + LEBESGUE) * PRODUCT * (1.0 + depth) * exponential(&q)[6];
    let at_edges = (1.0 + LEBESGUE * LEBESGUE) * -libm::expm1(-steps);
    (smooth + at_edges) * brightest
}

/// Returns the first coefficients of e^q, q without a constant: k e_k = Σ j q_j e_{k−j}.
fn exponential(q: &[f64; 7]) -> [f64; 7] {
    let mut e = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for k in 1..7 {
        e[k] = (1..=k).map(|j| j as f64 * q[j] * e[k - j]).sum::<f64>() / k as f64;
    }
    e
}

#[test]
fn the_series_of_an_exponential() {
    // e^{s}: 1/k!; e^{s²}: 1, 0, 1, 0, ½, 0, 1/6.
    let e = exponential(&[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert!((e[6] - 1.0 / 720.0).abs() < 1e-18 && (e[3] - 1.0 / 6.0).abs() < 1e-16);
    assert_eq!(exponential(&[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0])[4], 0.5);
}

#[test]
fn one_thin_blob_by_hand() {
    // To first order in τ: 2.390625 · 3.515625 · τ · 15/720 / σ⁶ with σ = 2.
    let of = bound(&[Seen { tau: 1e-9, sigma: 2.0, crosses: false }], 0.0, 1.0);
    assert!(
        (of / (1e-9 * 2.390_625 * 3.515_625 * 15.0 / 720.0 / 64.0) - 1.0).abs() < 1e-6,
        "{of:e}"
    );
    // A step alone: 1 + Λ² = 2.9338… of τ e^{−4.5}.
    let of = bound(&[Seen { tau: 1e-9, sigma: 1e9, crosses: true }], (-4.5f64).exp(), 2.0);
    let expected = 2.0 * (1.0 + LEBESGUE * LEBESGUE) * 1e-9 * (-4.5f64).exp();
    assert!((of / expected - 1.0).abs() < 1e-6, "{of:e}");
}

/// Gaussians at places in full pixels.
struct Blob {
    at: [f64; 2],
    sigma: f64,
    tau: f64,
    light: f64,
}

impl Blob {
    /// τ at a place, 0 beyond 3 σ.
    fn tau_at(&self, x: f64, y: f64) -> f64 {
        let e =
            ((x - self.at[0]).powi(2) + (y - self.at[1]).powi(2)) / (2.0 * self.sigma * self.sigma);
        if e <= 4.5 { self.tau * (-e).exp() } else { 0.0 }
    }
}

fn composed(blobs: &[Blob], x: f64, y: f64) -> [f64; 4] {
    let mut v = [0.0; 4];
    for b in blobs {
        let a = -libm::expm1(-b.tau_at(x, y));
        v[0] = a * b.light + (1.0 - a) * v[0];
        v[3] = a + (1.0 - a) * v[3];
    }
    v
}

/// Checks every pixel of random pictures against its bound, and prints the greatest error over
/// bound.
#[test]
fn no_pixel_of_random_pictures_changes_more() {
    let full = [40, 30];
    let mut state = 7u64;
    let mut uniform = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    for (n_blobs, tau_most, n, least) in
        [(1, 0.1, 2, 3.0), (30, 0.1, 2, 2.0), (30, 0.1, 4, 5.0), (8, 1.5, 2, 3.0)]
    {
        let small = LowResLayout::of(full, n);
        let blobs: Vec<Blob> = (0..n_blobs)
            .map(|_| Blob {
                at: [40.0 * uniform(), 30.0 * uniform()],
                sigma: least + 3.0 * uniform(),
                tau: tau_most * uniform(),
                light: uniform(),
            })
            .collect();
        let place = |k: u32, axis: usize| {
            (f64::from(k) + 0.5 - 0.5 * f64::from(small.size[axis])) * f64::from(n)
                + 0.5 * f64::from(full[axis])
        };
        let [w, h] = small.size;
        let picture: Vec<[f64; 4]> =
            (0..w * h).map(|i| composed(&blobs, place(i % w, 0), place(i / w, 1))).collect();
        let mut greatest = 0f64;
        for (p, (value, _)) in (0u32..).zip(render(&small, &picture, None)) {
            let [i, j] = [p % full[0], p / full[0]];
            let (x, y) = (f64::from(i) + 0.5, f64::from(j) + 0.5);
            let base = [0, 1].map(|k| (small.offsets()[k] + 2 * [i, j][k]) / (2 * n) - 2);
            let taps = (0..36).map(|k| (place(base[0] + k % 6, 0), place(base[1] + k / 6, 1)));
            let places: Vec<(f64, f64)> = taps.chain([(x, y)]).collect();
            let seen: Vec<Seen> = blobs
                .iter()
                .filter_map(|b| {
                    let n_in = places.iter().filter(|(x, y)| b.tau_at(*x, *y) > 0.0).count();
                    let sigma = b.sigma / f64::from(n);
                    (n_in > 0).then_some(Seen { tau: b.tau, sigma, crosses: n_in < places.len() })
                })
                .collect();
            let truth = composed(&blobs, x, y);
            for k in [0, 3] {
                let (error, most) =
                    ((value[k] - truth[k]).abs(), bound(&seen, (-4.5f64).exp(), 1.0));
                assert!(
                    error <= most + 1e-14,
                    "{n_blobs} blobs, 1/{n}, pixel {i} {j}: {error:e} > {most:e}"
                );
                greatest = if most > 0.0 { greatest.max(error / most) } else { greatest };
            }
        }
        println!(
            "{n_blobs} blobs of tau up to {tau_most}, 1/{n}: greatest error/bound {greatest:.3}"
        );
        // The bound is not vacuous: one blob's edge comes near it.
        assert!(n_blobs > 1 || greatest > 0.05);
    }
}
