//! Estimators that err are found: each test of what is known fails for the estimators that it is
//! there for.

use glam::DVec3;
use nimbus::model::light::Light;
use nimbus::model::phase::Phase;
use nimbus::reference::transport::{
    BlobMedium, Collision, Estimator, Lights, Medium, Ray, Scatterer, Solids, Stream,
    TransportScene, Unbiased,
};

use crate::adding::Operators;
use crate::known::{crowd, floor, medium};
use crate::slab::{Slab, toward};
use crate::{paths, ray};

/// The checks that wrong estimators face, in standard errors off the truth.
fn checks<E: Estimator>() -> Vec<f64> {
    let n = 60_000;
    let isotropic = Phase::HenyeyGreenstein { g: 0.0 };
    let forward = Phase::HenyeyGreenstein { g: 0.85 };
    let eye = ray(DVec3::new(3.0, 1.0, 4.0), DVec3::new(0.1, 0.0, 0.0));
    let mut found = Vec::new();
    // Furnaces: in the air, and over a white floor.
    for (solids, phase) in [(Solids::default(), isotropic), (floor(1.0), forward)] {
        let medium = medium(1.0, phase);
        let scene = TransportScene { medium, solids, lights: Lights::uniform(DVec3::ONE) };
        let mean = paths::<_, E>(&scene, eye, n, |l| l.radiance().y + 1.0 - l.alpha);
        found.push(mean.off(1.0));
    }
    // A slab in a sky, and a sun's light on a floor under it.
    let albedo = 0.8;
    let truth = Operators::of_slab(2.0, albedo, 0.85, 32);
    let irradiance = DVec3::splat(std::f64::consts::PI);
    let sky = Lights::new(&[Light::even_sky(irradiance, 0.0)], 0.005);
    let slab = TransportScene {
        medium: Slab::new(2.0, albedo, 0.85),
        solids: Solids::default(),
        lights: sky,
    };
    let mean = paths::<_, E>(&slab, toward(2.0, true, truth.nodes[16]), n, |l| l.radiance().y);
    found.push(mean.off(truth.albedo(16)));
    // A wide sun, which both ways of drawing a direction meet, in a slab that scatters forward.
    let sun = Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ONE };
    let zenith = TransportScene { lights: Lights::new(&[sun], 0.02), ..slab };
    let i = 20;
    let mean = paths::<_, E>(&zenith, toward(2.0, true, truth.nodes[i]), 4 * n, |l| l.radiance().y);
    found.push(mean.off(truth.of_zenith(i)));
    // A floor in the shade of a lid.
    let lid = [DVec3::new(-9.0, 1.0, -9.0), 18.0 * DVec3::X, 18.0 * DVec3::Z];
    let ground = [DVec3::new(-4.0, -1.2, -4.0), DVec3::Z * 8.0, DVec3::X * 8.0];
    let brdf = nimbus::model::material::Brdf { kd: DVec3::splat(0.5), ks: DVec3::ZERO, ns: 1.0 };
    let solids = Solids::new(&[(lid, 0), (ground, 0)], &[], vec![brdf]);
    let shade = TransportScene { medium: crate::Vacuum, solids, lights: Lights::new(&[sun], 0.02) };
    let below = ray(DVec3::new(0.0, 0.0, 0.5), DVec3::new(0.0, -1.2, 0.0));
    let light = paths::<_, E>(&shade, below, 2000, |l| l.radiance().y).value;
    found.push(if light == 0.0 { 0.0 } else { f64::INFINITY });
    found
}

/// Asserts that some check finds the estimator wrong.
fn assert_found<E: Estimator>(what: &str) {
    let off = checks::<E>();
    println!("{what}: {off:.1?}");
    assert!(off.iter().any(|off| off.abs() > 6.0), "{what} is not found: {off:.1?}");
}

#[test]
fn the_right_estimator_passes() {
    let off = checks::<Unbiased>();
    println!("{off:.1?}");
    assert!(off.iter().all(|off| off.abs() < 4.0), "{off:.1?}");
}

macro_rules! wrong {
    ($name:ident, $what:literal, { $($law:tt)* }) => {
        struct $name;
        impl Estimator for $name { $($law)* }
        assert_found::<$name>($what);
    };
}

