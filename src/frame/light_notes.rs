//! Sentences about defects of a frame's light that a user should know of.

use super::stage::Stage;
use crate::error::Result;
use crate::model::scene::LightingMode;

/// Returns sentences about negative, infinite or NaN radiances of the last frame, lost sources, and
/// pairs of facets that stayed too wide; none for most scenes.
///
/// # Errors
/// Fails if a frame is in flight or the device is lost.
pub fn light_notes(stage: &mut Stage) -> Result<Vec<String>> {
    if stage.scene.lighting.mode == LightingMode::None {
        return Ok(vec![]);
    }
    let lit = stage.renderer.facets(&stage.device)?.1;
    let count = |what: &dyn Fn(f32) -> bool| {
        lit.iter().filter(|l| l.first.iter().chain(&l.second).any(|v| what(*v))).count()
    };
    let (n_negative, n_odd) = (count(&|v| v < 0.0), count(&|v| !v.is_finite()));
    let mut notes = Vec::new();
    if n_odd > 0 {
        notes.push(format!("the radiance of {n_odd} facets is not a finite number"));
    }
    if n_negative > 0 {
        let least =
            lit.iter().flat_map(|l| l.first.iter().chain(&l.second)).copied().fold(0.0, f32::min);
        notes.push(format!(
            "the radiance of {n_negative} facets is negative, {least:.3e} at the least: the lobes' \
             basis is cut off; more lighting.bases bring it nearer to 0"
        ));
    }
    let n_lost: f64 = lit.iter().map(|l| f64::from(l.n_lost)).sum();
    if n_lost > 0.0 {
        notes.push(format!(
            "{n_lost:.0} sources were not visited within the iterations that loops may take, and \
             their light is missing from L2; fewer facets a surface or cloud, a greater \
             lighting.theta or broader lobes need fewer"
        ));
    }
    let unresolved: Vec<_> = lit.iter().filter(|l| l.n_unresolved > 0.0).collect();
    if !unresolved.is_empty() {
        let n_pairs: f64 = unresolved.iter().map(|l| f64::from(l.n_unresolved)).sum();
        let most = unresolved.iter().map(|l| f64::from(l.unresolved)).fold(0.0, f64::max);
        let most = match most.is_finite() {
            true => format!("by up to {most:.3e}"),
            false => "by an unknown amount (there is no bound on light that was left out, or in \
                tensors)"
                .to_owned(),
        };
        let brightest = lit.iter().flat_map(|l| l.second).map(f64::from).fold(0.0, f64::max);
        notes.push(format!(
            "{n_pairs} pairs of {} facets stayed wider than lighting.pair_size asks for: L2 may be \
             off {most} there (the greatest L2 is {brightest:.3e}); finer `subdivide` or more \
             lighting.pair_levels resolve them",
            unresolved.len()
        ));
    }
    Ok(notes)
}
