//! Laws of the model and of the statistics over their whole domains.

use glam::DVec3;
use nimbus::measure::bootstrap::Bootstrap;
use nimbus::measure::lows::Lows;
use nimbus::measure::stats::{Summary, median};
use nimbus::model::basis::{Basis, Sampling};
use nimbus::model::camera::{Camera, CameraKey};
use nimbus::model::count::{Count, DrawnCount};
use nimbus::model::film::{Film, FilmFormat, ToneMap, srgb_encode};
use nimbus::model::grid::{GridSpec, MARGIN_CELLS, MAX_CELLS};
use nimbus::model::growth::{Growth, MAX_SCALE, MIN_SCALE};
use nimbus::reference::picture::Pixels;
use proptest::collection::vec;
use proptest::prelude::*;

use super::check;

/// A number whose logarithm is uniformly distributed.
fn magnitude(low: i32, high: i32) -> impl Strategy<Value = f64> {
    (f64::from(low)..=f64::from(high)).prop_map(|e| 10f64.powf(e))
}

fn count() -> impl Strategy<Value = Count> {
    let of = |(a, d0, normalised, conserve)| Count { a, d0, normalised, conserve };
    (magnitude(-15, 15), magnitude(-15, 15), any::<bool>(), any::<bool>()).prop_map(of)
}

#[test]
fn shares_fall_with_distance_and_weights_sum_to_the_count() {
    let distance = || prop_oneof![magnitude(-15, 15), Just(0.0), 0.0..1000.0];
    check(
        2000,
        (count(), magnitude(-3, 3), distance(), distance(), any::<u32>()),
        |(count, scale, a, b, n)| {
            let (near, far) = (count.share(scale, a.min(b)), count.share(scale, a.max(b)));
            prop_assert!(
                (0.0..=1.0).contains(&near) && (0.0..=1.0).contains(&far) && far <= near,
                "{near} {far}"
            );
            for share in [near, far] {
                let drawn = count.drawn(n, share);
                if drawn == DrawnCount::NOTHING {
                    continue;
                }
                prop_assert!(
                    (1..=n).contains(&drawn.n)
                        && drawn.last_weight > 0.0
                        && drawn.last_weight <= 1.0,
                    "{drawn:?}"
                );
                // x = n·share is rounded once, and x − (n − 1) is exact or rounded once more: two
                // units of x.
                let (x, sum) = (f64::from(n) * share, f64::from(drawn.n - 1) + drawn.last_weight);
                prop_assert!((sum - x).abs() <= 2.0 * f64::EPSILON * x, "{sum} for {x}");
                // The drawn particles represent all particles, unless none is drawn.
                let stands_for = sum * drawn.kappa_scale;
                let expected = if !count.conserve { x } else { f64::from(n) * x.min(1.0) };
                prop_assert!(
                    (stands_for / expected - 1.0).abs() < 8.0 * f64::EPSILON,
                    "{stands_for} for {expected}"
                );
            }
            Ok(())
        },
    );
}

#[test]
fn growth_is_monotonic_between_its_ends() {
    let times = || prop_oneof![magnitude(-15, 15), -1e15..1e15, Just(0.0)];
    let to = magnitude(-3, 3).prop_map(|to| to.clamp(MIN_SCALE, MAX_SCALE));
    check(2000, (to, magnitude(-15, 15), times(), times()), |(to, time_s, a, b)| {
        let growth = Growth { to, time_s };
        let (early, late) = (growth.at(a.min(b)), growth.at(a.max(b)));
        let (least, most) = (to.min(1.0), to.max(1.0));
        // 1 + (to − 1) is rounded: one unit of the larger end.
        let slack = f64::EPSILON * most;
        for s in [early, late] {
            prop_assert!(s >= least - slack && s <= most + slack, "{s}");
        }
        prop_assert!(if to > 1.0 { early <= late } else { early >= late }, "{early} {late}");
        Ok(())
    });
}

fn place() -> impl Strategy<Value = DVec3> {
    let coordinate = || {
        prop_oneof![
            Just(0.0),
            -10.0..10.0,
            (magnitude(-15, 15), any::<bool>()).prop_map(|(v, s)| if s { v } else { -v })
        ]
    };
    [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array)
}

