//! Blobs of one step of a weather file as particles (model.md §15).

use glam::DVec3;
use sha2::{Digest, Sha256};

use super::wrf::{Clouds, Step, WeatherFile};
use crate::error::Result;
use crate::io::bounds::GREATEST;
use crate::model::cloud::{MIN_ASPECT, Particle, Shape};
use crate::model::terrain::Terrain;
use crate::model::weather::detail::{self, Detail};
use crate::model::weather::flow::{self, CarriedStep, Carrier, Flow, Winds};
use crate::model::weather::particles::{Layout, WeatherBlob};

/// How a scene shows a weather file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Step that time 0 shows.
    pub i_step: usize,
    /// Blobs that stand for the file's clouds.
    pub n_particles: u32,
    /// Heights over those of the file.
    pub exaggeration: f64,
    /// Seconds of the file in a second of the scene; 0: the step stands still.
    pub speed: f64,
    /// Modulation below the cells.
    pub detail: Detail,
}

/// Returns the note that the clouds of a file are not its own, if so.
pub fn note(file: &WeatherFile) -> Option<&'static str> {
    (file.clouds == Clouds::Diagnosed)
        .then_some("the file has no cloud water: its clouds are diagnosed from relative humidity")
}

/// Returns the blobs of a step, relative to sea level in the domain's middle: metres, x east, y up,
/// z south.
///
/// # Errors
/// When the step cannot be read.
pub fn particles(file: &WeatherFile, settings: &Settings, seed: u32) -> Result<Vec<Particle>> {
    let step = file.step(settings.i_step)?;
    let layout = Layout::new(&step.grid, &[&step.extinction], settings.n_particles as usize, seed);
    let mut blobs = layout.blobs(&step.grid, &step.extinction);
    let winds = winds_of(file, settings, &[settings.i_step])?;
    let life_s = life_s(std::slice::from_ref(&step), &winds);
    let carrier = winds.first().map_or(Carrier::NONE, |winds| {
        Carrier::Flow(Flow { winds: [winds; 2], weight: 0.0, life_s, time_s: 0.0 })
    });
    let spots = settings.detail.spots(&layout, &step.grid);
    let effects = settings.detail.effects(&spots, &layout, &step.grid, &carrier);
    detail::apply(&effects, &mut blobs, &layout);
    Ok(blobs
        .iter()
        .filter(|b| b.kappa > 0.0)
        .map(|blob| particle(blob, settings.exaggeration))
        .collect())
}

/// Reads the winds of some steps; none where they do not carry detail.
///
/// # Errors
/// When they cannot be read.
pub fn winds_of(file: &WeatherFile, settings: &Settings, i_steps: &[usize]) -> Result<Vec<Winds>> {
    let wanted = if settings.detail.is_in_winds() { i_steps } else { &[] };
    wanted.iter().map(|i| file.winds(*i)).collect()
}

/// Returns the life of detail in the winds of some steps, s.
pub fn life_s(steps: &[Step], winds: &[Winds]) -> f64 {
    let all: Vec<CarriedStep<'_>> = steps
        .iter()
        .zip(winds)
        .map(|(step, winds)| CarriedStep { grid: &step.grid, extinction: &step.extinction, winds })
        .collect();
    flow::life_s(&all)
}

/// Returns a blob with heights times `exaggeration` and κ divided by it, so that the optical depth
/// of every column stays.
pub fn particle(blob: &WeatherBlob, exaggeration: f64) -> Particle {
    let shape = DVec3::new(1.0, exaggeration, 1.0);
    let aspect = (blob.sigma_z * exaggeration / blob.sigma_xy).clamp(MIN_ASPECT, 1.0 / MIN_ASPECT);
    // Where the aspect is clamped, the mass stays.
    let kappa = blob.kappa * blob.sigma_z / (aspect * blob.sigma_xy);
    Particle {
        position: (blob.position * shape).clamp(DVec3::splat(-GREATEST), DVec3::splat(GREATEST)),
        sigma: blob.sigma_xy,
        shape: Shape::upright(aspect),
        kappa,
        color: DVec3::ONE,
    }
}

/// Returns the SHA-256 of the ground.
pub fn digest_of_ground(terrain: &Terrain) -> [u8; 32] {
    let mut hash = Sha256::new();
    terrain.points.iter().flat_map(|p| p.to_array()).for_each(|v| hash.update(v.to_le_bytes()));
    hash.finalize().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exaggerated_blobs_keep_their_mass_and_vertical_optical_depth() {
        let blob = WeatherBlob {
            position: DVec3::new(7.0, 300.0, -2.0),
            sigma_xy: 4000.0,
            sigma_z: 100.0,
            kappa: 0.02,
        };
        for (exaggeration, aspect) in [(1.0, 0.025), (10.0, 0.25), (0.01, 1e-3)] {
            let p = particle(&blob, exaggeration);
            assert!((p.shape.aspect / aspect - 1.0).abs() < 1e-12, "{p:?}");
            assert!((p.position - DVec3::new(7.0, 300.0 * exaggeration, -2.0)).length() < 1e-9);
            // κ σ_y is the optical depth of the vertical line through its centre, but for a
            // constant.
            assert!(
                (p.kappa * p.shape.aspect * p.sigma / (blob.kappa * blob.sigma_z) - 1.0).abs()
                    < 1e-12
            );
        }
    }
}
