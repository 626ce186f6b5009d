//! The pipelines of a scene, made without running any.

use super::renderer::Renderer;
use super::stage::GpuContext;
use crate::error::{Error, Result};
use crate::gpu::PipelineReport;

use crate::model::resolution::Resolution;
use crate::model::scene::{Draw, DrawPath, Impostors, LightingMode, Overlap, RUNGS, Scene};

/// Makes every pipeline that the scene may need, for each value that its "auto" knobs can take, and
/// returns the reports on them, each variant once. The device must have been opened for reports.
///
/// # Errors
/// Fails if the scene exceeds a limit of the device or a shader does not compile.
pub fn pipelines(context: &GpuContext, scene: &Scene) -> Result<Vec<PipelineReport>> {
    let mut all: Vec<PipelineReport> = Vec::new();
    context.device.take_pipeline_reports();
    let lit = lit_scenes(scene);
    let drawn = draws(scene.draw).into_iter().map(|draw| Scene { draw, ..lit[0].clone() });
    let others = lit[1..].iter().map(|scene| scene.exact().into_owned());
    for (i, scene) in drawn.chain(others).enumerate() {
        match Renderer::new(&context.device, context.compiler(), &scene, true) {
            Ok(renderer) => drop(renderer),
            // A setting that does not fit is not chosen; the exact one must fit.
            Err(Error::Limit { .. }) if i > 0 => {}
            Err(error) => return Err(error),
        }
        for report in context.device.take_pipeline_reports() {
            let is_same = |other: &PipelineReport| {
                other.pipeline == report.pipeline && other.variant == report.variant
            };
            if !all.iter().any(is_same) {
                all.push(report);
            }
        }
    }
    Ok(all)
}

/// Returns the scene in the light nearest to transport, then in all else that "auto" can take.
fn lit_scenes(scene: &Scene) -> Vec<Scene> {
    match scene.lighting.mode {
        LightingMode::Auto => RUNGS.iter().rev().map(|rung| scene.on(rung)).collect(),
        _ => vec![scene.clone()],
    }
}

/// Returns the exact settings, then one for each other value of an "auto" knob that changes
/// pipelines.
fn draws(draw: Draw) -> Vec<Draw> {
    let exact = draw.exact();
    let mut all = vec![exact];
    if draw.path == DrawPath::Auto && exact.path != DrawPath::Tiles {
        all.push(Draw { path: DrawPath::Tiles, ..exact });
    }
    if draw.overlap == Overlap::Auto && draw.path != DrawPath::Sprites {
        let tiles = Draw { path: DrawPath::Tiles, ..exact };
        for other in [Overlap::Thin, Overlap::Slices].map(|overlap| Draw { overlap, ..tiles }) {
            if !all.contains(&other) {
                all.push(other);
            }
        }
    }
    if draw.resolution == Resolution::Auto {
        let smaller = [Resolution::Half, Resolution::Quarter];
        let of = |base: &Draw| smaller.map(|resolution| Draw { resolution, ..*base });
        all = all.iter().flat_map(|base| [vec![*base], of(base).to_vec()].concat()).collect();
    }
    if draw.impostors == Impostors::Auto {
        all.push(Draw { impostors: Impostors::On, ..exact });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::choice::ASKED;

    #[test]
    fn every_value_of_an_auto_knob_is_made() {
        let auto = Draw { impostors: Impostors::Auto, ..ASKED };
        let found = draws(auto);
        let of =
            |path, resolution| found.iter().any(|d| d.path == path && d.resolution == resolution);
        for path in [DrawPath::Sprites, DrawPath::Tiles] {
            for resolution in [Resolution::Full, Resolution::Half, Resolution::Quarter] {
                assert!(of(path, resolution), "{path:?} {resolution:?}");
            }
        }
        assert!(found.iter().any(|d| d.impostors == Impostors::On));
        for overlap in [Overlap::Thin, Overlap::Slices] {
            assert!(found.iter().any(|d| d.overlap == overlap && d.path == DrawPath::Tiles));
        }
        assert!(found.iter().all(|d| d.exact() == *d));
        assert_eq!(draws(auto.exact()).len(), 1);
    }
}
