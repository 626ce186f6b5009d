//! Furnaces, and single scattering against quadrature.

use std::f64::consts::PI;

use glam::DVec3;
use nimbus::model::light::Light;
use nimbus::model::material::Brdf;
use nimbus::model::phase::Phase;
use nimbus::reference::Blob;
use nimbus::reference::transport::{
    BlobMedium, Lights, Medium, Ray, Scatterer, Solids, Stream, TransportScene, Unbiased,
};

use crate::{Mean, paths, radiance, ray};
use nimbus::model::cloud::Shape;

/// Blobs of different sizes, shapes and depths in one another.
pub fn crowd() -> Vec<Blob> {
    let blob = |x: f64, y: f64, z: f64, sigma: f64, aspect: f64, kappa: f64| Blob {
        position: DVec3::new(x, y, z),
        sigma,
        shape: Shape::upright(aspect),
        kappa,
    };
    vec![
        blob(0.0, 0.0, 0.0, 0.5, 1.0, 1.2),
        blob(0.6, 0.2, -0.3, 0.3, 0.4, 3.0),
        blob(-0.5, -0.1, 0.2, 0.4, 2.5, 0.8),
        blob(0.1, 0.5, 0.4, 0.05, 1.0, 9.0),
        blob(-0.2, -0.4, -0.6, 0.7, 0.15, 0.5),
    ]
}

pub fn medium(albedo: f64, phase: Phase) -> BlobMedium {
    let scatterer = Scatterer { albedo: DVec3::splat(albedo), phase };
    BlobMedium::new(&crowd(), &[0; 5], vec![scatterer])
}

/// The phase functions that are tested.
pub fn phases() -> [Phase; 3] {
    [Phase::HenyeyGreenstein { g: 0.0 }, Phase::HenyeyGreenstein { g: 0.85 }, Phase::droplets(10.0)]
}

/// A white room's floor below the blobs, and a wall beside them.
pub fn floor(kd: f64) -> Solids {
    let brdf = Brdf { kd: DVec3::splat(kd), ks: DVec3::ZERO, ns: 1.0 };
    let floor = [DVec3::new(-4.0, -1.2, -4.0), DVec3::Z * 8.0, DVec3::X * 8.0];
    Solids::new(&[(floor, 0)], &[], vec![brdf])
}

/// χ² over rays: each ray's mean is within its own standard error of the truth as often as a normal
/// distribution says.
fn assert_all_are(what: &str, rays: &[Ray], truth: f64, mean: impl Fn(Ray) -> Mean) {
    let found: Vec<Mean> = rays.iter().map(|ray| mean(*ray)).collect();
    let chi: f64 = found.iter().map(|m| m.off(truth).powi(2)).sum();
    let n = rays.len() as f64;
    // χ² of n degrees has the mean n and the variance 2n.
    let off = (chi - n) / (2.0 * n).sqrt();
    let all = found.iter().map(|m| m.value).sum::<f64>() / n;
    let error = found.iter().map(|m| m.error.powi(2)).sum::<f64>().sqrt() / n;
    println!("{what}: mean {all:.5} ± {error:.1e}, chi^2 {chi:.1} of {n}");
    assert!((all - truth).abs() < 3.0 * error, "{what}: {all} ± {error}");
    assert!(off.abs() < 4.0, "{what}: chi^2 {chi} of {n}");
}

/// In light of radiance 1 from everywhere, what absorbs nothing cannot be seen: scattered light and
/// what passes straight through are 1 along every ray.
#[test]
fn furnaces_are_even() {
    let rays: Vec<Ray> = (0..40)
        .map(|i| {
            let (s, c) = (f64::from(i) * 0.7).sin_cos();
            let aim = DVec3::new(0.3 * c, 0.2 * s, 0.1);
            ray(DVec3::new(4.0 * c, 1.0 + 0.02 * f64::from(i), 4.0 * s), aim)
        })
        .collect();
    for phase in phases() {
        for (name, solids) in [("air", Solids::default()), ("floor", floor(1.0))] {
            let lights = Lights::uniform(DVec3::ONE);
            let scene = TransportScene { medium: medium(1.0, phase), solids, lights };
            assert_all_are(&format!("{phase:?} over {name}"), &rays, 1.0, |ray| {
                paths::<_, Unbiased>(&scene, ray, 3000, |light| {
                    light.radiance().y + 1.0 - light.alpha
                })
            });
        }
    }
}

