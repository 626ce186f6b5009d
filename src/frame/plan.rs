//! The plan of a frame: which passes run and why the others are skipped.
//!
//! The plan is a pure function of the last packet and the next one. Skipping never changes a pixel:
//! a pass is skipped only if everything it reads is what it read the last time, to the bit.

mod decision;
mod table;
mod unchanged;

pub use decision::{Decision, Reason};
pub use table::Pass;
use table::ROWS;
pub use unchanged::Skipping;
use unchanged::Unchanged;

use super::features::SceneFeatures;
use super::packet::Packet;

/// A decision for every pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    decisions: [Decision; Pass::ALL.len()],
    view_only: bool,
    changed: Option<&'static str>,
}

impl Plan {
    /// Returns the plan that runs the passes that `runs` accepts.
    pub(super) fn running(runs: impl Fn(Pass) -> bool) -> Plan {
        let decision =
            |pass| if runs(pass) { Decision::RUN } else { Decision::skip("not asked for") };
        Plan { decisions: Pass::ALL.map(decision), view_only: false, changed: None }
    }

    /// Returns a plan in which nothing runs.
    #[cfg(test)]
    pub fn of_nothing() -> Plan {
        Plan::running(|_| false)
    }

    /// Returns the decision for `pass`.
    pub fn decision(&self, pass: Pass) -> Decision {
        self.decisions[pass as usize]
    }

    /// Returns whether `pass` runs.
    pub fn runs(&self, pass: Pass) -> bool {
        self.decision(pass).run
    }

    /// Returns whether every pass is skipped: the picture of the last frame is shown again.
    pub fn runs_nothing(&self) -> bool {
        !Pass::ALL.into_iter().any(|pass| self.runs(pass))
    }

    /// Returns whether only the eye has changed, so that receivers without a lobe keep their light.
    pub fn view_only(&self) -> bool {
        self.view_only
    }

    /// Returns what has changed in the picture other than the view.
    pub fn changed(&self) -> Option<&'static str> {
        self.changed
    }

    /// Replaces the decision for `impostors`, which depends on more frames than the last.
    pub(super) fn with_impostors(mut self, decision: Decision) -> Plan {
        self.decisions[Pass::Impostors as usize] = decision;
        self
    }
}

/// Returns the plan for `next` after `last`, which is `None` for the first frame.
pub fn plan(
    features: &SceneFeatures,
    skipping: Skipping,
    last: Option<&Packet>,
    next: &Packet,
) -> Plan {
    let unchanged = Unchanged::new(features, skipping, last, next);
    Plan {
        decisions: ROWS.map(|row| row.decide(features, &unchanged)),
        view_only: unchanged.response,
        changed: unchanged.first_change(features),
    }
}

#[cfg(test)]
mod tests;
