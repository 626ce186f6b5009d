//! What a receiver gathers, and what an f32 evaluation may make of it.

use glam::DVec3;

use super::bounded::Decision;

/// What a receiver gathers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Gathered {
    pub indirect: DVec3,
    /// Σ Λ G V S of the receiver's lobe.
    pub(super) glossy: DVec3,
    pub second: DVec3,
    pub n_unresolved: f64,
    /// What rounding may change of I_i and L2 (before K_d and K_s), and what decisions within
    /// rounding may.
    pub(super) error: [DVec3; 2],
    pub indirect_error: DVec3,
    pub second_error: DVec3,
    /// Of n_unresolved.
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

    /// `self`, in doubt whether it is not `b`.
    pub(super) fn or(mut self, b: &Gathered) -> Gathered {
        self.error[0] += (self.indirect - b.indirect).abs() + b.error[0];
        self.error[1] += (self.glossy - b.glossy).abs() + b.error[1];
        self.n_doubted += (self.n_unresolved - b.n_unresolved).abs() + b.n_doubted;
        self
    }

    /// `is` where `d`, else `other`; both where rounding may turn it.
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