/// ∫ e^{−τ(t)} σ(t) p(cos) E e^{−τ_sun(t)} dt, by the trapezoidal rule on a fine raster, which is
/// exact to rounding for what is as smooth as Gaussians.
fn single(ray: Ray, toward_sun: DVec3, phase: Phase) -> f64 {
    let blobs = crowd();
    let medium = medium(1.0, phase);
    let density = |x: DVec3| -> f64 {
        let at = |b: &Blob| {
            let w = b.whiten(x - b.position) / b.sigma;
            b.kappa * (-0.5 * w.length_squared()).exp()
        };
        blobs.iter().map(at).sum()
    };
    let p = phase.at(ray.direction.dot(toward_sun));
    let step = 2e-3;
    (0..6000)
        .map(|k| {
            let t = step * f64::from(k);
            let sun = Ray { origin: ray.at(t), direction: toward_sun };
            let through = (-medium.depth(&ray, t) - medium.depth(&sun, f64::INFINITY)).exp();
            step * density(ray.at(t)) * p * through
        })
        .sum()
}

#[test]
fn single_scattering_is_its_integral() {
    let toward_sun = DVec3::new(0.4, 0.8, 0.3).normalize();
    let sun = Light::Directional { direction: -toward_sun, irradiance: DVec3::ONE };
    for phase in phases() {
        let scene = TransportScene {
            medium: medium(0.7, phase),
            solids: Solids::default(),
            lights: Lights::new(&[sun], 1e-4),
        };
        for (from, to) in [
            (DVec3::new(3.0, 0.5, 4.0), DVec3::ZERO),
            (DVec3::new(-2.0, -3.0, 1.0), DVec3::new(0.3, 0.1, -0.2)),
        ] {
            let ray = ray(from, to);
            let truth = 0.7 * single(ray, toward_sun, phase);
            let found = paths::<_, Unbiased>(&scene, ray, 1_500_000, |light| light.layers[0].y);
            found.assert_is(&format!("{phase:?}, once"), truth, 1e-3);
        }
    }
}

/// Layers tell how often light was scattered and what it came from.
#[test]
fn layers_tell_orders_and_lights() {
    let sun = Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ONE };
    let sky = Light::even_sky(DVec3::splat(0.5), 0.2);
    let of = |lights: &[Light], solids: Solids| TransportScene {
        medium: medium(0.9, Phase::HenyeyGreenstein { g: 0.5 }),
        solids,
        lights: Lights::new(lights, 0.005),
    };
    let eye = ray(DVec3::new(3.0, 1.0, 4.0), DVec3::ZERO);
    let both = of(&[sun, sky], floor(0.5));
    let layer = |scene: &TransportScene<BlobMedium>, i: usize| {
        paths::<_, Unbiased>(scene, eye, 200_000, |l| l.layers[i].y)
    };
    for (i, alone) in [of(&[sun], floor(0.5)), of(&[sky], floor(0.5))].iter().enumerate() {
        for order in 0..3 {
            let (a, b) = (layer(&both, 2 * order + i), layer(alone, 2 * order + i));
            assert!(
                (a.value - b.value).abs() < 4.0 * a.error.hypot(b.error),
                "{i} {order} {a:?} {b:?}"
            );
            assert!(a.value > 20.0 * a.error, "{i} {order}: {a:?}");
            assert_eq!(layer(alone, 2 * order + 1 - i).value, 0.0);
        }
    }
}

/// Where nothing shines, or a lamp's cone does not reach, everything is black and a number.
#[test]
fn the_dark_is_black() {
    let spot = Light::Spot {
        position: DVec3::new(0.0, 9.0, 0.0),
        direction: DVec3::Y,
        intensity: DVec3::ONE,
        radius: 0.01,
        cos_inner: 0.9,
        cos_outer: 0.8,
    };
    let black = Light::even_sky(DVec3::ZERO, 0.5);
    let eye = ray(DVec3::new(3.0, 1.0, 4.0), DVec3::ZERO);
    for lights in [&[][..], &[spot], &[black]] {
        let scene = TransportScene {
            medium: medium(1.0, phases()[1]),
            solids: floor(0.5),
            lights: Lights::new(lights, 0.005),
        };
        let mean = radiance(&scene, eye, 2000);
        assert_eq!((mean.value, mean.error), (0.0, 0.0), "{lights:?}");
    }
}

/// A white floor in the sun alone: E K_d cos θ/π.
#[test]
fn a_bare_floor_reflects_as_its_material_says() {
    let toward_sun = DVec3::new(0.6, 0.8, 0.0);
    let sun = Light::Directional { direction: -toward_sun, irradiance: DVec3::splat(2.0) };
    let scene = TransportScene {
        medium: crate::Vacuum,
        solids: floor(0.5),
        lights: Lights::new(&[sun], 0.005),
    };
    let eye = ray(DVec3::new(1.0, 3.0, 2.0), DVec3::new(0.0, -1.2, 0.0));
    radiance(&scene, eye, 20_000).assert_is("floor", 2.0 * 0.5 * 0.8 / PI, 1e-3);
    // From below it is black, and hides the sun.
    let below = ray(DVec3::new(1.0, -3.0, 2.0), DVec3::new(0.0, -1.2, 0.0));
    let light = scene.trace(below, &mut Stream::new(0, 0));
    assert_eq!((light.radiance(), light.alpha), (DVec3::ZERO, 1.0));
}
