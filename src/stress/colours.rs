//! Colours toward the eye, by harmonics: special directions, and coefficients far apart.

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::StressContext;
use super::scenes::{MIDDLE, SPRITES, TILES, UNLIT, blob, blob_scene, change_camera};
use crate::error::Result;
use crate::model::cloud::CloudSource;
use crate::model::harmonics::{Coefficients, Harmonics, MAX_DEGREE, N_HARMONICS};
use crate::model::particle_list::ParticleList;
use crate::model::scene::Scene;
use crate::reference::harmonics::{color, rounding};

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[Case {
    name: "harmonics/directions",
    what: "an opaque blob seen along axes and diagonals; coefficients up to 1e15",
    bound: "that of the pass, 2^-22 of the colour",
    check: directions,
}];

/// Returns coefficients of every sign and of sizes around `size`.
fn coefficients(size: f64) -> Coefficients {
    let mut of = [[0.0; 3]; N_HARMONICS];
    for (k, own) in of.iter_mut().enumerate() {
        for (channel, v) in own.iter_mut().enumerate() {
            let some = (0.618 * (3 * k + channel) as f64).fract() - 0.5;
            *v = (size * if k == 0 { 1.0 + some } else { some }) as f32;
        }
    }
    of
}

/// Returns a scene of one opaque blob, seen from `eye`.
fn scene(path: &str, of: Coefficients, eye: DVec3) -> Result<Scene> {
    let mut scene = blob_scene(UNLIT, path, vec![])?;
    let blob = blob([0.0; 3], 0.5, 60.0);
    let harmonics = Harmonics { degree: MAX_DEGREE, by_particle: vec![of] };
    let list = ParticleList::with_harmonics(vec![blob], Some(harmonics));
    scene.clouds[0].source = CloudSource::Particles(list);
    // The camera of these scenes looks from (0, 0, 10) to the origin.
    change_camera(&mut scene, |v| if v == DVec3::ZERO { -eye } else { eye });
    Ok(scene)
}

fn directions(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let axes = [
        [1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0],
        [1.0, 1.0, 0.0],
        [-1.0, 0.0, 1.0],
        [1.0, -1.0, 1.0],
        [1e-9, 0.0, 1.0],
        [1e-9, 1e-9, -1.0],
        [1.0, 1e-9, -1e-9],
        // Up and down, as near as a camera comes.
        [1e-3, 1.0, 0.0],
        [0.0, -1.0, 1e-3],
    ];
    for (path, size) in [(SPRITES, 1.0), (TILES, 1e-15), (TILES, 1e15)] {
        let of = coefficients(size);
        for axis in axes.map(DVec3::from) {
            let eye = 10.0 * axis.normalize();
            let frame = ctx.render(&scene(path, of, eye)?, 0)?;
            let (truth, bound) = (color(&of, -eye.normalize()), rounding(&of));
            for k in 0..3 {
                let bound = bound[k] + 2f64.powi(-22) * truth[k];
                let at = format_args!("{path}, size {size:e}, seen from {eye}, channel {k}");
                c.add(frame.channel(MIDDLE, k), truth[k], bound, at);
            }
        }
    }
    Ok(())
}
