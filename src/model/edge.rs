//! Where blobs end (passes.md "edges").

/// The setting of where blobs end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reach {
    /// At this distance from the centre, σ.
    Sigmas(f64),
    /// Where the blob's own optical depth falls under [`EDGE`], and at [`NEAREST`] at the nearest.
    Auto,
}

/// Optical depth at which blobs end by themselves: with it, the cut changes the pictures of the
/// measured scenes by less than 10⁻³ (passes.md "edges").
pub const EDGE: f64 = 5e-4;

/// Distance within which no blob ends by itself, σ: however thin a blob is, e^{−9/2} of its depth
/// at most is cut. Clouds of very many very thin blobs would vanish without that.
pub const NEAREST: f64 = 3.0;

/// Distance beyond which no blob is drawn, σ. There e^{−32} of a blob's depth is left, less than
/// [`EDGE`] of every depth below 10¹⁰.
pub const FARTHEST: f64 = 8.0;

/// The law by which blobs end: where their optical depth falls under `tau`, but not within `least`
/// and not beyond `radius` of the centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Greatest distance at which a blob ends, σ.
    pub radius: f64,
    /// Optical depth at which a blob ends; 0 is no bound.
    pub tau: f64,
    /// Least distance at which a blob ends, σ.
    pub least: f64,
}

impl Edge {
    /// Blobs end at [`FARTHEST`] alone.
    pub const NONE: Edge = Edge::at(FARTHEST);
    /// The law of [`Reach::Auto`].
    pub const AUTO: Edge = Edge { radius: FARTHEST, tau: EDGE, least: NEAREST };

    /// Returns the law of blobs that end at `radius` σ.
    pub const fn at(radius: f64) -> Edge {
        Edge { radius, tau: 0.0, least: 0.0 }
    }

    /// Returns b²/2σ² where a blob of central optical depth `tau` ends. If it is not positive
    /// nothing is drawn.
    pub fn cut(&self, tau: f64) -> f64 {
        // Without a bound of depth the logarithm is infinite. 0/0 is NaN, which `max` ignores.
        self.farthest_cut().min((tau / self.tau).ln().max(self.nearest_cut()))
    }

    /// Returns the least b²/2σ² at which a blob ends.
    pub fn nearest_cut(&self) -> f64 {
        0.5 * self.least * self.least
    }

    /// Returns the greatest b²/2σ² at which a blob ends.
    pub fn farthest_cut(&self) -> f64 {
        0.5 * self.radius * self.radius
    }

    /// Returns the distance, σ, at which a blob of central optical depth `tau` ends; 0 where
    /// nothing of it is drawn.
    pub fn reach(&self, tau: f64) -> f64 {
        (2.0 * self.cut(tau).max(0.0)).sqrt()
    }

    /// Returns whether blobs end at an optical depth.
    pub fn has_threshold(&self) -> bool {
        self.tau > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blob_ends_where_both_bounds_are_met() {
        let edge = Edge { tau: 0.01, ..Edge::at(3.0) };
        // ln(0.01 e²/0.01) = 2 is before 3²/2; e⁵ is beyond it.
        let e = std::f64::consts::E;
        assert!((edge.cut(0.01 * e * e) - 2.0).abs() < 1e-14);
        assert_eq!((edge.cut(0.01 * e.powi(5)), edge.reach(f64::INFINITY)), (4.5, 3.0));
        assert!((edge.reach(0.01 * e * e) - 2.0).abs() < 1e-14);
        assert_eq!((edge.reach(0.01), edge.reach(0.005), edge.reach(0.0)), (0.0, 0.0, 0.0));
    }

    #[test]
    fn without_a_threshold_the_radius_alone_counts() {
        let edge = Edge::at(3.0);
        assert_eq!([edge.cut(1e-30), edge.cut(1e30)], [4.5; 2]);
        assert!(!edge.has_threshold());
    }

    #[test]
    fn the_farthest_reach_is_beyond_the_edge_of_dense_blobs() {
        assert!(Edge::AUTO.reach(1e10) < FARTHEST && Edge::AUTO.reach(1e11) == FARTHEST);
    }

    #[test]
    fn thin_blobs_keep_nearly_all_of_their_depth() {
        let [dense, thin, thinner] = [0.1, 0.04, 1e-20].map(|tau| Edge::AUTO.reach(tau));
        assert!(dense > NEAREST && [thin, thinner] == [NEAREST; 2]);
        let most = |tau: f64| tau * (-Edge::AUTO.cut(tau)).exp();
        assert!(most(1.0) < 1.000_001 * EDGE && most(1e-20) < 0.0112 * 1e-20);
    }
}
