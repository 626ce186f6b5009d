//! The times of a bench against its swept keys.

use super::{SweepChart, SweptFigure, charts};
use crate::measure::figure::Figure;
use crate::timing::names::Setting;
use crate::timing::records::{Case, Measured, Mode, Run};
use crate::timing::still::skipped_passes;

/// Returns the charts of a bench with a sweep: the frame time and the GPU time.
pub fn charts_of_run(run: &Run) -> Vec<SweepChart> {
    // Loops that skip do not time the passes that they skipped, so a key of these passes seems to
    // change nothing. A line needs all of its points, so all cases have the loop without skipping.
    let with_whole = !skipped_passes(run).is_empty() || run.cases.iter().any(Case::is_still);
    let figures = |of: fn(&Mode) -> Option<Measured>| -> Vec<SweptFigure> {
        run.cases.iter().flat_map(|case| figures_of_case(case, of, with_whole)).collect()
    };
    [
        ("Frame time", "time of a frame, ms", (|m| m.frame_ms) as fn(&Mode) -> Option<Measured>),
        ("GPU time", "GPU time of a frame, ms", |m| m.gpu_ms),
    ]
    .into_iter()
    .flat_map(|(name, measure, of)| charts(name, measure, &figures(of)))
    .collect()
}

/// Returns the figures of the loops of a case: of those that skip, unless nothing moves, and of the
/// loop without skipping if no loop skips or it is wanted.
fn figures_of_case(
    case: &Case,
    of: fn(&Mode) -> Option<Measured>,
    with_whole: bool,
) -> Vec<SweptFigure> {
    let phase = case.phase.iter().map(|name| Setting { key: "phase".into(), value: name.clone() });
    let point: Vec<Setting> = case.sweep.iter().cloned().chain(phase).collect();
    let has_whole = with_whole || case.modes.iter().all(|m| !m.skip);
    let is_shown = |m: &&Mode| if m.skip { !case.draws_nothing(m) } else { has_whole };
    let figure = |mode: &Mode| {
        let m = of(mode)?;
        let figure = Figure { value: m.of.p50, low: m.p50_low, high: m.p50_high };
        Some(SweptFigure { point: point.clone(), series: mode.name(), figure })
    };
    case.modes.iter().filter(is_shown).filter_map(figure).collect()
}
