//! A cloud's keys where its particles come from a weather file (docs/model.md §15).

use std::sync::Arc;

use glam::DVec3;
use sha2::{Digest, Sha256};

use super::magnitude::GREATEST;
use super::toml_section::{Bounds, Section};
use super::weather::wrf::{Clouds, WeatherFile};
use crate::error::Result;
use crate::model::cloud::{MIN_ASPECT, Particle};
use crate::model::scene::Simulate;
use crate::model::terrain::Terrain;
use crate::model::weather::particles::{Layout, WeatherBlob};

/// Most blobs of a file: some 48 bytes each.
const MOST_PARTICLES: u32 = 20_000_000;

/// What a scene asks of a weather file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeatherKeys {
    pub i_step: usize,
    pub n_particles: u32,
    /// Heights over those of the file.
    pub exaggeration: f64,
    /// Seconds of the file in a second of the scene; 0: the step stands still.
    pub speed: f64,
}

/// A day in a second.
const GREATEST_SPEED: f64 = 86_400.0;

/// The keys but `file`, which `file` is.
pub fn read_keys(s: &mut Section, file: &WeatherFile, simulate: Simulate) -> Result<WeatherKeys> {
    let last = u32::try_from(file.n_steps.saturating_sub(1)).unwrap_or(u32::MAX);
    let i_step = s.u32("step", 0, 0, last)? as usize;
    let n_particles = s.u32("particles", 20_000, 1, MOST_PARTICLES)?;
    let exaggeration = s.f64("exaggeration", 1.0, Bounds::Within(0.01, 100.0))?;
    let speed = s.f64("speed", 0.0, Bounds::Within(-GREATEST_SPEED, GREATEST_SPEED))?;
    if speed != 0.0 && simulate == Simulate::Gpu {
        let what = "expected 0 where threads.simulate is \"gpu\", the default: it is the game \
            thread that goes from step to step";
        return Err(s.fault("speed", what));
    }
    if speed != 0.0 && n_particles < 2 {
        return Err(s.fault(
            "particles",
            "expected 2 or more where `speed` is not 0: blobs of two steps fade into each other",
        ));
    }
    Ok(WeatherKeys { i_step, n_particles, exaggeration, speed })
}

/// The ground of a step, HGT, under a cloud at `origin`, with heights as much exaggerated.
pub fn terrain(
    s: &mut Section,
    file: &WeatherFile,
    keys: &WeatherKeys,
    origin: DVec3,
    i_material: usize,
) -> Result<Terrain> {
    let (columns, rows) = (file.shape.nx, file.shape.ny);
    if columns < 2 || rows < 2 {
        let what = format!(
            "expected \"none\": the file has {columns} x {rows} columns, and ground lies between 2 \
             x 2 at least"
        );
        return Err(s.fault("ground", what));
    }
    let Some((ground, heights)) = file.terrain(keys.i_step)? else {
        return Err(s.fault("ground", "expected \"none\": the file has no variable HGT"));
    };
    let at = |(k, height): (usize, &f64)| {
        DVec3::new(ground.east_m[k], height * keys.exaggeration, ground.south_m[k])
    };
    let points = heights
        .iter()
        .enumerate()
        .map(at)
        .map(|p| p.clamp(DVec3::splat(-GREATEST), DVec3::splat(GREATEST)));
    let n = [columns as u32, rows as u32];
    Ok(Terrain { origin, points: Arc::new(points.collect()), n, i_material })
}

/// What whoever looks at the picture has to know of a cloud's file.
pub fn notes(file: &WeatherFile) -> Vec<String> {
    let diagnosed = || {
        "the file has no cloud water: its clouds are diagnosed from relative humidity".to_owned()
    };
    (file.clouds == Clouds::Diagnosed).then(diagnosed).into_iter().collect()
}

/// The blobs of a step, relative to sea level in the domain's middle: metres, x east, y up, z
/// south.
pub fn particles(file: &WeatherFile, keys: &WeatherKeys, seed: u32) -> Result<Vec<Particle>> {
    let step = file.step(keys.i_step)?;
    let layout = Layout::new(&step.grid, &[&step.extinction], keys.n_particles as usize, seed);
    let blobs = layout.blobs(&step.grid, &step.extinction);
    Ok(blobs
        .iter()
        .filter(|b| b.kappa > 0.0)
        .map(|blob| particle(blob, keys.exaggeration))
        .collect())
}

/// With heights so many times as great and κ as many times less: what a column takes of the light
/// stays.
pub fn particle(blob: &WeatherBlob, exaggeration: f64) -> Particle {
    let shape = DVec3::new(1.0, exaggeration, 1.0);
    let aspect = (blob.sigma_z * exaggeration / blob.sigma_xy).clamp(MIN_ASPECT, 1.0 / MIN_ASPECT);
    // Where the aspect is cut the mass stays.
    let kappa = blob.kappa * blob.sigma_z / (aspect * blob.sigma_xy);
    Particle {
        position: (blob.position * shape).clamp(DVec3::splat(-GREATEST), DVec3::splat(GREATEST)),
        sigma: blob.sigma_xy,
        aspect,
        kappa,
        color: DVec3::ONE,
    }
}

/// What a scene's hash knows of a file of which one step is drawn: the particles that it gave.
pub fn digest(particles: &[Particle]) -> [u8; 32] {
    let mut hash = Sha256::new();
    for p in particles {
        let [x, y, z] = p.position.to_array();
        [x, y, z, p.sigma, p.aspect, p.kappa].iter().for_each(|v| hash.update(v.to_le_bytes()));
    }
    hash.finalize().into()
}

/// And of its ground.
pub fn digest_of_ground(terrain: &Terrain) -> [u8; 32] {
    let mut hash = Sha256::new();
    terrain.points.iter().flat_map(|p| p.to_array()).for_each(|v| hash.update(v.to_le_bytes()));
    hash.finalize().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exaggerated_blobs_keep_their_mass_and_what_a_column_takes() {
        let blob = WeatherBlob {
            position: DVec3::new(7.0, 300.0, -2.0),
            sigma_xy: 4000.0,
            sigma_z: 100.0,
            kappa: 0.02,
        };
        for (exaggeration, aspect) in [(1.0, 0.025), (10.0, 0.25), (0.01, 1e-3)] {
            let p = particle(&blob, exaggeration);
            assert!((p.aspect / aspect - 1.0).abs() < 1e-12, "{p:?}");
            assert!((p.position - DVec3::new(7.0, 300.0 * exaggeration, -2.0)).length() < 1e-9);
            // kappa sigma_y, and so the depth of the vertical through its centre.
            assert!(
                (p.kappa * p.aspect * p.sigma / (blob.kappa * blob.sigma_z) - 1.0).abs() < 1e-12
            );
        }
    }
}
