//! Error estimates of the law, and agreement with paths in random scenes.

use super::*;
use crate::model::cloud::Shape;
use crate::model::parallel::parallel_map;
use crate::model::philox::{philox4x32_10, uniform};

/// Twelve random rectangles in a box of half edge 2, four of them glossy, and lights.
fn random_scene(seed: u32) -> (Vec<Surface>, Vec<Brdf>, Vec<Light>) {
    let mut n = 0;
    let mut next = || {
        n += 1;
        uniform(philox4x32_10([seed, 77], [n, 0, 0, 0])[0])
    };
    let (mut surfaces, mut brdfs) = (Vec::new(), Vec::new());
    for i in 0..12 {
        let mut v = || at(next(), next(), next()) * 2.0 - 1.0;
        let (center, u, w) = (2.0 * v(), v(), v());
        let u = u.normalize();
        let v = (w - w.dot(u) * u).normalize();
        surfaces.push(Surface {
            center,
            u: u * (0.3 + next()),
            v: v * (0.3 + next()),
            i_material: i,
            subdivide: [8, 8],
        });
        let kd = at(next(), next(), next()) * 0.6;
        let (ks, ns) = if i % 3 == 0 { (0.1, 10f64.powf(1.0 + 2.0 * next())) } else { (0.0, 1.0) };
        brdfs.push(Brdf { kd, ks: DVec3::splat(ks), ns });
    }
    let direction = at(0.3, -0.8, 0.5).normalize();
    let lights = vec![
        Light::Directional { direction, irradiance: at(3.0, 2.9, 2.7) },
        Light::Point { position: at(0.5, 2.5, -1.0), intensity: DVec3::splat(4.0), radius: 0.01 },
        Light::even_sky(at(0.3, 0.4, 0.6), 0.1),
    ];
    (surfaces, brdfs, lights)
}

#[test]
fn quadrature_and_paths_agree_in_random_scenes() {
    let blobs = [
        Blob { shape: Shape::BALL, position: at(0.2, 0.3, -0.4), sigma: 0.4, kappa: 1.5 },
        Blob { shape: Shape::BALL, position: at(-1.0, 0.0, 0.7), sigma: 0.25, kappa: 2.0 },
    ];
    let discs = [
        DiscFacet {
            position: at(0.1, 1.9, 0.2),
            normal: at(0.6, -0.8, 0.0),
            area: 0.4,
            kd: at(0.9, 0.8, 0.7),
        },
        DiscFacet {
            position: at(-1.4, 0.1, 0.9),
            normal: at(0.0, 0.0, -1.0),
            area: 0.2,
            kd: at(0.5, 0.8, 0.7),
        },
    ];
    let (mut n, mut chi2) = (0.0, 0.0);
    for seed in 0..3 {
        let (surfaces, brdfs, lights) = random_scene(seed);
        let s = AreaScene::new(&surfaces, &brdfs, &lights, &blobs, 0.2, &discs);
        let mut receivers: Vec<Receiver> =
            (0..12).map(|i| s.on_surface(i, surfaces[i].facet_center(19))).collect();
        receivers.extend((0..2).map(|i| s.on_disc(i)));
        for receiver in receivers {
            let toward =
                (receiver.normal + 0.4 * receiver.normal.any_orthonormal_vector()).normalize();
            let e = s.second(&receiver, toward, &Accuracy::relative(1e-4));
            let found = s.reflections(
                &receiver,
                toward,
                2,
                PathSampling { n_paths: 20_000, seed, i_sample: 0 },
            )[1];
            for c in 0..3 {
                // Light of radiance about 1 that fewer than one path in 20 000 meets does not show
                // in the sample's variance.
                let (off, sigma) = (
                    (e.radiance[c] - found.radiance[c]).abs(),
                    found.error[c].hypot(e.error) + 5e-5,
                );
                if e.radiance[c] > 0.0 {
                    // Of 126 normal numbers, one lies beyond 5 in 2e-5 such tests.
                    assert!(off < 5.0 * sigma, "{seed} {receiver:?} {e:?} {found:?}");
                    (n, chi2) = (n + 1.0, chi2 + (off / sigma).powi(2));
                }
            }
        }
    }
    // The channels of one receiver are nearly equal, so that the sum has a third of the degrees of
    // freedom: 5 √(2/(n/3)).
    let expected: f64 = 1.0;
    assert!(n > 60.0 && chi2 / n < expected + 5.0 * (6.0 / n).sqrt(), "{chi2} of {n}");
}

#[test]
fn the_error_bounds_the_distance_to_a_finer_integral() {
    let (surfaces, brdfs, lights) = random_scene(7);
    let s = AreaScene::new(&surfaces, &brdfs, &lights, &[], 0.0, &[]);
    let off_by = |i: usize| {
        let receiver = s.on_surface(i % 12, surfaces[i % 12].facet_center(i as u32));
        let toward = receiver.normal;
        let truth = s.second(&receiver, toward, &Accuracy::relative(1e-9));
        for relative in [1e-1, 1e-2, 1e-4, 1e-6] {
            let e = s.second(&receiver, toward, &Accuracy::relative(relative));
            let off = (e.radiance - truth.radiance).abs().max_element();
            let off_e = (e.irradiance - truth.irradiance).abs().max_element();
            assert!(
                off <= e.error + truth.error
                    && off_e <= e.irradiance_error + truth.irradiance_error,
                "{i} {e:?}"
            );
            assert!(e.error <= relative * e.radiance.max_element());
        }
        truth.irradiance.x
    };
    assert!(parallel_map(48, off_by).iter().filter(|&&e| e > 0.0).count() > 30);
}

