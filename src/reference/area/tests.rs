//! Values worked by hand and published ones, and agreement with paths that share no quadrature.

use super::paths::PathSampling;
use super::*;
use std::f64::consts::PI;

use glam::DVec3;
use mean::Window;

use crate::model::cloud::Shape;
use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::surface::Surface;
use crate::reference::Blob;

mod estimates;
mod mean;

const UP: DVec3 = DVec3::Y;
const FINE: Accuracy = Accuracy::relative(1e-9);

fn rect(center: DVec3, u: DVec3, v: DVec3) -> Surface {
    Surface { center, u, v, i_material: 0, subdivide: [2, 3] }
}

fn at(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A unit square at height `y` that faces down. A sky lights it by the constant share alone.
fn ceiling(y: f64) -> Surface {
    rect(at(0.0, y, 0.0), 0.5 * DVec3::X, 0.5 * DVec3::Z)
}

fn matte(kd: f64) -> Brdf {
    Brdf { kd: DVec3::splat(kd), ks: DVec3::ZERO, ns: 1.0 }
}

fn glossy(kd: f64, ks: f64, ns: f64) -> Brdf {
    Brdf { kd: DVec3::splat(kd), ks: DVec3::splat(ks), ns }
}

/// A white surface that no other light reaches has L1 = 1 under this sky.
const GLOW: Light = Light::even_sky(DVec3::splat(PI), 1.0);

fn close(e: &Estimate, irradiance: f64, relative: f64) {
    let off = (e.irradiance.x - irradiance).abs();
    // The expected value is accurate beyond the tolerance; 1e-13 covers the sums' roundings.
    assert!(off <= e.irradiance_error + 1e-13 * irradiance, "{e:?} is not {irradiance}");
    assert!(e.irradiance_error <= relative * irradiance, "{e:?}");
}

#[test]
fn form_factors_from_an_element() {
    // To a unit square at unit distance, opposite its centre: 4/π · A/√(1+A²) atan(A/√(1+A²)), A =
    // ½ (Howell, B-3).
    let (f, error) = form_factor(&ceiling(1.0), DVec3::ZERO, UP, &FINE);
    assert!((f - 0.239_456).abs() < 5e-7 && error < 1e-9);
    let h = 0.2f64.sqrt();
    assert!((f - 4.0 / PI * h * h.atan()).abs() <= error, "{f} {error}");
    // To a unit square standing across the element's plane, half a unit away, opposite the middle
    // of its lower edge: twice Howell's B-4 with X = 2, Y = 1. These are the floor's centre and a
    // wall of a unit cube.
    let wall = rect(at(-0.5, 0.5, 0.0), 0.5 * DVec3::Y, 0.5 * DVec3::Z);
    let (w, error) = form_factor(&wall, DVec3::ZERO, UP, &FINE);
    assert!((w - 0.190_136).abs() < 5e-7 && (w - (PI / 4.0 - h * h.atan()) / PI).abs() <= error);
    assert!((f + 4.0 * w - 1.0).abs() < 2e-9);
    // From behind, and behind it.
    assert_eq!(form_factor(&ceiling(1.0), DVec3::ZERO, -UP, &FINE).0, 0.0);
    assert_eq!(form_factor(&ceiling(-1.0), DVec3::ZERO, -UP, &FINE).0, 0.0);
}

#[test]
fn a_receiver_that_touches_an_emitter_converges() {
    // B-4 as the element nears the wall's foot: F = ½ − Y/2 …, by its closed form with X = 2, Y =
    // 2c.
    let wall = rect(at(0.0, 0.5, 0.0), 0.5 * DVec3::Y, 0.5 * DVec3::Z);
    for c in [1e-2f64, 1e-4, 1e-5] {
        let (y, r) = (2.0 * c, (4.0 + 4.0 * c * c).sqrt());
        let truth = ((1.0 / y).atan() - y / r * (1.0 / r).atan()) / PI;
        let (f, error) = form_factor(&wall, at(c, 0.0, 0.0), UP, &Accuracy::relative(1e-7));
        assert!(
            (f - truth).abs() <= error + 1e-15 && error <= 1e-7 * f,
            "{c}: {f} {truth} {error}"
        );
    }
    // In the wall's plane nothing of the wall is seen.
    assert_eq!(form_factor(&wall, DVec3::ZERO, UP, &FINE).0, 0.0);
    // Parallel plates that almost touch see only each other.
    let (f, error) = form_factor(&ceiling(1e-5), at(0.1, 0.0, 0.2), UP, &Accuracy::relative(1e-7));
    assert!((f - 1.0).abs() < 1e-8 + error && error < 1e-7);
}

#[test]
fn form_factors_between_squares() {
    let accuracy = Accuracy::relative(1e-6);
    // Howell's C-11, directly opposed at unit distance, and C-14, across an edge that both share: 7
    // digits.
    let floor = rect(DVec3::ZERO, 0.5 * DVec3::Z, 0.5 * DVec3::X);
    let wall = rect(at(-0.5, 0.5, 0.0), 0.5 * DVec3::Y, 0.5 * DVec3::Z);
    assert_eq!((floor.normal(), wall.normal(), ceiling(1.0).normal()), (UP, DVec3::X, -UP));
    for (receiver, published) in [(floor, 0.199_824_9), (wall, 0.200_043_8)] {
        let s = AreaScene::new(
            &[receiver, ceiling(1.0)],
            &[matte(0.5), matte(1.0)],
            &[GLOW],
            &[],
            0.0,
            &[],
        );
        let e = s.mean_second(0, &Window::WHOLE, at(9.0, 9.0, 9.0), &accuracy);
        let f = e.irradiance.x / PI;
        assert!((f - published).abs() < 5.1e-8 + e.irradiance_error, "{f} {e:?}");
        assert!(
            e.irradiance_error <= 1.2e-6 * e.irradiance.x && (e.radiance.x - 0.5 * f).abs() < 1e-14
        );
    }
}

fn cube(albedo: Brdf) -> (Vec<Surface>, Vec<Brdf>) {
    let axes = [
        (DVec3::X, DVec3::Y, DVec3::Z),
        (DVec3::Y, DVec3::Z, DVec3::X),
        (DVec3::Z, DVec3::X, DVec3::Y),
    ];
    let faces = axes.iter().flat_map(|&(n, u, v)| [rect(-n, u, v), rect(n, v, u)]);
    (faces.collect(), vec![albedo; 6])
}

#[test]
fn a_furnace_reflects_powers_of_its_albedo() {
    let (faces, brdfs) = cube(matte(0.7));
    let sky = [Light::even_sky(DVec3::splat(PI), 1.0)];
    let s = AreaScene::new(&faces, &brdfs, &sky, &[], 0.0, &[]);
    for (i, face) in faces.iter().enumerate() {
        for (a, b) in [(0.0, 0.0), (0.31, -0.77), (0.999, 0.2), (-0.999_99, 0.999_99)] {
            let receiver = s.on_surface(i, face.center + a * face.u + b * face.v);
            let toward = (-receiver.position).normalize();
            assert!((s.first(&receiver, toward) - 0.7).length() < 1e-15);
            let e = s.second(&receiver, toward, &Accuracy::relative(1e-7));
            assert!((e.radiance.x - 0.49).abs() <= e.error && e.error <= 1e-7 * 0.49, "{e:?}");
            close(&e, PI * 0.7, 1e-7);
        }
    }
    // Paths drawn by the cosine carry the albedo exactly, without variance.
    let receiver = s.on_surface(2, faces[2].center + 0.3 * faces[2].u);
    let found = s.reflections(
        &receiver,
        receiver.normal,
        5,
        PathSampling { n_paths: 2000, seed: 1, i_sample: 0 },
    );
    for (k, l) in found[..5].iter().enumerate() {
        assert!((l.radiance.x - 0.7f64.powi(k as i32 + 1)).abs() < 1e-12, "{k} {l:?}");
    }
    assert!((found[5].radiance.x - (1..=5).map(|k| 0.7f64.powi(k)).sum::<f64>()).abs() < 1e-12);
}

#[test]
fn an_eye_behind_sees_the_diffuse_part_alone() {
    let (faces, mut brdfs) = cube(matte(0.7));
    brdfs[0] = glossy(0.5, 0.3, 2.0);
    let s = AreaScene::new(&faces, &brdfs, &[GLOW], &[], 0.0, &[]);
    let receiver = s.on_surface(0, faces[0].center + 0.3 * faces[0].u);
    for depth in [0.03, 0.3, 1.0] {
        let toward =
            (receiver.normal.any_orthonormal_vector() - depth * receiver.normal).normalize();
        let e = s.second(&receiver, toward, &Accuracy::relative(1e-7));
        assert!((e.radiance.x - 0.35).abs() <= e.error && e.error <= 1e-7 * 0.35, "{e:?}");
        // All directions are drawn by the cosine, so that only the rounding of 2000 sums is left.
        let found = s.reflections(
            &receiver,
            toward,
            2,
            PathSampling { n_paths: 2000, seed: 1, i_sample: 0 },
        );
        for (l, truth) in found.iter().zip([0.5, 0.35, 0.85]) {
            assert!((l.radiance.x - truth).abs() < 1e-12, "{depth} {l:?}");
        }
    }
}

#[test]
fn blockers_and_blobs_attenuate() {
    let lamp = ceiling(2.0);
    let receiver = Receiver::new(DVec3::ZERO, UP, matte(0.5));
    let second = |surfaces: &[Surface], blobs: &[Blob]| {
        let brdfs = vec![matte(1.0); surfaces.len()];
        AreaScene::new(surfaces, &brdfs, &[GLOW], blobs, 0.0, &[]).second(&receiver, UP, &FINE)
    };
    let free = second(&[lamp], &[]);
    // A black blocker with its edge through the axis, level and leaning.
    for lean in [0.0, 0.7] {
        let along = DVec3::X.rotate_z(lean);
        let blocker = rect(at(0.0, 1.0, 0.0) + 3.0 * along, 3.0 * along, 9.0 * DVec3::Z);
        let s = AreaScene::new(&[lamp, blocker], &[matte(1.0), matte(0.0)], &[GLOW], &[], 0.0, &[]);
        close(&s.second(&receiver, UP, &FINE), 0.5 * free.irradiance.x, 1e-9);
    }
    // A wide blob that every ray to a small lamp crosses near its centre: e^{−τ}, with τ nearly
    // constant.
    let small = rect(at(0.0, 200.0, 0.0), 0.1 * DVec3::X, 0.1 * DVec3::Z);
    let blob = Blob { shape: Shape::BALL, position: at(0.0, 100.0, 0.0), sigma: 5.0, kappa: 0.2 };
    let ratio = second(&[small], &[blob]).irradiance.x / second(&[small], &[]).irradiance.x;
    // b ≤ 0.07 at the blob: b²/2σ² < 1e-4.
    assert!((ratio / (-2.506_628_274_631f64).exp() - 1.0).abs() < 2.6e-4, "{ratio}");
}

#[test]
fn a_lobe_of_any_width_is_found() {
    // Eye along the normal, a lamp that fills the lobe: ∫ K_s (n+2)/2π cos^n γ cos 2γ · 4 cos γ
    // dω_h = 4 K_s (n+2) ∫ c^{n+1} (2c² − 1) dc = 4 K_s (2(n+2)/(n+4) − 1). Below cos 22.5° nothing
    // is left.
    let lamp = rect(UP, DVec3::X, DVec3::Z);
    let sun = [Light::Directional { direction: UP, irradiance: DVec3::ONE }];
    let nothing = matte(0.0);
    for ns in [1e3, 1e4, 1e6] {
        let albedo = 4.0 * 0.3 * (2.0 * (ns + 2.0) / (ns + 4.0) - 1.0);
        let mirror = Receiver::new(DVec3::ZERO, UP, glossy(0.0, 0.3, ns));
        let s = AreaScene::new(&[lamp], &[matte(1.0)], &[GLOW], &[], 0.0, &[]);
        let e = s.second(&mirror, UP, &Accuracy::relative(1e-8));
        assert!(
            (e.radiance.x - albedo).abs() <= e.error + 1e-12 && e.error <= 1e-8 * albedo,
            "{ns} {e:?}"
        );
        // The same lobe on the lamp's side: a sun from below, straight up, and a receiver that
        // looks at it.
        let s = AreaScene::new(&[lamp], &[glossy(0.0, 0.3, ns)], &sun, &[], 0.0, &[]);
        let e = s.second(&Receiver::new(DVec3::ZERO, UP, nothing), UP, &Accuracy::relative(1e-8));
        close(&e, albedo, 1e-8);
    }
}

#[test]
fn means_of_the_first_reflection_hold_the_lights_flux() {
    let floor = rect(DVec3::ZERO, DVec3::Z, DVec3::X);
    let check = |light: Light, truth: f64, relative: f64| {
        let lights = [light];
        let s = AreaScene::new(&[floor], &[matte(0.5)], &lights, &[], 0.0, &[]);
        let e = s.mean_first(0, &Window::WHOLE, at(0.0, 5.0, 0.0), &Accuracy::relative(relative));
        assert!((e.radiance.x * PI / (0.5 * e.irradiance.x) - 1.0).abs() < 1e-12);
        close(&e, truth / 4.0, relative);
    };
    // A square of half edge 1 seen from height h above its centre: solid angle 4 asin(1/(1 + h²)).
    for h in [1.0, 0.1, 1e-3] {
        let light = Light::Point { position: at(0.0, h, 0.0), intensity: DVec3::ONE, radius: 0.0 };
        check(light, 4.0 * (1.0 / (1.0 + h * h)).asin(), 1e-6);
    }
    // A cone's: 2π(1 − cos θ_i + (cos θ_i − cos θ_o)/3).
    for (inner, outer) in [(5.0f64, 7.0f64), (0.5, 3.0), (10.0, 10.5)] {
        let (cos_inner, cos_outer) = (inner.to_radians().cos(), outer.to_radians().cos());
        let position = at(0.3, 0.5, -0.6);
        let (direction, intensity) = (-UP, DVec3::ONE);
        let light =
            Light::Spot { position, direction, intensity, radius: 0.0, cos_inner, cos_outer };
        let truth = 2.0 * PI * (1.0 - cos_inner + (cos_inner - cos_outer) / 3.0);
        for relative in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
            check(light, truth, relative);
        }
    }
}
