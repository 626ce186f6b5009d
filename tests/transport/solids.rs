//! Surfaces and ground: what they hide, and what light does between them.

use std::f64::consts::PI;

use glam::DVec3;
use nimbus::model::light::Light;
use nimbus::model::material::Brdf;
use nimbus::model::phase::Phase;
use nimbus::model::sky::{Sky, SkySettings};
use nimbus::reference::transport::{Lights, Ray, Solids, TransportScene};

use crate::{Vacuum, radiance, ray};
use nimbus::model::cloud::Shape;

fn diffuse(kd: f64) -> Brdf {
    Brdf { kd: DVec3::splat(kd), ks: DVec3::ZERO, ns: 1.0 }
}

/// A closed room of six walls that face inward.
fn room(kd: f64) -> Solids {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let wall = |corner: DVec3, u: DVec3, v: DVec3| ([corner, 2.0 * u, 2.0 * v], 0);
    let one = DVec3::ONE;
    let walls = [
        wall(-one, z, x),
        wall(-one, x, y),
        wall(-one, y, z),
        wall(one, -x, -z),
        wall(one, -y, -x),
        wall(one, -z, -y),
    ];
    Solids::new(&walls, &[], vec![diffuse(kd)])
}

/// In a closed room of one albedo ρ the n-th reflection brings ρ times the light of the one before,
/// in the mean over the walls. The light of a lamp in its middle is I/(4 area) a wall point in the
/// mean; the room's radiance is E ρ/(π (1 − ρ)) with E = 4π I/area.
#[test]
fn a_closed_room_has_the_light_of_all_reflections() {
    let rho = 0.5;
    let lamp = Light::Point { position: DVec3::ZERO, intensity: DVec3::ONE, radius: 0.01 };
    let scene =
        TransportScene { medium: Vacuum, solids: room(rho), lights: Lights::new(&[lamp], 0.005) };
    // The mean over the area of the walls: by points spread over one wall, all of which are alike.
    let side = 40;
    let mut sum = 0.0;
    for k in 0..side * side {
        let at = |i: i32| (f64::from(i) + 0.5) / f64::from(side) * 2.0 - 1.0;
        let target = DVec3::new(at(k % side), at(k / side), -1.0);
        let eye = Ray { origin: target + 0.5 * DVec3::Z, direction: DVec3::NEG_Z };
        sum += radiance(&scene, eye, 300).value;
    }
    let mean = sum / f64::from(side * side);
    let truth = 4.0 * PI / 24.0 * rho / (PI * (1.0 - rho));
    println!("room: {mean} of {truth}");
    assert!((mean / truth - 1.0).abs() < 4e-3, "{mean} {truth}");
}

/// A wall hides sun and sky behind it, whichever side it shows, and triangles hide as rectangles
/// do.
#[test]
fn what_is_hidden_gets_no_light() {
    let floor = [DVec3::new(-1.0, 0.0, -1.0), 2.0 * DVec3::Z, 2.0 * DVec3::X];
    let lid = [DVec3::new(-9.0, 1.0, -9.0), 18.0 * DVec3::X, 18.0 * DVec3::Z];
    let half = [[lid[0], lid[1], lid[2]], [lid[0] + lid[1] + lid[2], -lid[1], -lid[2]]];
    let sun = Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ONE };
    let eye = ray(DVec3::new(0.3, 0.5, 0.2), DVec3::ZERO);
    let of = |solids: Solids| {
        let scene = TransportScene { medium: Vacuum, solids, lights: Lights::new(&[sun], 0.005) };
        radiance(&scene, eye, 100).value
    };
    // The floor is white and the lid black.
    let white = vec![diffuse(0.5), diffuse(0.0)];
    assert!(of(Solids::new(&[(floor, 0)], &[], white.clone())) > 0.1);
    assert_eq!(of(Solids::new(&[(floor, 0), (lid, 1)], &[], white.clone())), 0.0);
    let triangles = half.map(|t| (t, 1));
    assert_eq!(of(Solids::new(&[(floor, 0)], &triangles, white.clone())), 0.0);
    // One of the halves lets the sun through.
    let light = of(Solids::new(&[(floor, 0)], &triangles[..1], white.clone()))
        + of(Solids::new(&[(floor, 0)], &triangles[1..], white));
    assert!((light - 0.5 / PI).abs() < 1e-4, "{light}");
}

/// A glossy floor under a sun: its own value, whichever way the light is found.
#[test]
fn a_lobe_reflects_a_sun_as_its_material_says() {
    let brdf = Brdf { kd: DVec3::splat(0.2), ks: DVec3::splat(0.1), ns: 200.0 };
    let floor = [DVec3::new(-4.0, 0.0, -4.0), DVec3::Z * 8.0, DVec3::X * 8.0];
    let toward_sun = DVec3::new(-0.5, 1.0, 0.0).normalize();
    let sun = Light::Directional { direction: -toward_sun, irradiance: DVec3::ONE };
    for off in [0.0, 0.05] {
        let scene = TransportScene {
            medium: Vacuum,
            solids: Solids::new(&[(floor, 0)], &[], vec![brdf]),
            lights: Lights::new(&[sun], 1e-4),
        };
        let eye = ray(DVec3::new(0.5 + off, 1.0, 0.0), DVec3::ZERO);
        let toward_eye = -eye.direction;
        let half = (toward_eye + toward_sun).normalize();
        let w = 0.5 * (half - DVec3::Y).length_squared();
        let f = 0.2 / PI + 0.1 * Brdf::lobe(200.0, w);
        radiance(&scene, eye, 40_000).assert_is("lobe", f * toward_sun.y, 1e-3);
    }
}

