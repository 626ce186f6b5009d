//! Extreme cameras and render targets.

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::StressContext;
use super::scenes::{
    MIDDLE, PATHS, SPRITES, UNLIT, blob, blob_cluster, blob_scene, box_scene, centred_box,
    render_blobs,
};
use crate::error::{Error, Result};
use crate::model::cloud::Particle;
use crate::reference::rounding::U_F32;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "space/narrow",
        what: "a field of view of 1 degree: the middle pixel has the blob's opacity",
        bound: "1e-6 + 24 u, relative",
        check: |ctx, c| view(ctx, c, 1.0),
    },
    Case {
        name: "space/wide",
        what: "a field of view of 179 degrees: the middle pixel has the blob's opacity",
        bound: "1e-6 + 24 u, relative",
        check: |ctx, c| view(ctx, c, 179.0),
    },
    Case {
        name: "space/near-plane",
        what: "wide blobs with centres on either side of the near plane, 1e-5 of its distance \
            away",
        bound: "0: drawn or not; finite",
        check: near_plane,
    },
    Case {
        name: "space/eye-inside",
        what: "an eye amid blobs of sizes from 1e-3 to 1e3",
        bound: "finite; alpha within 0 and 1",
        check: eye_inside,
    },
    Case {
        name: "space/one-pixel",
        what: "a target of one pixel, as sprites and in tiles",
        bound: "1e-6 + 24 u, relative",
        check: |ctx, c| middle(ctx, c, &sized(1, 1), 0),
    },
    Case {
        name: "space/long-targets",
        what: "targets of 8191 x 1 and 1 x 8191 pixels: a blob in the middle, empty ends",
        bound: "0: finite; drawn in the middle alone",
        check: long_targets,
    },
    Case {
        name: "space/large-target",
        what: "an 8-bit target of 8192 x 8192 pixels: drawn at the blob, or refused with the \
            exceeded limit",
        bound: "0",
        check: large_target,
    },
    Case {
        name: "space/no-camera",
        what: "cameras with NaN, infinite positions, no direction, or a vertical direction: an \
            error and no frame",
        bound: "an error",
        check: no_camera,
    },
];

/// Returns the unlit scene with another picture size.
fn sized(width: usize, height: usize) -> String {
    UNLIT
        .replace("width = 65", &format!("width = {width}"))
        .replace("height = 49", &format!("height = {height}"))
}

/// Compares a pixel through the centre of a blob with the blob's opacity, by both paths.
fn middle(ctx: &mut StressContext, c: &mut Comparison, text: &str, i_pixel: usize) -> Result<()> {
    const TAU: f64 = 0.8;
    // The error of 1 - e^-t; two products and two roundings of the depth, and an exponential of
    // nearly 0.
    const RELATIVE: f64 = 1e-6 + 24.0 * U_F32;
    let truth = -(-TAU).exp_m1();
    for path in PATHS {
        let frame = render_blobs(ctx, text, path, vec![blob([0.0; 3], 0.5, TAU)])?;
        let at = format_args!("alpha, {path}");
        c.add(frame.channel(i_pixel, 3), truth, RELATIVE * truth, at);
        c.finite(&frame.rgba, path);
    }
    Ok(())
}

fn view(ctx: &mut StressContext, c: &mut Comparison, fov_y_deg: f64) -> Result<()> {
    let text = UNLIT.replace("target", &format!("fov_y_deg = {fov_y_deg:?}\ntarget"));
    middle(ctx, c, &text, MIDDLE)
}

fn near_plane(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for path in PATHS {
        for near in [0.01, 1.0, 7.0] {
            let text = UNLIT.replace("target", &format!("near = {near:?}\ntarget"));
            for (beyond, is_visible) in [(1e-5, true), (-1e-5, false)] {
                let z = 10.0 - near * (1.0 + beyond);
                let blobs = vec![blob([0.0, 0.0, z], 2.0, 1.0)];
                let frame = render_blobs(ctx, &text, path, blobs)?;
                let is_drawn = frame.rgba.iter().any(|v| *v != 0.0);
                let at = format_args!("{path}, near {near}, {beyond:e} beyond it");
                c.holds(is_drawn == is_visible, format_args!("drawn {is_drawn}, {at}"));
                c.finite(&frame.rgba, at);
            }
        }
    }
    Ok(())
}

