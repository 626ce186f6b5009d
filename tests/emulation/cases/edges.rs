//! Coverage of a cell, compared with areas.

use super::*;
use crate::emulation::coverage::{Coverage, Patch};
use nimbus::model::philox::{philox4x32_10, uniform};
use nimbus::reference::area::clip;
use nimbus::reference::occlude::Source;

const SLACK: f64 = 8.0 * U * 4.0;

/// A cell of edge 1 at a height of 2 that faces down.
fn above() -> Patch {
    Patch { q: 2.0 * DVec3::Y, u: 0.5 * DVec3::X, v: 0.5 * DVec3::Z }
}

/// A level rectangle between (x₀, z₀) and (x₁, z₁) at height y.
fn table(y: f64, [x0, z0]: [f64; 2], [x1, z1]: [f64; 2]) -> Rectangle {
    let (u, v) = (0.5 * (x1 - x0) * DVec3::X, 0.5 * (z1 - z0) * DVec3::Z);
    Rectangle::new(&plane(DVec3::new(0.5 * (x0 + x1), y, 0.5 * (z0 + z1)), u, v, 1), DVec3::ZERO)
}

fn hidden(r: &Rectangle, source: Source, patch: &Patch) -> f64 {
    let edges = Coverage::new(r, source, patch, SLACK);
    Patch::middles().map(|at| edges.hidden(at).value).sum::<f64>() / 16.0
}

const EYE: Source = Source::At(DVec3::ZERO);

#[test]
fn edges_along_the_axes_are_exact() {
    // From the origin a rectangle half way casts a shadow twice as wide; the cell is [−½, ½]²
    // there.
    for k in 0..60 {
        let x = -0.3 + 0.01 * f64::from(k);
        let beyond = (0.5 - 2.0 * x).clamp(0.0, 1.0);
        let half = table(1.0, [x, -9.0], [9.0, 9.0]);
        assert!((hidden(&half, EYE, &above()) - beyond).abs() < 1e-13, "{x}");
        // The same with its front up, and with the edge along the other axis.
        let turned = Rectangle { normal: -half.normal, ..table(1.0, [-9.0, x], [9.0, 9.0]) };
        assert!((hidden(&turned, EYE, &above()) - beyond).abs() < 1e-13, "{x}");
        // A strip of 0.06 where parts are 0.25 wide, and a corner.
        let strip = table(1.0, [x, -9.0], [x + 0.03, 9.0]);
        let of_strip = beyond - (0.44 - 2.0 * x).clamp(0.0, 1.0);
        assert!((hidden(&strip, EYE, &above()) - of_strip).abs() < 1e-13, "{x}");
        let corner = table(1.0, [x, 0.1], [9.0, 9.0]);
        assert!((hidden(&corner, EYE, &above()) - 0.3 * beyond).abs() < 1e-13, "{x}");
    }
    // A plane inclined about its edge at (x, y) = (0.1, 1) casts the same shadow, to 0.2.
    for lean in [-0.9, -0.3, 0.4, 0.7] {
        let u = DVec3::new(1.0, lean, 0.0);
        let leans = plane(DVec3::new(0.1, 1.0, 0.0) + u, u, 9.0 * DVec3::Z, 1);
        let rectangle = Rectangle::new(&leans, DVec3::ZERO);
        assert!((hidden(&rectangle, EYE, &above()) - 0.3).abs() < 1e-13, "{lean}");
    }
    // A rectangle across the cell's plane at x = 0.1 hides nothing on the near side and everything
    // beyond, up to the tolerance 2⁻²⁰ of its plane.
    let across = plane(DVec3::new(0.1, 2.0, 0.0), 9.0 * DVec3::Y, 9.0 * DVec3::Z, 1);
    let aside = Source::At(DVec3::NEG_X);
    assert!((hidden(&Rectangle::new(&across, DVec3::ZERO), aside, &above()) - 0.4).abs() < 1e-6);
}

