//! Light gathered by a receiver, with bounds on its f32 evaluation.

use glam::DVec3;

use nimbus::reference::bounded::Decision;

/// Light gathered by a receiver.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Gathered {
    /// I_i, W m⁻².
    pub indirect: DVec3,
    /// Σ Λ G V S of the receiver's lobe.
    pub(super) glossy: DVec3,
    /// L2 toward the eye, W m⁻² sr⁻¹.
    pub second: DVec3,
    /// Number of cells that were too wide at the last level.
    pub n_unresolved: f64,
    /// Bound on the change of I_i and L2 (before K_d and K_s) by rounding and by the decisions that
    /// it may turn.
    pub(super) error: [DVec3; 2],
    /// Bound on the error of I_i.
    pub indirect_error: DVec3,
    /// Bound on the error of L2.
    pub second_error: DVec3,
    /// Bound on the error of `n_unresolved`.
    pub n_doubted: f64,
}

impl Gathered {
    pub(super) fn add(&mut self, b: &Gathered) {
        self.indirect += b.indirect;
        self.glossy += b.glossy;
        self.n_unresolved += b.n_unresolved;
        self.error[0] += b.error[0];
        self.error[1] += b.error[1];
        self.n_doubted += b.n_doubted;
    }

    /// Returns `self` where rounding may select `b` instead.
    pub(super) fn or(mut self, b: &Gathered) -> Gathered {
        self.error[0] += (self.indirect - b.indirect).abs() + b.error[0];
        self.error[1] += (self.glossy - b.glossy).abs() + b.error[1];
        self.n_doubted += (self.n_unresolved - b.n_unresolved).abs() + b.n_doubted;
        self
    }

    /// Returns `is` if `d` is true, else `other`; evaluates both if rounding may turn `d`.
    pub(super) fn choose(
        d: Decision,
        is: impl Fn() -> Gathered,
        other: impl Fn() -> Gathered,
    ) -> Gathered {
        match (d.is_true, d.is_sure) {
            (true, true) => is(),
            (false, true) => other(),
            (true, false) => is().or(&other()),
            (false, false) => other().or(&is()),
        }
    }
}

impl FromIterator<Gathered> for Gathered {
    fn from_iter<I: IntoIterator<Item = Gathered>>(all: I) -> Gathered {
        let mut sum = Gathered::default();
        all.into_iter().for_each(|g| sum.add(&g));
        sum
    }
}
