//! Which particles can show in a pixel at all, model.md §11 "cull".
//! In: blobs and eye relative to O. Out: of each whether it is kept.

use glam::DVec3;

use super::Blob;
use super::sprites::View;

/// What a GPU may do with a particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CullOutcome {
    Kept,
    Culled,
    /// So near to a decision that rounding, or what is kept for its sake, makes it.
    Uncertain,
}

/// How far a decision may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CullTolerance {
    /// Of a view depth, as a share of the distance.
    pub depth: f64,
    /// Of ln(τ₀/t).
    pub log: f64,
    /// How much of its reach a silhouette may be taken to be larger, and by how many pixels its
    /// rectangle.
    pub growth: f64,
    pub pixels: f64,
}

impl CullTolerance {
    pub const NONE: CullTolerance =
        CullTolerance { depth: 0.0, log: 0.0, growth: 0.0, pixels: 0.0 };
}

/// What may become of `blob`, κ with its weights.
pub fn outcome(view: &View, blob: &Blob, slack: &CullTolerance) -> CullOutcome {
    // The silhouette is never taken to be smaller.
    let certain = CullTolerance { depth: -slack.depth, log: -slack.log, growth: 0.0, pixels: 0.0 };
    match (shows(view, blob, &certain), shows(view, blob, slack)) {
        (true, _) => CullOutcome::Kept,
        (false, false) => CullOutcome::Culled,
        (false, true) => CullOutcome::Uncertain,
    }
}

/// Whether `blob` can show where every decision is moved by `slack` toward "yes". A comparison with
/// what is no number is "no".
fn shows(view: &View, blob: &Blob, slack: &CullTolerance) -> bool {
    let c = blob.position - view.pose.position;
    let (depth, off) = (c.dot(view.pose.forward), slack.depth * c.length());
    let (above, off_size) = view.above_smallest(blob, c, slack.depth);
    let cut = view.cut(blob.deepest()) + if view.threshold > 0.0 { slack.log } else { 0.0 };
    if !(depth + off >= view.near
        && blob.kappa * blob.sigma > 0.0
        && cut > 0.0
        && above + off_size >= 0.0)
    {
        return false;
    }
    let reach = (1.0 + slack.growth) * (2.0 * cut.min(0.5 * view.cutoff * view.cutoff)).sqrt();
    let (half_x, half_y) = view.half_slopes();
    let holds = |side: DVec3, half: f64, n: u32| {
        let (low, high) = blob.slopes(c, [side, view.pose.forward], reach);
        // In pixels from the first one's edge; centres lie at i + ½.
        let at = |s: f64| 0.5 * (s / half + 1.0) * f64::from(n);
        let first = (at(low) - slack.pixels - 0.5).ceil().max(0.0);
        let last = (at(high) + slack.pixels - 0.5).floor().min(f64::from(n) - 1.0);
        first <= last
    };
    // A row and its mirror image are alike but for their number.
    holds(view.pose.right, half_x, view.width) && holds(-view.pose.up, half_y, view.height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::camera::Pose;

    /// Four columns and two rows of slopes ½ wide: centres at ±¼, ±¾ and ±¼.
    const VIEW: View = View {
        width: 4,
        height: 2,
        pose: Pose { position: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z },
        // 2 arctan ½.
        fov_y_rad: 0.927_295_218_001_612_2,
        near: 0.5,
        cutoff: 3.0,
        threshold: 0.0,
        smallest: 0.0,
        shift: glam::DVec2::ZERO,
    };

    fn of(x: f64, y: f64, z: f64, sigma: f64) -> CullOutcome {
        outcome(
            &VIEW,
            &Blob { aspect: 1.0, position: DVec3::new(x, y, -z), sigma, kappa: 1.0 },
            &CullTolerance::NONE,
        )
    }

    #[test]
    fn silhouettes_that_hold_a_centre_are_kept() {
        // Between four centres, and around one of them: at depth 10 a slope of ¼ is 2.5.
        assert_eq!(
            (of(0.0, 0.0, 10.0, 0.1), of(2.5, -2.5, 10.0, 0.1)),
            (CullOutcome::Culled, CullOutcome::Kept)
        );
        // Reaches from 0 to the centres at ±¼: asin(3σ/10) = atan ¼, 3σ = 10/√17.
        let sigma = 10.0 / 17f64.sqrt() / 3.0;
        assert_eq!(
            (of(0.0, 0.0, 10.0, 0.999 * sigma), of(0.0, 0.0, 10.0, 1.001 * sigma)),
            (CullOutcome::Culled, CullOutcome::Kept)
        );
        // Beside the picture, before the near plane, behind the eye, around it.
        assert_eq!(
            [of(9.0, 2.5, 10.0, 0.1), of(0.1, 0.1, 0.4, 0.1), of(2.5, 2.5, -10.0, 9.0)],
            [CullOutcome::Culled; 3]
        );
        assert_eq!([of(0.1, 0.0, 0.5, 1.0), of(30.0, 0.0, 1.0, 11.0)], [CullOutcome::Kept; 2]);
        assert_eq!(
            [of(f64::NAN, 0.0, 10.0, 1.0), of(2.5, 2.5, 10.0, 0.0)],
            [CullOutcome::Culled; 2]
        );
        assert_eq!(of(2.5, 2.5, 10.0, f64::INFINITY), CullOutcome::Kept);
    }

    #[test]
    fn what_is_too_thin_or_too_small_is_left_and_near_decisions_are_open() {
        let blob =
            Blob { aspect: 1.0, position: DVec3::new(2.5, 2.5, -10.0), sigma: 1.0, kappa: 1.0 };
        let of = |view: View, slack: f64| {
            outcome(
                &view,
                &blob,
                &CullTolerance { depth: slack, log: slack, growth: slack, pixels: slack },
            )
        };
        let tau = crate::model::cloud::SQRT_TAU;
        let thin = |share: f64| View { threshold: share * tau, ..VIEW };
        assert_eq!(
            (of(thin(0.999), 0.0), of(thin(1.001), 0.0)),
            (CullOutcome::Kept, CullOutcome::Culled)
        );
        assert_eq!(
            (of(thin(0.999), 0.01), of(thin(1.001), 0.01)),
            (CullOutcome::Uncertain, CullOutcome::Uncertain)
        );
        // A pixel at depth 10 is 5 wide, σ a fifth of that.
        let small = |smallest: f64| View { smallest, ..VIEW };
        assert_eq!(
            (of(small(0.199), 0.0), of(small(0.201), 0.0)),
            (CullOutcome::Kept, CullOutcome::Culled)
        );
        assert_eq!(
            (of(small(0.199), 0.01), of(small(0.201), 0.01)),
            (CullOutcome::Uncertain, CullOutcome::Uncertain)
        );
        let near = |near: f64| View { near, ..VIEW };
        assert_eq!(
            (of(near(9.99), 0.0), of(near(10.01), 0.0), of(near(10.01), 0.01)),
            (CullOutcome::Kept, CullOutcome::Culled, CullOutcome::Uncertain)
        );
    }
}