#[test]
fn a_mean_is_the_mean_of_its_facets() {
    let (surfaces, brdfs, lights) = random_scene(3);
    let s = AreaScene::new(&surfaces, &brdfs, &lights, &[], 0.0, &[]);
    let (eye, accuracy) = (at(3.0, 4.0, 5.0), Accuracy::relative(1e-3));
    let surface = Surface { subdivide: [2, 2], ..surfaces[1] };
    let mean =
        |w: &Window| [s.mean_first(1, w, eye, &accuracy), s.mean_second(1, w, eye, &accuracy)];
    let facets = parallel_map(4, |i| mean(&Window::facet(&surface, i as u32)));
    for (k, whole) in mean(&Window::WHOLE).iter().enumerate() {
        let of_facets = facets.iter().map(|f| f[k].irradiance).sum::<DVec3>() / 4.0;
        let error = whole.irradiance_error
            + facets.iter().map(|f| f[k].irradiance_error).sum::<f64>() / 4.0;
        assert!(
            whole.irradiance.x > 0.0 && (whole.irradiance - of_facets).abs().max_element() <= error,
            "{k}"
        );
    }
}

#[test]
fn a_pair_of_discs_by_hand() {
    // Sun straight down with E = π on a white disc of area π facing up at the origin, and a
    // receiver one above it facing down: E = L A/(d² + A/π) = π/2.
    let disc = DiscFacet { position: DVec3::ZERO, normal: UP, area: PI, kd: DVec3::ONE };
    let sun = [Light::Directional { direction: at(0.0, -1.0, 0.0), irradiance: DVec3::splat(PI) }];
    let discs = [disc, DiscFacet { position: UP, normal: -UP, ..disc }];
    let s = AreaScene::new(&[], &[], &sun, &[], 0.0, &discs);
    let e = s.second(&s.on_disc(1), -UP, &FINE);
    assert!(
        (e.irradiance.x - PI / 2.0).abs() < 1e-15
            && (e.radiance.x - 0.5).abs() < 1e-15
            && e.error == 0.0
    );
    // A disc does not light itself.
    assert_eq!(s.second(&s.on_disc(0), UP, &FINE).irradiance, DVec3::ZERO);
    assert_eq!(s.irradiance(&s.on_disc(0)), DVec3::splat(PI));
}

#[test]
fn the_error_is_infinite_when_evaluations_run_out() {
    let s = AreaScene::new(&[ceiling(1e-5)], &[matte(1.0)], &[GLOW], &[], 0.0, &[]);
    let few = Accuracy { relative: 1e-6, absolute: 0.0, max_evaluations: 200 };
    let e = s.second(&Receiver::new(DVec3::ZERO, UP, matte(1.0)), UP, &few);
    assert!(e.error.is_infinite() && e.n_evaluations <= 220);
}

#[test]
fn the_error_of_a_mean_bounds_the_distance_to_a_finer_one() {
    let eye = at(3.0, 4.0, 5.0);
    let check = |s: &AreaScene, i: usize, window: &Window| {
        let truth = s.mean_second(i, window, eye, &Accuracy::relative(1e-3));
        for relative in [1e-1, 1e-2] {
            let e = s.mean_second(i, window, eye, &Accuracy::relative(relative));
            let off = (e.radiance - truth.radiance).abs().max_element();
            assert!(off <= e.error + truth.error, "{i} {window:?} {off} {e:?} {truth:?}");
            let off = (e.irradiance - truth.irradiance).abs().max_element();
            assert!(
                off <= e.irradiance_error + truth.irradiance_error,
                "{i} {window:?} {off} {e:?} {truth:?}"
            );
        }
    };
    let (surfaces, brdfs, lights) = random_scene(0);
    let s = AreaScene::new(&surfaces, &brdfs, &lights, &[], 0.0, &[]);
    parallel_map(6, |i| check(&s, i, &Window::facet(&surfaces[i], 5 + 3 * i as u32)));
    // A polished floor under a small lamp that faces it, and a small lamp just above it.
    let floor = rect(DVec3::ZERO, 2.0 * DVec3::Z, 2.0 * DVec3::X);
    let lamp = |x: f64, y: f64, half: f64| rect(at(x, y, 0.37), half * DVec3::X, half * DVec3::Z);
    let surfaces = [floor, lamp(0.5, 1.0, 0.01), lamp(-1.2, 0.02, 0.05)];
    for ns in [1.0, 1e3] {
        let s = AreaScene::new(
            &surfaces,
            &[glossy(0.1, 0.3, ns), matte(1.0), matte(1.0)],
            &[GLOW],
            &[],
            0.0,
            &[],
        );
        check(&s, 0, &Window::WHOLE);
    }
}
