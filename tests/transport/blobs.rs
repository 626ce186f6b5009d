//! Optical depths and free flights of blobs.

use glam::DVec3;
use nimbus::model::phase::Phase;
use nimbus::reference::transport::{Medium, Ray, Stream};

use crate::known::{crowd, medium};
use crate::{Mean, ray};

fn isotropic() -> Phase {
    Phase::HenyeyGreenstein { g: 0.0 }
}

/// The trapezoidal sum of the density along a ray.
fn summed(ray: &Ray, end: f64) -> f64 {
    let n = 40_000;
    let step = end / f64::from(n);
    let density = |t: f64| -> f64 {
        crowd()
            .iter()
            .map(|b| {
                let w = b.whiten(ray.at(t) - b.position) / b.sigma;
                b.kappa * (-0.5 * w.length_squared()).exp()
            })
            .sum()
    };
    let inner: f64 = (1..n).map(|k| density(step * f64::from(k))).sum();
    step * (inner + 0.5 * (density(0.0) + density(end)))
}

fn rays() -> Vec<Ray> {
    (0..12)
        .map(|i| {
            let (s, c) = (f64::from(i) * 1.3).sin_cos();
            // Some begin in the middle of blobs.
            let from = DVec3::new(3.0 * c, s, 2.0 * s) * if i % 3 == 0 { 0.1 } else { 1.0 };
            ray(from, DVec3::new(0.2 * s, 0.1 * c, -0.1))
        })
        .collect()
}

#[test]
fn depths_are_the_integrals_along_rays() {
    let medium = medium(1.0, isotropic());
    for ray in rays() {
        for end in [0.4, 2.0, 9.0] {
            let (found, truth) = (medium.depth(&ray, end), summed(&ray, end));
            // Trapezoids of a Gaussian cut at a step err by h²/12 times the slope there.
            assert!((found - truth).abs() < 3e-6, "{end}: {found} {truth}");
        }
        let whole = medium.depth(&ray, f64::INFINITY);
        assert!((whole - summed(&ray, 12.0)).abs() < 3e-6);
    }
}

/// Distances of free flights have the distribution 1 − e^{−τ(t)} (Kolmogorov–Smirnov), and what is
/// met is met as often as its share of the extinction says.
#[test]
fn free_flights_have_their_distribution() {
    let medium = medium(1.0, isotropic());
    let n = 20_000;
    for (k, ray) in rays().into_iter().enumerate() {
        let mut stream = Stream::new(k as u32, 3);
        let drawn = (0..n).map(|_| medium.collide(&ray, f64::INFINITY, &mut stream));
        let mut distances: Vec<f64> =
            drawn.map(|c| c.map_or(f64::INFINITY, |c| c.distance)).collect();
        distances.sort_by(f64::total_cmp);
        let mut worst: f64 = 0.0;
        for (i, t) in distances.iter().enumerate().filter(|(_, t)| t.is_finite()) {
            let share = -libm::expm1(-medium.depth(&ray, *t));
            let (below, above) = (i as f64 / f64::from(n), (i + 1) as f64 / f64::from(n));
            worst = worst.max((share - below).abs()).max((share - above).abs());
        }
        let escaped = distances.iter().filter(|t| t.is_infinite()).count() as f64 / f64::from(n);
        let through = (-medium.depth(&ray, f64::INFINITY)).exp();
        let error = (through * (1.0 - through) / f64::from(n)).sqrt();
        assert!((escaped - through).abs() < 4.0 * error + 1e-6, "{k}: {escaped} {through}");
        // 2 e^{−2 n d²}: less than 10⁻⁵ beyond 2.5/√n.
        assert!(worst < 2.5 / f64::from(n).sqrt(), "{k}: {worst}");
    }
}

#[test]
fn a_flight_ends_at_its_end() {
    let medium = medium(1.0, isotropic());
    let ray = rays()[1];
    let end = 3.0;
    let share = Mean::of(40_000, |i| {
        let met = medium.collide(&ray, end, &mut Stream::new(5, i as u32));
        assert!(met.is_none_or(|c| c.distance < end));
        f64::from(u8::from(met.is_none()))
    });
    share.assert_is("share that passes", (-medium.depth(&ray, end)).exp(), 0.05);
}

/// Many blobs, some of them far away, one in the other: the tree finds what a search of all finds.
#[test]
fn a_tree_of_many_blobs_finds_them_all() {
    use nimbus::model::cloud::Shape;
    use nimbus::reference::Blob;
    use nimbus::reference::transport::{BlobMedium, Scatterer};
    let mut stream = Stream::new(1, 1);
    let mut number = |low: f64, high: f64| low + (high - low) * stream.uniform();
    let blobs: Vec<Blob> = (0..3000)
        .map(|i| Blob {
            position: DVec3::new(number(-5.0, 5.0), number(-1.0, 1.0), number(-5.0, 5.0)),
            sigma: if i % 97 == 0 { 1.5 } else { number(0.02, 0.2) },
            shape: Shape::upright(if i % 5 == 0 { number(0.1, 3.0) } else { 1.0 }),
            kappa: number(0.0, 2.0),
        })
        .chain((0..200).map(|_| Blob {
            position: DVec3::ONE,
            sigma: 0.1,
            shape: Shape::BALL,
            kappa: 0.1,
        }))
        .collect();
    let scatterer = Scatterer { albedo: DVec3::ONE, phase: isotropic() };
    let all = BlobMedium::new(&blobs, &vec![0; blobs.len()], vec![scatterer]);
    for k in 0..60 {
        let (s, c) = (f64::from(k) * 0.37).sin_cos();
        let from = DVec3::new(7.0 * c, 0.3 * s, 7.0 * s);
        let axis = k % 4 == 0;
        let ray = if axis {
            Ray { origin: from, direction: DVec3::NEG_X }
        } else {
            ray(from, DVec3::ZERO)
        };
        for end in [5.0, f64::INFINITY] {
            let one = |b: &Blob| {
                BlobMedium::new(std::slice::from_ref(b), &[0], vec![scatterer]).depth(&ray, end)
            };
            let truth: f64 = blobs.iter().map(one).sum();
            let found = all.depth(&ray, end);
            // In the tree a blob may count a little beyond its own box.
            assert!((found - truth).abs() < 1e-7, "{k}: {found} {truth}");
        }
    }
}
