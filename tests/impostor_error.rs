//! The predicted error of impostors, compared with exact projections of random shells after random
//! moves and turns of the eye (docs/explanation/passes.md "impostors").

use glam::{DQuat, DVec2, DVec3};
use nimbus::model::impostor::{FarField, Shell, View};
use nimbus::reference::impostors::{seen, shown};

/// A deterministic stream of numbers in [0, 1).
struct Stream(u64);

impl Stream {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = self.between(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}

fn view(eye: DVec3, turn: DQuat, tangents: DVec2) -> View {
    View {
        eye,
        right: turn * DVec3::X,
        up: turn * DVec3::Y,
        forward: turn * DVec3::NEG_Z,
        tangents,
    }
}

/// Returns a shell and a later view: the eye moved by at most `move_share` of the nearest depth,
/// and turned by at most `turn_most`.
fn case(s: &mut Stream, move_share: f64, turn_most: f64) -> (Shell, View) {
    let axis = s.direction();
    let turn = DQuat::from_axis_angle(axis, s.between(0.0, 3.0));
    let nearest = s.between(2.0, 30.0);
    let farthest = if s.next() < 0.1 { f64::INFINITY } else { nearest * s.between(1.0, 4.0) };
    let sigma = nearest * s.between(0.001, 0.03);
    let tangents = DVec2::new(s.between(0.2, 0.9), s.between(0.2, 0.7));
    let eye = 10.0 * s.direction();
    let far = FarField { nearest, farthest, sigma, radius: 3.0 * sigma };
    let shell = Shell { view: view(eye, turn, 1.25 * tangents), far };
    let moved = nearest * move_share * s.next() * s.direction();
    let axis = s.direction();
    let turned = DQuat::from_axis_angle(axis, turn_most * s.next()) * turn;
    (shell, view(eye + moved, turned, tangents))
}

/// Returns the width of the projection of a small ball at `c` along `n`: |n·∂x/∂c|.
fn width(project: impl Fn(DVec3) -> DVec2, c: DVec3, n: DVec2) -> f64 {
    let h = 1e-5;
    let along = |axis: DVec3| n.dot(project(c + h * axis) - project(c - h * axis)) / (2.0 * h);
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)).length()
}

/// Returns a far point that the shell shows within the view, from its slopes' share `at` in [-1,
/// 1]² and its depth's share.
fn point(shell: &Shell, now: &View, at: DVec2, depth_share: f64) -> DVec3 {
    let on_shell = shell.homography(now) * (at * now.tangents).extend(1.0);
    let inverse =
        (1.0 - depth_share) / shell.far.nearest + depth_share / shell.far.farthest.min(1e9);
    shell.view.eye + shell.view.ray(on_shell.truncate() / on_shell.z) / inverse
}

#[test]
fn errors_are_at_most_the_prediction() {
    let mut s = Stream(1);
    let (mut n, mut closest_shift, mut closest_growth) = (0, 0f64, 0f64);
    for i in 0..4000 {
        let (move_share, turn) = [(0.001, 0.0), (0.02, 0.05), (0.2, 0.3), (0.5, 0.1)][i % 4];
        let (shell, now) = case(&mut s, move_share, turn);
        let Some(predicted) = shell.predict(&now) else { continue };
        for k in 0..24 {
            // First the corners and the ends of the depths, then random points.
            let at = match k {
                0..4 => DVec2::new([-1.0, 1.0][k % 2], [-1.0, 1.0][k / 2]),
                _ => DVec2::new(s.between(-1.0, 1.0), s.between(-1.0, 1.0)),
            };
            let depth_share = if k % 3 == 0 { s.next() } else { f64::from(k as u32 % 2) };
            let c = point(&shell, &now, at, depth_share);
            let shift = (seen(&now, c) - shown(&shell, &now, c)).length();
            // 1e-12 of coordinates up to 1e9.
            let slack = 1e-10 + if shell.far.farthest.is_infinite() { 1e-6 } else { 0.0 };
            assert!(
                shift <= predicted.shift * (1.0 + 1e-9) + slack,
                "{i} {k}: {shift} > {predicted:?}"
            );
            closest_shift = closest_shift.max((shift - slack) / predicted.shift);
            n += 1;
            if depth_share > 0.0 && shell.far.farthest.is_infinite() {
                continue;
            }
            let n_axis = DVec2::from_angle(s.between(0.0, 3.2));
            let [a, b] =
                [width(|c| shown(&shell, &now, c), c, n_axis), width(|c| seen(&now, c), c, n_axis)];
            let growth = (a / b - 1.0).abs();
            assert!(growth <= predicted.growth + 1e-6, "{i} {k}: {growth} > {predicted:?}");
            closest_growth = closest_growth.max(growth / (predicted.growth + 1e-6));
        }
    }
    println!(
        "{n} points; greatest actual/predicted: shift {closest_shift:.3}, growth \
         {closest_growth:.3}"
    );
    assert!(n > 50_000 && closest_shift > 0.9 && closest_growth > 0.3);
}

