//! The remark on a bench in which nothing moves. The loops that skip then draw nothing, and the
//! figure is the loop without skipping.

use super::records::{Case, Mode, Run};
use crate::measure::lows::fps;

/// A remark on cases in which nothing moves, as the table and the page of a bench begin with it.
#[derive(Debug, Clone, PartialEq)]
pub struct StillRemark {
    /// The cases in which nothing moves, after the words "nothing moves"; empty for a single case.
    pub scope: String,
    /// A sentence on the frames of the loops that skip.
    pub reason: String,
    /// A sentence on the loop that has the figure.
    pub figure: String,
    /// A sentence on the keys that make frames differ.
    pub advice: &'static str,
}

impl StillRemark {
    /// Returns the remark on a run; `None` if something moves in every case.
    pub fn of(run: &Run) -> Option<StillRemark> {
        let still: Vec<&Case> = run.cases.iter().filter(|c| c.is_still()).collect();
        let case = still.first()?;
        let scope = match (still.len(), run.cases.len()) {
            (_, 1) => String::new(),
            (n, n_all) if n == n_all => format!(" in any of the {n_all} cases"),
            (n, n_all) => format!(" in {n} of {n_all} cases"),
        };
        let empty = empty_frames_text(case).unwrap_or_default();
        let figure = match (case.figure_mode(), run.cases.len()) {
            (None, _) => {
                "Only a loop without skipping has a time for such a scene; none was timed."
                    .to_owned()
            }
            (Some(mode), 1) => format!("The figure is {}: {}.", mode.name(), figure_text(mode)),
            (Some(mode), _) => format!("Their figures are of the loop {}.", mode.name()),
        };
        Some(StillRemark {
            scope,
            reason: format!("{empty}, and the loops that skip show the last picture again."),
            figure,
            advice: "A moving camera ([[camera.path]]), wind, gusts or an edited light make frames \
                differ.",
        })
    }
}

/// Returns how many frames drew nothing, of the loop in which most did; `None` if all drew.
pub fn empty_frames_text(case: &Case) -> Option<String> {
    let of = |m: &Mode| Some((m.empty_frames.unwrap_or(m.frames), m.frames)).filter(|_| m.skip);
    let (n_empty, n) = case.modes.iter().filter_map(of).max()?;
    (n_empty > 0).then(|| format!("{n_empty} of {n} timed frames draw nothing"))
}

fn figure_text(mode: &Mode) -> String {
    let Some(frame) = mode.frame_ms.map(|m| m.of.p50) else {
        return "no finite time was measured".to_owned();
    };
    let gpu =
        mode.gpu_ms.map_or(String::new(), |m| format!(", {:.3} ms of it on the GPU", m.of.p50));
    format!("{frame:.3} ms a frame ({:.1} frames/s){gpu}", fps(frame))
}
