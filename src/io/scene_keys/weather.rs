//! Keys of a `[[cloud]]` whose particles come from a weather file (model.md §15).

use std::sync::Arc;

use glam::DVec3;

use super::key::keys;
use super::spec::{Spec, integer, number, one_of, vector};
use crate::error::Result;
use crate::io::bounds::{Bounds, GREATEST};
use crate::io::document::section::Section;
use crate::io::weather::blobs::Settings;
use crate::io::weather::wrf::WeatherFile;
use crate::model::hills::MAX_POINTS;
use crate::model::scene::Simulate;
use crate::model::terrain::Terrain;
use crate::model::weather::detail::{Detail, Wind};

/// Most blobs of a file; a blob takes some 48 bytes.
const MOST_PARTICLES: u32 = 20_000_000;
/// Range of factors of heights.
pub const EXAGGERATION: Bounds = Bounds::Within(0.01, 100.0);
/// Range of winds, faster than any on earth.
const WIND: Bounds = Bounds::Within(-1000.0, 1000.0);
/// Greatest speed of weather: a day in a second.
const GREATEST_SPEED: f64 = 86_400.0;

fn wind() -> Spec<Wind> {
    let given = vector([0.0; 3], WIND).map(Wind::Given);
    one_of([0.0; 3], [("file".into(), Wind::OfFile)], Some(given))
}

keys! { DETAIL: pub fn detail(s, seed: u32) -> Detail { Detail;
    /// Strength of clouds' invented detail below the cells, a turbulence that keeps every cell's
    /// mass; 0: none.
    strength ["detail"]: number(0.0, Bounds::Within(0.0, 1.0));
    /// Velocity at which moving weather takes its detail along: east, up, south. "file": the winds
    /// of the file, U and V, which shape detail where weather stands still, too.
    wind ["detail_wind"]: wind(), "m/s";
    seed => seed;
}}

keys! { WEATHER: pub fn settings(s, last: u32, detail: Detail) -> Settings { Settings;
    detail => detail;
    /// Step of the file, from 0, that time 0 shows.
    i_step ["step"]: integer(0, 0, u32::MAX)
        => |_| integer(0, 0, last).map(|i| i as usize).take(s, "step");
    /// Blobs that stand for the file's clouds.
    n_particles ["particles"]: integer(20_000, 1, MOST_PARTICLES);
    /// Factor on heights.
    exaggeration: number(1.0, EXAGGERATION);
    /// Seconds of the file in a second of the scene; 0: the step stands still.
    speed: number(0.0, Bounds::Within(-GREATEST_SPEED, GREATEST_SPEED));
}}

/// Reads the keys that say how `file` is shown.
pub fn read_settings(
    s: &mut Section,
    file: &WeatherFile,
    simulate: Simulate,
    seed: u32,
) -> Result<Settings> {
    let last = u32::try_from(file.n_steps.saturating_sub(1)).unwrap_or(u32::MAX);
    let detail = detail(s, seed)?;
    if detail.is_in_winds() && !file.has_winds() {
        let what = "expected three numbers: \"file\" needs the variables U and V, and the file \
                    lacks one or both";
        return Err(s.fault("detail_wind", what));
    }
    let settings = settings(s, last, detail)?;
    if settings.speed != 0.0 && simulate == Simulate::Gpu {
        let what = "expected 0 where threads.simulate is \"gpu\", the default: it is the game \
                    thread that goes from step to step";
        return Err(s.fault("speed", what));
    }
    if settings.speed != 0.0 && settings.n_particles < 2 {
        let what = "expected 2 or more where `speed` is not 0: blobs of two steps fade into each \
                    other";
        return Err(s.fault("particles", what));
    }
    Ok(settings)
}

/// Returns the ground of a step (HGT) under a cloud at `origin`, with heights exaggerated like the
/// cloud's and `n_points` points a column along each side.
pub fn ground_of(
    s: &Section,
    file: &WeatherFile,
    settings: &Settings,
    origin: DVec3,
    (i_material, n_points): (usize, u32),
) -> Result<Terrain> {
    let (columns, rows) = (file.shape.nx, file.shape.ny);
    if columns < 2 || rows < 2 {
        let what = format!(
            "expected \"none\": the file has {columns} x {rows} columns, and ground lies between 2 \
             x 2 at least"
        );
        return Err(s.fault("ground", what));
    }
    let Some((ground, heights)) = file.terrain(settings.i_step)? else {
        return Err(s.fault("ground", "expected \"none\": the file has no variable HGT"));
    };
    let place = |(k, height): (usize, &f64)| {
        let y = height * settings.exaggeration;
        let place = DVec3::new(ground.east_m[k], y, ground.south_m[k]);
        place.clamp(DVec3::splat(-GREATEST), DVec3::splat(GREATEST))
    };
    let points = Arc::new(heights.iter().enumerate().map(place).collect());
    let n = [columns as u32, rows as u32];
    let most = n.into_iter().max().unwrap_or(0);
    let finest = (MAX_POINTS - 1) / (most - 1);
    if n_points > 1 && n_points > finest {
        let what = format!(
            "expected at most {}: ground of {most} columns has at most {MAX_POINTS} points a side",
            finest.max(1)
        );
        return Err(s.fault("ground_points", what));
    }
    Ok(Terrain { origin, points, n, i_material, ..Terrain::default() }.refined(n_points))
}
