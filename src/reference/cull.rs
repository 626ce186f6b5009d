//! Culling of particles that no pixel shows, passes.md "cull". In: blobs and eye relative to O.
//! Out: whether each is kept.

use glam::DVec3;

use super::Blob;
use super::view::View;

/// Permitted treatment of a particle by a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CullOutcome {
    /// It must keep the particle.
    Kept,
    /// It must leave the particle out.
    Culled,
    /// It may do either: rounding or its tolerance decides.
    Uncertain,
}

/// Tolerances of a device's decisions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CullTolerance {
    /// Error of a view depth, as a share of the distance.
    pub depth: f64,
    /// Error of ln(τ₀/t).
    pub log: f64,
    /// Enlargement of the silhouette, as a share of its reach.
    pub growth: f64,
    /// Enlargement of the rectangle, pixels.
    pub pixels: f64,
}

impl CullTolerance {
    /// Exact decisions.
    pub const NONE: CullTolerance =
        CullTolerance { depth: 0.0, log: 0.0, growth: 0.0, pixels: 0.0 };
}

/// Returns what a device may do with `blob`, whose κ includes its weight.
pub fn outcome(view: &View, blob: &Blob, slack: &CullTolerance) -> CullOutcome {
    // The silhouette is never taken to be smaller.
    let certain = CullTolerance { depth: -slack.depth, log: -slack.log, growth: 0.0, pixels: 0.0 };
    match (shows(view, blob, &certain), shows(view, blob, slack)) {
        (true, _) => CullOutcome::Kept,
        (false, false) => CullOutcome::Culled,
        (false, true) => CullOutcome::Uncertain,
    }
}

/// Returns whether `blob` can show if every decision is moved by `slack` toward showing.
/// Comparisons with NaN do not show it.
fn shows(view: &View, blob: &Blob, slack: &CullTolerance) -> bool {
    let c = blob.position - view.pose.position;
    let (depth, off) = (c.dot(view.pose.forward), slack.depth * c.length());
    let (above, off_size) = view.above_smallest(blob, c, slack.depth);
    let cut =
        view.edge.cut(blob.deepest()) + if view.edge.has_threshold() { slack.log } else { 0.0 };
    if !(depth + off >= view.near
        && blob.kappa * blob.sigma > 0.0
        && cut > 0.0
        && above + off_size >= 0.0)
    {
        return false;
    }
    let reach = (1.0 + slack.growth) * (2.0 * cut.min(view.edge.farthest_cut())).sqrt();
    let (half_x, half_y) = view.half_slopes();
    let holds = |side: DVec3, half: f64, n: u32| {
        let (low, high) = blob.slopes(c, [side, view.pose.forward], reach);
        // Pixels from the first one's edge; centres lie at i + ½.
        let at = |s: f64| 0.5 * (s / half + 1.0) * f64::from(n);
        let first = (at(low) - slack.pixels - 0.5).ceil().max(0.0);
        let last = (at(high) + slack.pixels - 0.5).floor().min(f64::from(n) - 1.0);
        first <= last
    };
    // A row and its mirror image differ only in their number.
    holds(view.pose.right, half_x, view.width) && holds(-view.pose.up, half_y, view.height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::camera::Pose;
    use crate::model::cloud::Shape;
    use crate::model::edge::Edge;

    /// Four columns and two rows of slopes ½ wide: centres at ±¼, ±¾ and ±¼.
    const VIEW: View = View {
        width: 4,
        height: 2,
        pose: Pose { position: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z },
        // 2 arctan ½.
        fov_y_rad: 0.927_295_218_001_612_2,
        near: 0.5,
        edge: Edge::at(3.0),
        smallest: 0.0,
        slice: 0.0,
        n_parts: 4,
        shift: glam::DVec2::ZERO,
    };

    fn of(x: f64, y: f64, z: f64, sigma: f64) -> CullOutcome {
        outcome(
            &VIEW,
            &Blob { shape: Shape::BALL, position: DVec3::new(x, y, -z), sigma, kappa: 1.0 },
            &CullTolerance::NONE,
        )
    }

    #[test]
    fn blobs_over_a_pixel_centre_are_kept() {
        // Between four centres, and around one of them: at depth 10 a slope of ¼ is 2.5.
        assert_eq!(
            (of(0.0, 0.0, 10.0, 0.1), of(2.5, -2.5, 10.0, 0.1)),
            (CullOutcome::Culled, CullOutcome::Kept)
        );
        // The silhouette reaches from 0 to the centres at ±¼: asin(3σ/10) = atan ¼, 3σ = 10/√17.
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
    fn thin_and_small_blobs_are_culled_and_near_decisions_are_uncertain() {
        let blob = Blob {
            shape: Shape::BALL,
            position: DVec3::new(2.5, 2.5, -10.0),
            sigma: 1.0,
            kappa: 1.0,
        };
        let of = |view: View, slack: f64| {
            outcome(
                &view,
                &blob,
                &CullTolerance { depth: slack, log: slack, growth: slack, pixels: slack },
            )
        };
        let tau = crate::model::cloud::SQRT_TAU;
        let thin = |share: f64| View { edge: Edge { tau: share * tau, ..VIEW.edge }, ..VIEW };
        assert_eq!(
            (of(thin(0.999), 0.0), of(thin(1.001), 0.0)),
            (CullOutcome::Kept, CullOutcome::Culled)
        );
        assert_eq!(
            (of(thin(0.999), 0.01), of(thin(1.001), 0.01)),
            (CullOutcome::Uncertain, CullOutcome::Uncertain)
        );
        // A pixel at depth 10 is 5 wide; σ is a fifth of that.
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