#[test]
fn poses_are_orthonormal_or_refused() {
    let key = (0.001..10.0, place(), place());
    check(2000, (vec(key, 1..5), place(), -1.0..40.0), |(steps, up, time_s)| {
        let mut last_s = 0.0;
        let of = |(step_s, position, target): &(f64, DVec3, DVec3)| {
            last_s += step_s;
            CameraKey { time_s: last_s, position: *position, target: *target }
        };
        let keys: Vec<CameraKey> = steps.iter().map(of).collect();
        let camera = Camera { keys, up, fov_y_rad: 0.8, near: 0.01 };
        let Some(pose) = camera.pose(time_s) else { return Ok(()) };
        let up = up.try_normalize().ok_or_else(|| TestCaseError::fail("a pose without an up"))?;
        // The cross product rounds products of 1, and is divided by the sine.
        let sine = pose.forward.cross(up).length();
        let bound = 8.0 * f64::EPSILON / sine;
        for (a, b) in [(pose.right, pose.up), (pose.up, pose.forward), (pose.forward, pose.right)] {
            prop_assert!(a.dot(b).abs() <= bound && (a.length() - 1.0).abs() <= bound, "{pose:?}");
        }
        // The up vector points up: right × forward has a component along up.
        prop_assert!(
            pose.up.dot(up) >= -bound && pose.right.cross(pose.up).dot(-pose.forward) > 0.9
        );
        Ok(())
    });
}

#[test]
fn grid_contains_its_bounds_with_the_margin() {
    let half = || prop_oneof![Just(0.0), magnitude(-15, 15), 0.0..10.0];
    check(2000, ([half(), half(), half()], 1..=2 * MAX_CELLS), |(half, n)| {
        let half = DVec3::from_array(half);
        let grid = GridSpec::fit(-half, half, n, 1.0);
        let n = n.clamp(2 * MARGIN_CELLS + 1, MAX_CELLS);
        prop_assert!(
            grid.n_cells.max_element() <= n && grid.n_cells.min_element() > 2 * MARGIN_CELLS
        );
        prop_assert!(half == DVec3::ZERO || grid.n_cells.max_element() == n);
        // A cell in 10⁹ is left out if that saves a layer; and the ends are rounded.
        let margin = f64::from(MARGIN_CELLS) * grid.cell * (1.0 - 1e-6)
            - 8.0 * f64::EPSILON * half.max_element();
        let below = (-half - grid.low).min_element();
        let above = (grid.high() - half).min_element();
        prop_assert!(below >= margin && above >= margin, "{below} {above} of {margin}");
        Ok(())
    });
}

#[test]
fn more_bases_never_increase_the_error() {
    let sampling = prop_oneof![Just(Sampling::Log), Just(Sampling::Uniform)];
    let ends = (0.0..4.0, 0.0..5.0, any::<bool>());
    check(12, (ends, sampling, 0.0..=1.0), |((low, wide, from_zero), sampling, at)| {
        let low = if from_zero { 0.0 } else { 10f64.powf(low) };
        let range = [low, (low + 10f64.powf(wide)).min(1e6)];
        let ns = range[0] + at * (range[1] - range[0]);
        let mut last = f64::INFINITY;
        for n in [1, 2, 3, 5, 8, 13, 21, 32] {
            let error = Basis::new(range, n, sampling).error(ns);
            // A projection is not longer than the projected vector; sums of 1025 rounded products.
            prop_assert!(
                (0.0..=1.0 + 1e-12).contains(&error) && error <= last + 1e-12,
                "{n}: {error} after {last}"
            );
            last = error;
        }
        Ok(())
    });
}

