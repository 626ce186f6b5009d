//! Remarks on what the loops that skip did not do. Where nothing moves they draw nothing, and the
//! figure is the loop without skipping. In other scenes their times lack the passes that they
//! skipped.

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
            _ if run.cold_bytes.is_some() => "With cold caches no loop has a figure.".to_owned(),
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

/// Reason for which a case that stands still has neither a ratio of its loops nor a bound of their
/// overlap.
pub const NO_RATIO: &str = "the loops that skip draw nothing; --no-skip times them";

/// Returns "case: loop", marked if nothing moves in the case and the loop draws nothing.
pub fn marked_name(case: &Case, mode: &Mode) -> String {
    let name = mode.name_in(case);
    match (mode.n_empty(), mode.frames) {
        (0, _) => name,
        _ if !case.draws_nothing(mode) => name,
        (n, n_all) if n == n_all => format!("{name} (draws nothing)"),
        (n, n_all) => format!("{name} (draws nothing in {n} of {n_all} frames)"),
    }
}

/// Returns the passes whose work skipping left out of some timed frames, in the order of the frame.
/// The times of the loops that skip lack this work. Cases in which nothing moves have a remark of
/// their own.
pub fn skipped_passes(run: &Run) -> Vec<&str> {
    let loops = run.modes().filter(|(case, mode)| mode.skip && !case.is_still());
    let lacking: Vec<&str> = loops
        .flat_map(|(_, mode)| &mode.passes)
        .filter(|pass| pass.lacks_work())
        .map(|pass| pass.name.as_str())
        .collect();
    let mut names: Vec<&str> = Vec::new();
    for pass in run.modes().flat_map(|(_, mode)| &mode.passes) {
        if lacking.contains(&pass.name.as_str()) && !names.contains(&pass.name.as_str()) {
            names.push(&pass.name);
        }
    }
    names
}

/// Returns a sentence on the skipped passes and the loop that times them; `None` if there are none.
pub fn skipped_text(run: &Run) -> Option<String> {
    let names = skipped_passes(run);
    let mut loops: Vec<String> = Vec::new();
    for name in run.modes().filter(|(_, mode)| !mode.skip).map(|(_, mode)| mode.name()) {
        if !loops.contains(&name) {
            loops.push(name);
        }
    }
    (!names.is_empty()).then(|| {
        format!(
            "skipped in some timed frames or in all: {}; the loop without skipping ({}) times them \
             in every frame",
            names.join(", "),
            loops.join(", ")
        )
    })
}

fn figure_text(mode: &Mode) -> String {
    let Some(frame) = mode.frame_ms.map(|m| m.of.p50) else {
        return "no finite time was measured".to_owned();
    };
    let gpu =
        mode.gpu_ms.map_or(String::new(), |m| format!(", {:.3} ms of it on the GPU", m.of.p50));
    format!("{frame:.3} ms a frame ({:.1} frames/s){gpu}", fps(frame))
}
