//! Clouds as a medium: the records of a frame.

use std::sync::OnceLock;

use super::features::{has_diffusion, is_medium};
use crate::layout::diffusion::DiffusionParams;
use crate::layout::medium::MediumRecord;
use crate::model::cloud::{Cloud, Group};
use crate::model::grid::GridSpec;
use crate::model::medium::{MeanMedium, Medium};
use crate::model::scene::Scene;

/// Returns the medium of each cloud at `time_s`; none where clouds are not a medium.
pub(super) fn records(scene: &Scene, time_s: f64) -> Vec<MediumRecord> {
    let lighting = &scene.lighting;
    let of = |cloud: &Cloud| {
        let material = &scene.materials[cloud.i_material];
        MediumRecord::new(&Medium::new(material, time_s, lighting.forward), lighting)
    };
    if is_medium(scene) { scene.clouds.iter().map(of).collect() } else { vec![] }
}

/// The mean medium of clouds that no edit changes. Lists of particles make it slow to find.
#[derive(Debug, Default)]
pub(super) struct KeptMedium(OnceLock<MeanMedium>);

impl KeptMedium {
    /// Returns the numbers of diffusion at `time_s`; `None` without.
    pub fn params(
        &self,
        scene: &Scene,
        groups: &[Group],
        time_s: f64,
        grid: &GridSpec,
    ) -> Option<DiffusionParams> {
        if !has_diffusion(scene) {
            return None;
        }
        let is_edited = |c: &Cloud| scene.materials[c.i_material].is_edited();
        let at_time = || MeanMedium::new(scene, groups, time_s);
        let mean = match scene.clouds.iter().any(is_edited) {
            true => at_time(),
            false => *self.0.get_or_init(at_time),
        };
        Some(DiffusionParams::new(&mean, grid))
    }
}