#[test]
fn small_moves_are_predicted_within_a_factor_of_two() {
    // Moves of a hundredth of the distance and turns of a few degrees, as for reused shells.
    let mut s = Stream(2);
    let mut worst = 0f64;
    for _ in 0..500 {
        let (mut shell, now) = case(&mut s, 0.01, 0.05);
        // Only centres: sprites that reach into the view from beside it enlarge the prediction.
        (shell.far.radius, shell.far.farthest) =
            (0.0, shell.far.farthest.min(4.0 * shell.far.nearest));
        let predicted = shell.predict(&now).expect("a bound");
        let mut actual = 0f64;
        for x in [-1.0, 1.0] {
            for y in [-1.0, 1.0] {
                for depth_share in [0.0, 1.0] {
                    let c = point(&shell, &now, DVec2::new(x, y), depth_share);
                    actual = actual.max((seen(&now, c) - shown(&shell, &now, c)).length());
                }
            }
        }
        worst = worst.max(predicted.shift / actual);
    }
    println!("predicted/actual at most {worst:.3}");
    assert!(worst < 2.0);
}

#[test]
fn prediction_is_zero_for_a_turn_of_the_eye() {
    let mut s = Stream(3);
    for _ in 0..200 {
        let (shell, now) = case(&mut s, 0.0, 0.3);
        if let Some(predicted) = shell.predict(&now) {
            assert_eq!((predicted.shift, predicted.growth), (0.0, 0.0));
        }
        let c = point(&shell, &now, DVec2::new(0.3, -0.4), 0.7);
        assert!((seen(&now, c) - shown(&shell, &now, c)).length() < 1e-9);
    }
}

#[test]
fn no_prediction_near_the_shell_or_looking_away() {
    let mut s = Stream(4);
    let (shell, _) = case(&mut s, 0.0, 0.0);
    let at = |ahead: f64, turn: f64| {
        let then = shell.view;
        let turn = DQuat::from_axis_angle(then.up, turn);
        let [right, up, forward] = [then.right, then.up, then.forward].map(|v| turn * v);
        let eye = then.eye + ahead * shell.far.nearest * then.forward;
        View { eye, right, up, forward, tangents: then.tangents / 1.25 }
    };
    assert!(
        shell.predict(&at(0.0, 0.0)).is_some_and(|p| p.slopes() == 0.0)
            && shell.covers(&at(0.0, 0.0), 0.01)
    );
    for now in [at(0.5, 0.0), at(1.5, 0.0), at(0.0, 1.6), at(0.0, 3.1), at(f64::NAN, 0.0)] {
        assert!(shell.predict(&now).is_none());
    }
    assert!(
        !shell.covers(&at(0.0, 0.5), 0.0)
            && !shell.covers(&at(0.0, 3.1), 0.0)
            && !shell.covers(&at(-0.5, 0.0), 0.0)
    );
}