#[test]
fn display_values_are_in_range_and_monotonic() {
    check(2000, (any::<f64>(), any::<f64>()), |(a, b)| {
        let (dark, bright) = (srgb_encode(a.min(b)), srgb_encode(a.max(b)));
        prop_assert!(
            (0.0..=1.0).contains(&dark) && (0.0..=1.0).contains(&bright) && dark <= bright,
            "{dark} {bright}"
        );
        Ok(())
    });
    // Also between neighbours: the curve changes its formula at its foot.
    check(2000, prop_oneof![0.0..0.01, 0.0..=1.0], |v: f64| {
        prop_assert!(srgb_encode(v) <= srgb_encode(v.next_up()));
        Ok(())
    });
    let film = (any::<[f64; 3]>(), any::<f64>(), place(), magnitude(-15, 15), any::<bool>());
    check(2000, film, |(rgb, alpha, background, exposure, is_neutral)| {
        let tone_map = if is_neutral { ToneMap::Neutral } else { ToneMap::Clip };
        let background = background.abs();
        let film = Film {
            width: 1,
            height: 1,
            format: FilmFormat::Rgba32f,
            background,
            exposure,
            tone_map,
        };
        let shown = film.display(DVec3::from_array(rgb), alpha);
        prop_assert!(shown.to_array().iter().all(|v| (0.0..=1.0).contains(v)), "{shown}");
        Ok(())
    });
}

#[test]
fn pixels_are_distinct_and_within_the_picture() {
    check(300, (1..200u32, 1..200u32, 0..50_000usize), |(width, height, n)| {
        let pixels = Pixels::sample(width, height, n);
        let mut places: Vec<usize> = pixels.at.iter().map(|at| pixels.index(*at)).collect();
        prop_assert!(pixels.at.iter().all(|[i, j]| *i < width && *j < height));
        prop_assert_eq!(places.len(), (pixels.n_columns() * pixels.n_rows()) as usize);
        places.sort_unstable();
        places.dedup();
        prop_assert_eq!(places.len(), pixels.at.len());
        // Every cell has the value of its pixel.
        let whole: Vec<u32> = (0..width * height).collect();
        let spread = pixels.spread(&pixels.pick(&whole));
        prop_assert_eq!(spread.len(), whole.len());
        prop_assert!(
            pixels.at.iter().all(|at| spread[pixels.index(*at)] == whole[pixels.index(*at)])
        );
        Ok(())
    });
}

fn times() -> impl Strategy<Value = Vec<f64>> {
    prop_oneof![
        vec(magnitude(-6, 6), 1..200),
        vec(0.9..1.1, 1..200),
        vec((0..3u8).prop_map(f64::from), 1..60)
    ]
}

#[test]
fn intervals_contain_their_estimate() {
    check(60, (times(), times(), any::<u64>()), |(a, b, seed)| {
        for bootstrap in [Bootstrap::default(), Bootstrap::of_neighbours(a.len().min(b.len()))] {
            let bootstrap = Bootstrap { seed, n_resamples: 200, ..bootstrap };
            if let Some(i) = bootstrap.median(&a) {
                prop_assert_eq!(Some(i.estimate), median(&a));
                prop_assert!(i.low <= i.estimate && i.estimate <= i.high, "{i:?}");
            }
            if let Some(i) = bootstrap.ratio_of_medians(&a, &b) {
                prop_assert!(0.0 <= i.low && i.low <= i.estimate && i.estimate <= i.high, "{i:?}");
            }
        }
        Ok(())
    });
}

#[test]
fn percentiles_are_ordered() {
    check(1000, times(), |times| {
        let Some(s) = Summary::of(&times) else {
            return Err(TestCaseError::fail("finite values have a summary"));
        };
        let order = [s.min, s.p1, s.p5, s.p50, s.p95, s.p99, s.max];
        prop_assert!(order.windows(2).all(|w| w[0] <= w[1]), "{s:?}");
        // A sum of n numbers is rounded n times.
        let slack = 1e-13 * s.max;
        prop_assert!(
            s.n == times.len() && s.mean >= s.min - slack && s.mean <= s.max + slack,
            "{s:?}"
        );
        if let Some(lows) = Lows::of(&times) {
            let ends = (1000.0 / s.max) * (1.0 - 1e-12)..=(1000.0 / s.min) * (1.0 + 1e-12);
            let all = [lows.p99_fps, lows.slowest_mean_fps, lows.slowest_time_fps];
            prop_assert!(all.iter().all(|fps| ends.contains(fps)), "{lows:?}");
        }
        Ok(())
    });
}
