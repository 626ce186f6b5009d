//! Where blobs end (passes.md "edges").

/// The setting of where blobs end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reach {
    /// At this distance from the centre, σ.
    Sigmas(f64),
    /// Where the blob's own optical depth falls under [`EDGE`].
    Auto,
}

/// Optical depth at which blobs end by themselves: the greatest one that changes the pictures of
/// the studied scenes by less than 10⁻³ of their radiance (docs/explanation/studies.md).
pub const EDGE: f64 = 5e-4;

/// Distance beyond which no blob is drawn, σ. There e^{−32} of a blob's depth is left, less than
/// [`EDGE`] of every depth below 10¹⁰.
pub const FARTHEST: f64 = 8.0;

/// The law by which blobs end: where both bounds of it are met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Greatest distance from a blob's centre, σ.
    pub radius: f64,
    /// Least optical depth of a blob; 0 is no bound.
    pub tau: f64,
}

impl Edge {
    /// Blobs end at [`FARTHEST`] alone.
    pub const NONE: Edge = Edge { radius: FARTHEST, tau: 0.0 };

    /// Returns b²/2σ² where a blob of central optical depth `tau` ends. If it is not positive
    /// nothing is drawn.
    pub fn cut(&self, tau: f64) -> f64 {
        // Without a threshold the logarithm is infinite, or NaN for 0/0, which `min` ignores.
        self.farthest_cut().min((tau / self.tau).ln())
    }

    /// Returns b²/2σ² at the radius.
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
        let edge = Edge { radius: 3.0, tau: 0.01 };
        // ln(0.01 e²/0.01) = 2 is before 3²/2; e⁵ is beyond it.
        let e = std::f64::consts::E;
        assert!((edge.cut(0.01 * e * e) - 2.0).abs() < 1e-14);
        assert_eq!((edge.cut(0.01 * e.powi(5)), edge.reach(f64::INFINITY)), (4.5, 3.0));
        assert!((edge.reach(0.01 * e * e) - 2.0).abs() < 1e-14);
        assert_eq!((edge.reach(0.01), edge.reach(0.005), edge.reach(0.0)), (0.0, 0.0, 0.0));
    }

    #[test]
    fn without_a_threshold_the_radius_alone_counts() {
        let edge = Edge { radius: 3.0, tau: 0.0 };
        assert_eq!([edge.cut(1e-30), edge.cut(0.0), edge.cut(1e30)], [4.5; 3]);
        assert!(!edge.has_threshold());
    }

    #[test]
    fn the_farthest_reach_is_beyond_the_edge_of_dense_blobs() {
        let edge = Edge { tau: EDGE, ..Edge::NONE };
        assert!(edge.reach(1e10) < FARTHEST && edge.reach(1e11) == FARTHEST);
    }
}
