//! Distant scenes and late times.

use std::f64::consts::TAU;

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::StressContext;
use super::scenes::{LIT, UNLIT, blob_cluster, blob_scene, change_camera};
use crate::error::Result;
use crate::layout::particle::PlacedRecord;
use crate::model::cloud::Particle;
use crate::model::growth::Growth;
use crate::model::gust::{Gust, Mode};
use crate::model::scene::Scene;
use crate::reference::picture::FrameReference;
use crate::reference::rounding::{SINE_ERROR, U_F32};

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "space/far-exactly",
        what: "a lit scene moved by 2^23 along every axis: the same picture, to the byte",
        bound: "0",
        check: |ctx, c| {
            let scene = lit_cluster()?;
            let by = 2f64.powi(23);
            let other = moved(&scene, DVec3::new(by, -by, by));
            let (here, there) = (ctx.render(&scene, 0)?, ctx.render(&other, 0)?);
            c.same(&here.bytes, &there.bytes, "bytes of the picture");
            c.same(&here.placed, &there.placed, "positions");
            c.holds(here.bytes.iter().any(|b| *b != 0), "the picture is not empty");
            Ok(())
        },
    },
    Case {
        name: "space/far",
        what: "a lit scene moved by 1e7: the same positions but for the rounding of 1e7 in f64",
        bound: "2^-51 of 1e7, and u of the position",
        check: |ctx, c| {
            let scene = lit_cluster()?;
            let other = moved(&scene, DVec3::new(1e7, -1e7, 1e7));
            let (here, there) = (ctx.render(&scene, 0)?, ctx.render(&other, 0)?);
            same_positions(c, &there.placed, &here.placed, 2f64.powi(-51) * 1e7);
            c.finite(&there.rgba, "picture");
            Ok(())
        },
    },
    Case {
        name: "space/late-wind",
        what: "a cloud in the wind after 1e6 s: the positions relative to it as at 0",
        bound: "2^-50 of the drift, and u of the position",
        check: |ctx, c| {
            let mut scene = lit_cluster()?;
            scene.clouds[0].wind = DVec3::new(3.7, 0.1, -2.3);
            (scene.time.start_s, scene.time.step_s) = (0.0, 1e6);
            let (early, late) = (ctx.render(&scene, 0)?, ctx.render(&scene, 1)?);
            let drift = scene.clouds[0].wind.abs().max_element() * 1e6;
            same_positions(c, &late.placed, &early.placed, 2f64.powi(-50) * drift);
            Ok(())
        },
    },
    Case {
        name: "space/late-gust",
        what: "gusts after 1e6 s against f64",
        bound: "a wave's sine: 4 u and its argument's rounding; sums",
        check: |ctx, c| gusts(ctx, c, 1e6),
    },
    Case {
        name: "space/early-gust",
        what: "gusts at -1e6 s against f64",
        bound: "a wave's sine: 4 u and its argument's rounding; sums",
        check: |ctx, c| gusts(ctx, c, -1e6),
    },
    Case {
        name: "space/late-growth",
        what: "a cloud that has grown for 1e6 s: its final size, and positions as far apart",
        bound: "8 u of the position",
        check: |ctx, c| {
            let mut scene = blob_scene(UNLIT, "", blob_cluster(300))?;
            scene.clouds[0].growth = Growth { to: 2.5, time_s: 30.0 };
            scene.time.start_s = 1e6;
            let most = 2.5 * 4.0;
            positions(ctx, c, &scene, 0, |p| 8.0 * U_F32 * (p.length() + most))
        },
    },
    Case {
        name: "space/last-frame",
        what: "frame 2^32 - 1, alone",
        bound: "2^-50 of the drift, and u of the position",
        check: |ctx, c| {
            let mut scene = blob_scene(UNLIT, "", blob_cluster(200))?;
            scene.clouds[0].wind = DVec3::new(1e-3, 0.0, 0.0);
            scene.time.step_s = 1.0 / 60.0;
            let drift = scene.clouds[0].wind.x * scene.time.at(u32::MAX);
            let bound = |p: DVec3| 4.0 * U_F32 * p.abs().max_element() + 2f64.powi(-50) * drift;
            positions(ctx, c, &scene, u32::MAX, bound)
        },
    },
];

/// Returns the scene with every cloud, surface and camera moved.
fn moved(scene: &Scene, by: DVec3) -> Scene {
    let mut scene = scene.clone();
    scene.clouds.iter_mut().for_each(|c| c.position += by);
    scene.surfaces.iter_mut().for_each(|s| s.center += by);
    change_camera(&mut scene, |p| p + by);
    scene
}

/// Returns a lit cloud whose positions are exact in f64 even 2^23 away.
fn lit_cluster() -> Result<Scene> {
    let exact = |p: Particle| Particle { position: (p.position * 1024.0).round() / 1024.0, ..p };
    blob_scene(LIT, "", blob_cluster(200).into_iter().map(exact).collect())
}

/// Compares positions of two frames, each within 2 u of itself and `rounding`.
fn same_positions(
    c: &mut Comparison,
    found: &[PlacedRecord],
    expected: &[PlacedRecord],
    rounding: f64,
) {
    for (i, (a, b)) in expected.iter().zip(found).enumerate() {
        let bound = |truth: f64| 2.0 * U_F32 * truth.abs() + rounding;
        c.each(b.position, a.position, bound, format_args!("position of particle {i}"));
    }
}

/// Compares positions and sizes of a frame with the reference; `bound` returns the bound of a
/// position.
fn positions(
    ctx: &mut StressContext,
    c: &mut Comparison,
    scene: &Scene,
    i_frame: u32,
    bound: impl Fn(DVec3) -> f64,
) -> Result<()> {
    let truth = FrameReference::unlit(scene, scene.time.at(i_frame))?;
    let frame = ctx.render(scene, i_frame)?;
    for (i, (placed, blob)) in frame.placed.iter().zip(&truth.blobs).enumerate() {
        let at = format_args!("position of particle {i}");
        c.each(placed.position, blob.position.to_array(), |_| bound(blob.position), at);
        // Rounded, and multiplied by a rounded scale.
        let bound = 4.0 * U_F32 * blob.sigma;
        c.add(placed.sigma, blob.sigma, bound, format_args!("sigma of particle {i}"));
    }
    c.finite(&frame.rgba, "picture");
    Ok(())
}

fn gusts(ctx: &mut StressContext, c: &mut Comparison, time_s: f64) -> Result<()> {
    let mut scene = blob_scene(UNLIT, "", blob_cluster(400))?;
    scene.clouds[0].gust = Gust { amplitude: 0.4, length: 3.0, period_s: 7.0, n_waves: 24 };
    scene.time.start_s = time_s;
    let modes = scene.clouds[0].gust.modes(scene.clouds[0].seed);
    let bound = |p: DVec3| {
        // The phase is reduced in f64 and rounded once; k and a are rounded, and k·x has three
        // products and two sums.
        let wave = |m: &Mode| {
            let argument = m.k.abs().dot(p.abs() + DVec3::splat(2.0)) + TAU;
            m.a.length() * (SINE_ERROR + 10.0 * U_F32 * argument)
        };
        let sum: f64 = modes.iter().map(|m| m.a.length()).sum();
        modes.iter().map(wave).sum::<f64>()
            + (modes.len() as f64 + 4.0) * U_F32 * (p.length() + sum)
    };
    positions(ctx, c, &scene, 0, bound)
}