fn eye_inside(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for path in PATHS {
        for sigma in [1e-3, 0.1, 1.0, 30.0, 1e3] {
            let around = |p: Particle| Particle {
                sigma,
                kappa: 0.3 / sigma,
                position: p.position + DVec3::Z * 10.0,
                ..p
            };
            let blobs = blob_cluster(60).into_iter().map(around).collect();
            let frame = render_blobs(ctx, UNLIT, path, blobs)?;
            c.finite(&frame.rgba, format_args!("{path}, sigma {sigma}"));
            let is_alpha = frame.rgba.chunks_exact(4).all(|p| (0.0..=1.0).contains(&p[3]));
            c.holds(is_alpha, format_args!("alpha within 0 and 1, {path}, sigma {sigma}"));
        }
    }
    Ok(())
}

fn long_targets(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for path in PATHS {
        for (width, height) in [(8191, 1), (1, 8191)] {
            let blobs = vec![blob([0.0; 3], 0.5, 2.0)];
            let frame = render_blobs(ctx, &sized(width, height), path, blobs)?;
            let alpha = |i: usize| frame.channel(i, 3);
            let at = format_args!("{path}, {width} x {height}");
            c.finite(&frame.rgba, at);
            c.holds(alpha(4095) > 0.5, format_args!("a blob in the middle, {at}"));
            c.holds(alpha(0) == 0.0 && alpha(8190) == 0.0, format_args!("empty ends, {at}"));
        }
    }
    Ok(())
}

fn large_target(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const SIDE: usize = 8192;
    let text = sized(SIDE, SIDE).replace("rgba32f", "rgba8");
    let scene = blob_scene(&text, SPRITES, vec![blob([0.0; 3], 0.01, 50.0)])?;
    let mut player = match ctx.player(&scene, false) {
        Ok(player) => player,
        Err(Error::Limit { what }) => {
            c.holds(true, "refused with the exceeded limit");
            c.remark(format!("refused: {what}"));
            return Ok(());
        }
        Err(error) => return Err(error),
    };
    let packet = player.game.step(0)?;
    player.renderer.step(packet)?;
    let bytes = player.renderer.image_bytes()?;
    let alpha = |i: usize, j: usize| bytes[4 * (j * SIDE + i) + 3];
    c.exact(alpha(SIDE / 2, SIDE / 2), 255.0, "alpha in the middle");
    for (i, j) in [(0, 0), (SIDE - 1, 0), (0, SIDE - 1), (SIDE - 1, SIDE - 1)] {
        c.exact(alpha(i, j), 0.0, format_args!("alpha in the corner {i}, {j}"));
    }
    Ok(())
}

fn no_camera(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let cameras = [
        (DVec3::new(f64::NAN, 0.0, 0.0), DVec3::ZERO, "a position of NaN"),
        (DVec3::new(f64::INFINITY, 0.0, 0.0), DVec3::ZERO, "an infinite position"),
        (DVec3::Z, DVec3::splat(f64::NAN), "a target of NaN"),
        (DVec3::Z, DVec3::Z, "no direction"),
        (DVec3::ZERO, DVec3::Y, "a vertical direction"),
    ];
    for (position, target, what) in cameras {
        let mut scene = box_scene(UNLIT, vec![centred_box(10, [1.0; 3], 1.0)])?;
        for key in &mut scene.camera.keys {
            (key.position, key.target) = (position, target);
        }
        let frame = ctx.player(&scene, false).and_then(|mut player| player.game.step(0));
        // Exit code 2 is bad input, not a fault of the device.
        let is_refused = frame.is_err_and(|e| e.exit_code() == 2);
        c.holds(is_refused, format_args!("a camera with {what} is refused"));
    }
    Ok(())
}