/// A lamp and a spot in a cloud, and surfaces under it: light goes both ways. Eye and lamp cannot
/// change places, but a cloud in a closed white room brings nothing and takes nothing: the light of
/// a lamp is that of the room's walls and of what the cloud scatters, and all of it ends on the
/// walls.
#[test]
fn a_cloud_in_a_room_takes_nothing_away() {
    let rho = 0.5;
    let lamp = Light::Point { position: DVec3::Y * 0.8, intensity: DVec3::ONE, radius: 0.01 };
    let of = |kappa: f64| {
        let blob = nimbus::reference::Blob {
            position: DVec3::ZERO,
            sigma: 0.15,
            shape: Shape::BALL,
            kappa,
        };
        let scatterer = nimbus::reference::transport::Scatterer {
            albedo: DVec3::ONE,
            phase: Phase::HenyeyGreenstein { g: 0.5 },
        };
        let medium = nimbus::reference::transport::BlobMedium::new(&[blob], &[0], vec![scatterer]);
        TransportScene { medium, solids: room(rho), lights: Lights::new(&[lamp], 0.005) }
    };
    // Irradiance over all walls, from radiance along directions of density cos/π at even points.
    let flux = |kappa: f64| {
        let scene = of(kappa);
        crate::Mean::of(400_000, |i| {
            let mut stream = nimbus::reference::transport::Stream::new(11, i as u32);
            let mut u = || stream.uniform();
            let (axis, sign) = ((u() * 3.0) as usize, if u() < 0.5 { 1.0 } else { -1.0 });
            let (a, b) = (2.0 * u() - 1.0, 2.0 * u() - 1.0);
            let place = |k: usize| match (k + 3 - axis) % 3 {
                0 => sign,
                1 => a,
                _ => b,
            };
            let target = DVec3::new(place(0), place(1), place(2));
            let mut normal = DVec3::ZERO;
            normal[axis] = -sign;
            // The radiance that a wall sends is ρ/π of what it receives.
            let eye = Ray { origin: target + 1e-6 * normal, direction: -normal };
            scene.trace(eye, &mut stream).radiance().y * PI / rho
        })
    };
    let (bare, cloudy) = (flux(0.0), flux(3.0));
    let error = bare.error.hypot(cloudy.error);
    println!("bare {bare:?}, cloudy {cloudy:?}");
    let truth = 4.0 * PI / 24.0 / (1.0 - rho);
    assert!(bare.off(truth).abs() < 4.0 && cloudy.off(truth).abs() < 4.0, "{truth}");
    assert!(error < 0.01 * truth);
}

/// A floor and walls under a clear sky: the irradiance is that of the dome, by quadrature, and not
/// that of an even sky.
#[test]
fn a_clear_sky_lights_walls_as_its_dome() {
    let toward_sun = DVec3::new(0.8, 0.3, -0.5).normalize();
    let sky = Sky::new(SkySettings::of_turbidity(4.0), toward_sun).expect("a sky");
    let irradiance = sky.of_sky();
    let light = Light::Sky { irradiance, constant: 0.0, tilt: sky.tilt() };
    let quadrature = |n: DVec3| {
        let (n_up, n_around) = (300, 300);
        let mut sum = 0.0;
        for k in 0..n_up * n_around {
            let up = (f64::from(k / n_around) + 0.5) / f64::from(n_up);
            let (sin, cos) =
                ((f64::from(k % n_around) + 0.5) * 2.0 * PI / f64::from(n_around)).sin_cos();
            let across = (1.0 - up * up).sqrt();
            let w = DVec3::new(across * cos, up, across * sin);
            sum += sky.radiance(w).y * w.dot(n).max(0.0);
        }
        sum * 2.0 * PI / f64::from(n_up * n_around)
    };
    let level = quadrature(DVec3::Y);
    assert!((level / irradiance.y - 1.0).abs() < 2e-3, "{level} {irradiance}");
    for n in [DVec3::Y, DVec3::X, DVec3::NEG_X] {
        let u = if n == DVec3::Y { DVec3::Z } else { DVec3::Y };
        let v = n.cross(u);
        let wall = [-u - v, 2.0 * u, 2.0 * v];
        let scene = TransportScene {
            medium: Vacuum,
            solids: Solids::new(&[(wall, 0)], &[], vec![diffuse(0.5)]),
            lights: Lights::new(&[light], 0.005).under(Some(sky)),
        };
        let found = radiance(&scene, ray(n + 0.2 * v, DVec3::ZERO), 60_000);
        found.assert_is("clear sky", 0.5 * quadrature(n) / PI, 1e-2);
    }
    // An even sky would give walls half of what the floor has.
    assert!(quadrature(DVec3::X) > 1.2 * level && quadrature(DVec3::NEG_X) < 0.8 * level);
}
