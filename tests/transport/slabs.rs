//! Even slabs against adding and doubling, and half spaces against Chandrasekhar's H: 0.5 %.

use glam::DVec3;
use nimbus::model::light::Light;
use nimbus::reference::transport::{Lights, Ray};

use crate::adding::{Operators, chandrasekhar};
use crate::slab::{Slab, lit, toward};
use crate::{Mean, radiance, radiance_within};

/// A sky of radiance 1 above the horizon.
fn sky() -> Lights {
    let irradiance = DVec3::splat(std::f64::consts::PI);
    Lights::new(&[Light::even_sky(irradiance, 0.0)], 0.005)
}

/// Standard error of every mean, as a share of it: two of them are half of a percent.
const ACCURACY: f64 = 0.0025;
const N: usize = 48;

/// Compares both faces of slabs with the exact solution, for all depths and albedos. The cosine
/// changes from one to the next.
fn compare(g: f64) {
    let mut cosines = [4, 24, 44].into_iter().cycle();
    for depth in [0.1, 1.0, 10.0] {
        for albedo in [0.9, 0.99, 0.9997, 1.0] {
            let truth = Operators::of_slab(depth, albedo, g, N);
            let scene = lit(Slab::new(depth, albedo, g), sky());
            let i = cosines.next().expect("a cycle");
            let cosine = truth.nodes[i];
            let what = format!("depth {depth}, albedo {albedo}, g {g}, cosine {cosine:.3}");
            let (back, through) = (truth.albedo(i), truth.transmittance(i));
            for (from_above, truth, name) in [(true, back, "back"), (false, through, "through")] {
                // What is much darker than the other face takes many paths for little.
                let accuracy =
                    if truth < 0.1 * (back + through) { 2.0 * ACCURACY } else { ACCURACY };
                let ray = toward(depth, from_above, cosine);
                let found = radiance_within(&scene, ray, accuracy * truth);
                found.assert_is(&format!("{what}, {name}"), truth, accuracy);
            }
        }
    }
}

#[test]
fn slabs_of_isotropic_scattering() {
    compare(0.0);
}

#[test]
fn slabs_that_scatter_forward() {
    compare(0.85);
}

#[test]
fn half_spaces_by_chandrasekhar() {
    for albedo in [0.9, 0.99, 0.9997] {
        let (nodes, h) = chandrasekhar(albedo, N);
        for i in [6, 24, 44] {
            let truth = 1.0 - h[i] * (1.0f64 - albedo).sqrt();
            let scene = lit(Slab::new(f64::INFINITY, albedo, 0.0), sky());
            let found = radiance_within(&scene, toward(0.0, true, nodes[i]), ACCURACY * truth);
            found.assert_is(&format!("half space, {albedo}, {:.3}", nodes[i]), truth, ACCURACY);
        }
    }
    // Nothing is absorbed.
    let scene = lit(Slab::new(f64::INFINITY, 1.0, 0.0), sky());
    let found = radiance(&scene, toward(0.0, true, 0.6), 2000);
    found.assert_is("half space, 1", 1.0, 0.02);
}

/// Light along the normal, from a sun of its usual width: 10⁻⁵ of the radiance changes with it.
#[test]
fn a_sun_in_the_zenith() {
    let sun = |direction: DVec3| Light::Directional { direction, irradiance: DVec3::ONE };
    for (depth, albedo, g) in [(1.0, 1.0, 0.0), (1.0, 0.9, 0.85), (10.0, 0.99, 0.85)] {
        let truth = Operators::of_slab(depth, albedo, g, N);
        for i in [10, 30, 44] {
            let scene = lit(
                Slab::new(depth, albedo, g),
                Lights::new(&[sun(DVec3::NEG_Y)], 0.27f64.to_radians()),
            );
            let expected = truth.of_zenith(i);
            let ray = toward(depth, true, truth.nodes[i]);
            let found = radiance_within(&scene, ray, 2.0 * ACCURACY * expected);
            let what = format!("zenith, depth {depth}, {albedo}, g {g}, {:.3}", truth.nodes[i]);
            found.assert_is(&what, expected, 2.0 * ACCURACY);
        }
    }
}

/// R(μ, μ₀) = R(μ₀, μ): sun and eye change places.
#[test]
fn sun_and_eye_may_change_places() {
    let of = |eye: f64, sun: f64| {
        // Across each other, so that azimuths are the same in both.
        let side = (1.0 - sun * sun).sqrt();
        let light =
            Light::Directional { direction: DVec3::new(0.0, -sun, -side), irradiance: DVec3::ONE };
        let scene = lit(Slab::new(3.0, 0.95, 0.6), Lights::new(&[light], 0.005));
        let ray: Ray = toward(3.0, true, eye);
        let mean = radiance(&scene, ray, 400_000);
        Mean { value: mean.value / sun, error: mean.error / sun }
    };
    for (a, b) in [(0.9, 0.3), (0.6, 0.15)] {
        let (there, back) = (of(a, b), of(b, a));
        let error = there.error.hypot(back.error);
        println!("{a} {b}: {there:?} {back:?}");
        assert!((there.value - back.value).abs() < 4.0 * error, "{a} {b}: {there:?} {back:?}");
        assert!(error < 0.005 * there.value);
    }
}

/// Radiance over all directions out of a slab is what its sky sends in, less what is absorbed:
/// with ϖ = 1 nothing is.
#[test]
fn energy_is_conserved() {
    for g in [0.0, 0.85] {
        let scene = lit(Slab::new(2.0, 1.0, g), sky());
        // Irradiance on either face, by directions of density cos θ/π.
        let out = |from_above: bool| {
            Mean::of(200_000, |i| {
                let cosine = ((i as f64 + 0.5) / 200_000.0).sqrt();
                let ray = toward(2.0, from_above, cosine);
                let mut stream = nimbus::reference::transport::Stream::new(7, i as u32);
                let light = scene.trace(ray, &mut stream);
                // What passes straight through is not in the radiance.
                let straight = if from_above { 0.0 } else { 1.0 - light.alpha };
                light.radiance().y + straight
            })
        };
        let (up, down) = (out(true), out(false));
        let error = up.error.hypot(down.error);
        let all = up.value + down.value;
        println!("g {g}: {all} ± {error}");
        assert!((all - 1.0).abs() < 4.0 * error && error < 0.003, "{g}: {all} ± {error}");
    }
}