#[test]
fn directions_cast_shadows_along_themselves() {
    // Light from (0.6, 0.8, 0) is displaced by 0.75 over a height of 1.
    let floor = Patch { q: DVec3::ZERO, u: 0.5 * DVec3::Z, v: 0.5 * DVec3::X };
    let sun = Source::Toward(DVec3::new(0.6, 0.8, 0.0));
    for k in 0..40 {
        let x = 0.2 + 0.03 * f64::from(k);
        let half = table(1.0, [x, -9.0], [9.0, 9.0]);
        assert!(
            (hidden(&half, sun, &floor) - (0.5 + 0.75 - x).clamp(0.0, 1.0)).abs() < 1e-13,
            "{x}"
        );
    }
    // Rectangles below, or along the light, hide nothing.
    assert_eq!(hidden(&table(-1.0, [-9.0; 2], [9.0; 2]), sun, &floor), 0.0);
    let along = plane(DVec3::Y, DVec3::new(0.6, 0.8, 0.0), DVec3::Z, 1);
    assert!(hidden(&Rectangle::new(&along, DVec3::ZERO), sun, &floor) < 1e-9);
}

#[test]
fn rectangles_in_the_plane_of_cell_or_eye_hide_nothing() {
    for off in [0.0, 1e-7, -1e-7] {
        assert_eq!(hidden(&table(2.0 + off, [0.1, -1.0], [1.0, 1.0]), EYE, &above()), 0.0);
        assert_eq!(hidden(&table(off, [0.1, -1.0], [1.0, 1.0]), EYE, &above()), 0.0);
    }
    // On the far side of the cell, and behind the eye.
    assert_eq!(hidden(&table(2.01, [-9.0; 2], [9.0; 2]), EYE, &above()), 0.0);
    assert_eq!(hidden(&table(-0.01, [-9.0; 2], [9.0; 2]), EYE, &above()), 0.0);
    assert_eq!(hidden(&table(1.99, [-9.0; 2], [9.0; 2]), EYE, &above()), 1.0);
    assert_eq!(hidden(&table(0.01, [-9.0; 2], [9.0; 2]), EYE, &above()), 1.0);
}

#[test]
fn random_coverage_is_near_the_shadows_area() {
    let (mut squares, mut worst, mut n) = (0.0, 0.0f64, 0.0);
    for k in 0..3000 {
        let mut of = (0..3)
            .flat_map(|c| philox4x32_10([5, 9], [k, c, 0, 0]).map(uniform))
            .map(|x| 2.0 * x - 1.0);
        let mut next = || of.next().unwrap_or(0.0);
        let mut vector = || DVec3::new(next(), next(), next());
        let (u, w, c) = (vector().normalize(), vector(), vector());
        let v = u.cross(w).normalize();
        let blocker = plane(DVec3::new(0.3 * c.x, 1.0 + 0.5 * c.y, 0.3 * c.z), 0.4 * u, 0.3 * v, 1);
        let ceiling = plane(2.0 * DVec3::Y, 0.5 * DVec3::X, 0.5 * DVec3::Z, 1);
        for source in [EYE, Source::Toward(DVec3::new(0.28, -0.96, 0.0))] {
            let shadow = clip::shadow(
                &Rectangle::new(&ceiling, DVec3::ZERO),
                &Rectangle::new(&blocker, DVec3::ZERO),
                source,
            );
            let area = shadow.map_or(0.0, |lines| {
                clip::area(&clip::split(clip::WHOLE.to_vec(), &lines).0) / 4.0
            });
            let found = hidden(&Rectangle::new(&blocker, DVec3::ZERO), source, &above());
            if area > 0.0 || found > 0.0 {
                squares += (found - area).powi(2);
                worst = worst.max((found - area).abs());
                n += 1.0;
            }
        }
    }
    // A ramp errs by at most 0.043 of a part (an edge at 45°), with either sign and some 0.02 on
    // average: for 16 edge parts 0.02·4/16. A corner within a part errs by up to ¼ of it, some 0.1:
    // for four of them 0.1·2/16. At worst all add up: 16·0.043/16 + 4·¼/16.
    let rms = (squares / n).sqrt();
    assert!(n > 2000.0 && rms < 0.0135 && worst < 0.106, "{n} {rms} {worst}");
}

#[test]
fn bounds_cover_rounding_and_are_small() {
    // An edge that rounding moves by 1e-7 changes the coverage by less than the bound, and the
    // bound is small.
    let at = |x: f64| table(1.0, [x, -0.2], [9.0, 0.3]);
    let edges = |x: f64| Coverage::new(&at(x), EYE, &above(), SLACK);
    for k in 0..20 {
        let x = -0.2 + 0.021 * f64::from(k);
        for part in Patch::middles() {
            let (is, other) = (edges(x).hidden(part), edges(x + 1e-7).hidden(part));
            assert!(
                (is.value - other.value).abs() <= is.error && is.error < 1e-3,
                "{x} {is:?} {other:?}"
            );
        }
    }
}
