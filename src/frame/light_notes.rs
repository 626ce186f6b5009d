//! Sentences about defects of a frame's light that a user should know of.

use super::dark_lights::dark_lights;
use super::readback::LitFacets;
use super::stage::Stage;
use crate::error::Result;
use crate::model::frame_state::FrameState;
use crate::model::light::Light;
use crate::model::scene::LightingMode;

/// Returns sentences about negative, infinite or NaN radiances of the last frame, lost sources,
/// pairs of facets that stayed too wide, and lights that light nothing; none for most scenes.
///
/// # Errors
/// Fails if a frame is in flight or the device is lost.
pub fn light_notes(stage: &mut Stage) -> Result<Vec<String>> {
    if stage.scene.lighting.mode == LightingMode::None {
        return Ok(vec![]);
    }
    let (facets, lit) = stage.renderer.facets(&stage.device)?;
    let count = |what: &dyn Fn(f32) -> bool| {
        lit.iter().filter(|l| l.first.iter().chain(&l.second).any(|v| what(*v))).count()
    };
    let (n_negative, n_odd) = (count(&|v| v < 0.0), count(&|v| !v.is_finite()));
    let mut notes = Vec::new();
    if n_odd > 0 {
        let facets = counted(n_odd, "facet");
        notes.push(format!("the radiance of {facets} is not a finite number"));
    }
    if n_negative > 0 {
        let least =
            lit.iter().flat_map(|l| l.first.iter().chain(&l.second)).copied().fold(0.0, f32::min);
        notes.push(format!(
            "the radiance of {} is negative, {least:.3e} at the least: the lobes' basis is cut \
             off; more lighting.bases bring it nearer to 0",
            counted(n_negative, "facet")
        ));
    }
    let n_lost: f64 = lit.iter().map(|l| f64::from(l.n_lost)).sum();
    if n_lost > 0.0 {
        notes.push(format!(
            "light of {} is missing from L2: the loops ended before; fewer facets a surface or \
             cloud, a greater lighting.theta or broader lobes need fewer iterations",
            counted(n_lost as usize, "source")
        ));
    }
    let unresolved: Vec<_> = lit.iter().filter(|l| l.n_unresolved > 0.0).collect();
    if !unresolved.is_empty() {
        let n_pairs: f64 = unresolved.iter().map(|l| f64::from(l.n_unresolved)).sum();
        let most = unresolved.iter().map(|l| f64::from(l.unresolved)).fold(0.0, f64::max);
        let most = match most.is_finite() && n_lost == 0.0 {
            true => format!("by up to {most:.3e}"),
            false => "by an unknown amount (there is no bound on light that was left out, or in \
                tensors)"
                .to_owned(),
        };
        let brightest = lit.iter().flat_map(|l| l.second).map(f64::from).fold(0.0, f64::max);
        notes.push(format!(
            "{} of {} stayed wider than lighting.pair_size asks for: L2 may be off {most} there \
             (the greatest L2 is {brightest:.3e}); finer `subdivide` or more lighting.pair_levels \
             resolve them",
            counted(n_pairs as usize, "pair"),
            counted(unresolved.len(), "facet")
        ));
    }
    // A medium has depths in place of transmittances, and no facets that face away.
    let last = stage.renderer.last_time_s().filter(|_| !stage.scene.lighting.mode.is_medium());
    if let Some(time_s) = last {
        let origin = FrameState::at(&stage.scene, &stage.scene.groups(), time_s)?.light_origin;
        let at = |light: &Light| light.relative_to(origin);
        let lights: Vec<Light> = stage.scene.lights.iter().map(at).collect();
        let transmittance = stage.renderer.transmittance(&stage.device)?;
        let facets = LitFacets { facets, transmittance };
        notes.extend(dark_lights(stage.scene.film.exposure, &lights, &facets));
    }
    Ok(notes)
}

/// Returns a number with its noun.
fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}