#[test]
fn wrong_estimators_are_found() {
    wrong!(Unnormalised, "a phase function that is not normalised", {
        fn phase(of: impl Fn(f64) -> f64, cosine: f64) -> f64 {
            1.05 * of(cosine)
        }
    });
    wrong!(Backward, "light that is turned the other way", {
        fn phase(of: impl Fn(f64) -> f64, cosine: f64) -> f64 {
            of(-cosine)
        }
    });
    wrong!(Twice, "light that both ways count fully", {
        fn mis_weight(_: f64, _: f64) -> f64 {
            1.0
        }
    });
    wrong!(Roulette, "roulette without a weight", {
        fn roulette_weight(_: f64) -> f64 {
            1.0
        }
    });
    wrong!(Clear, "light that the medium does not weaken", {
        fn transmittance(_: f64) -> f64 {
            1.0
        }
    });
    wrong!(Deep, "light that the medium weakens too much", {
        fn transmittance(depth: f64) -> f64 {
            (-1.1 * depth).exp()
        }
    });
    wrong!(White, "a medium that absorbs nothing", {
        fn scattered(weight: DVec3, _: DVec3) -> DVec3 {
            weight
        }
    });
    wrong!(Flat, "a surface that receives light as if it faced it", {
        fn received(light: DVec3, _: f64) -> DVec3 {
            light
        }
    });
    wrong!(Through, "surfaces that hide nothing", {
        fn arrives(_: bool) -> bool {
            true
        }
    });
    wrong!(Undivided, "light that is not divided by its density", {
        fn drawn(light: DVec3, _: f64) -> DVec3 {
            light
        }
    });
    wrong!(Thin, "an opacity that is the depth", {
        fn opacity(depth: f64) -> f64 {
            depth
        }
    });
}

/// A medium whose flights err.
struct Faulty {
    inner: Slab,
    flight: fn(&mut Stream) -> f64,
}

impl Medium for Faulty {
    fn depth(&self, ray: &Ray, end: f64) -> f64 {
        self.inner.depth(ray, end)
    }

    fn collide(&self, ray: &Ray, end: f64, stream: &mut Stream) -> Option<Collision> {
        let whole = self.inner.depth(ray, end);
        let wanted = (self.flight)(stream);
        // The slab's extinction is 1: it begins where the depth does.
        let begin = if self.inner.depth(ray, 1e-9) > 0.0 { 0.0 } else { 1.0 / -ray.direction.y };
        (wanted < whole).then_some(Collision {
            distance: begin.max(0.0) + wanted,
            scatterer: self.inner.scatterer,
        })
    }
}

/// Flights that are too long, or that know of no other than the first uniform number, are found by
/// a slab.
#[test]
fn wrong_flights_are_found() {
    let truth = Operators::of_slab(2.0, 0.8, 0.0, 32);
    let irradiance = DVec3::splat(std::f64::consts::PI);
    let of = |flight: fn(&mut Stream) -> f64| {
        let scene = TransportScene {
            medium: Faulty { inner: Slab::new(2.0, 0.8, 0.0), flight },
            solids: Solids::default(),
            lights: Lights::new(&[Light::even_sky(irradiance, 0.0)], 0.005),
        };
        let eye = toward(2.0, true, truth.nodes[16]);
        paths::<_, Unbiased>(&scene, eye, 60_000, |l| l.radiance().y).off(truth.albedo(16))
    };
    let right = of(Stream::exponential);
    assert!(right.abs() < 4.0, "{right}");
    let wrong: [fn(&mut Stream) -> f64; 3] = [
        |stream| 1.05 * stream.exponential(),
        |stream| 2.0 * stream.uniform(),
        |stream| stream.exponential().min(stream.exponential()),
    ];
    for (k, flight) in wrong.into_iter().enumerate() {
        let off = of(flight);
        println!("flight {k}: {off:.1}");
        assert!(off.abs() > 6.0, "{k}: {off}");
    }
}

/// A blob whose light another one's material scatters is found where blobs differ.
#[test]
fn materials_belong_to_their_blobs() {
    let of = |albedo: f64| Scatterer {
        albedo: DVec3::splat(albedo),
        phase: Phase::HenyeyGreenstein { g: 0.0 },
    };
    let eye = ray(DVec3::new(3.0, 1.0, 4.0), DVec3::new(0.1, 0.0, 0.0));
    let light = |i_scatterer: &[u32]| {
        let medium = BlobMedium::new(&crowd(), i_scatterer, vec![of(1.0), of(0.0)]);
        let lights = Lights::uniform(DVec3::ONE);
        let scene = TransportScene { medium, solids: Solids::default(), lights };
        paths::<_, Unbiased>(&scene, eye, 100_000, |l| l.radiance().y)
    };
    // Of black blobs alone nothing comes, and the black ones take their share of the light.
    assert_eq!(light(&[1; 5]).value, 0.0);
    let [white, some] = [light(&[0; 5]), light(&[0, 1, 0, 1, 0])];
    let other = light(&[1, 0, 1, 0, 1]);
    for (a, b) in [(white, some), (some, other), (white, other)] {
        assert!((a.value - b.value).abs() > 6.0 * a.error.hypot(b.error), "{a:?} {b:?}");
    }
}
