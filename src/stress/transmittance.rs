//! Light through clouds: vanishing and huge optical depths, grids without extent, lamps inside
//! blobs, rays along cell faces.

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::{DeviceFrame, StressContext};
use super::scenes::{GREY, SUN_ABOVE, blob, blob_cluster, cloud_of, rectangle, sun, surface_scene};
use crate::error::Result;
use crate::model::cloud::{CloudSource, Particle};
use crate::model::scene::{LightingMode, Scene};
use crate::reference::rounding::U_F32;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "transmittance/thin",
        what: "a floor under a cloud of optical depth 1e-12: as bright as without it",
        bound: "1e-12 and 4 u, relative",
        check: |ctx, c| under(ctx, c, 1e-12, 1.0, 4.0 * U_F32 + 1e-12),
    },
    Case {
        name: "transmittance/thick",
        what: "a floor under a cloud of optical depth 1e5: dark in the middle, finite values",
        bound: "2^-126",
        check: |ctx, c| under(ctx, c, 1e5, 0.0, f32::MIN_POSITIVE.into()),
    },
    Case {
        name: "transmittance/forward",
        what: "a cloud of optical depth 1e5 that scatters forward only (g = 1): as bright as \
            without it",
        bound: "4 u, relative",
        check: |ctx, c| {
            let blobs = vec![blob([0.0; 3], 0.5, 1e5)];
            let frame = ctx.render(&floor_under("forward = 1.0", SUN_ABOVE, blobs)?, 0)?;
            let found = direct(c, &frame);
            c.add(found, 1.0, 4.0 * U_F32, "irradiance of the floor");
            Ok(())
        },
    },
    Case {
        name: "transmittance/no-extent",
        what: "a cloud of one blob without size: a grid without extent",
        bound: "4 u, relative",
        check: no_extent,
    },
    Case {
        name: "transmittance/flat-grid",
        what: "blobs in a plane, a thousand times as wide as thick: no more light than without \
            them",
        bound: "4 u, relative",
        check: flat_grid,
    },
    Case {
        name: "transmittance/inside",
        what: "a lamp in the middle of a blob: e^-tau of half its depth, with cells of a \
            sixteenth of sigma",
        bound: "0.58 % of it: cells' means for the blob, cut at 3 sigma",
        check: inside,
    },
    Case {
        name: "transmittance/along-faces",
        what: "rays along an axis and along faces of the grid's cells: transmittance within 0 \
            and 1",
        bound: "4 u",
        check: along_faces,
    },
    Case {
        name: "transmittance/proportional",
        what: "extinction from 1e-6 to 1e4: proportional optical depths of every ray",
        bound: "3 + 2x ulp of e^-x, and 16 u of x",
        check: proportional,
    },
];

/// Keys of `[lighting]` for a medium without forward scattering, whose scattered light is lost.
const NO_FORWARD: &str = "forward = 0.0";

/// Returns a small floor of one facet 3 below the origin and a cloud of particles above it.
fn floor_under(lighting: &str, lights: &str, particles: Vec<Particle>) -> Result<Scene> {
    let floor = rectangle([0.0, -3.0, 0.0], [0.0, 0.0, 5e-4], [5e-4, 0.0, 0.0], 1);
    let lighting = format!("grid = 48\n{lighting}");
    let mut scene = surface_scene(&lighting, lights, GREY, [floor])?;
    scene.lighting.mode = LightingMode::First;
    scene.clouds.push(cloud_of(CloudSource::Particles(particles.into())));
    Ok(scene)
}

/// Checks that all light is finite and not negative, and returns I_d of the floor.
fn direct(c: &mut Comparison, frame: &DeviceFrame) -> f64 {
    let mut light = frame.lit.iter().flat_map(|l| l.direct.into_iter().chain(l.first));
    c.holds(light.all(|v| v.is_finite() && v >= 0.0), "finite light, not negative");
    f64::from(frame.lit[0].direct[0])
}

/// Checks that no facet receives more light than without a cloud.
fn at_most_unshadowed(c: &mut Comparison, frame: &DeviceFrame, what: &str) {
    for (i, lit) in frame.lit.iter().enumerate() {
        let beyond = (f64::from(lit.direct[0]) - 1.0).max(0.0);
        c.add(beyond, 0.0, 4.0 * U_F32, format_args!("excess light of facet {i}, {what}"));
    }
}

fn under(
    ctx: &mut StressContext,
    c: &mut Comparison,
    tau: f64,
    truth: f64,
    bound: f64,
) -> Result<()> {
    let scene = floor_under(NO_FORWARD, SUN_ABOVE, vec![blob([0.0; 3], 0.5, tau)])?;
    let frame = ctx.render(&scene, 0)?;
    let found = direct(c, &frame);
    c.add(found, truth, bound, "irradiance of the floor");
    c.finite(&frame.rgba, "picture");
    Ok(())
}

fn no_extent(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for at in [[0.0; 3], [0.0, 1e-3, 0.0], [1e6, -2.0, 5.0]] {
        let point = Particle { sigma: 0.0, kappa: 1.0, ..blob(at, 1.0, 1.0) };
        let frame = ctx.render(&floor_under(NO_FORWARD, SUN_ABOVE, vec![point])?, 0)?;
        let found = direct(c, &frame);
        c.add(found, 1.0, 4.0 * U_F32, format_args!("irradiance of the floor, a point at {at:?}"));
        c.finite(&frame.rgba, format_args!("a point at {at:?}"));
    }
    Ok(())
}

fn flat_grid(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let flat = blob_cluster(300).into_iter().map(|p| Particle {
        position: p.position * DVec3::new(500.0, 0.0, 500.0),
        sigma: 0.5,
        kappa: 2.0,
        ..p
    });
    let frame = ctx.render(&floor_under(NO_FORWARD, SUN_ABOVE, flat.collect())?, 0)?;
    direct(c, &frame);
    let has = |is: fn(f32) -> bool| frame.lit.iter().any(|l| is(l.direct[0]));
    c.holds(has(|v| v > 0.1) && has(|v| v < 0.9), "light and shadow");
    at_most_unshadowed(c, &frame, "flat grid");
    Ok(())
}

fn inside(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const TAU: f64 = 1.6;
    let lamp =
        "[[light]]\nkind = 'point'\nposition = [0, 0, 0]\nintensity = [1, 1, 1]\nradius = 0.01\n";
    // The blob's box is 6 sigma wide: 96 cells are 16 per sigma.
    let mut scene = floor_under(NO_FORWARD, lamp, vec![blob([0.0; 3], 0.5, TAU)])?;
    (scene.lighting.grid, scene.lighting.step) = (96, 0.5);
    let frame = ctx.render(&scene, 0)?;
    // 3 below the lamp: 1/9, through half of the blob.
    let tau = -(9.0 * direct(c, &frame)).ln();
    c.add(tau, 0.5 * TAU, 0.0058 * 0.5 * TAU, "optical depth from the middle");
    Ok(())
}

fn along_faces(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    // A grid of 48 cells over a box of side 6: faces lie at multiples of 1/8.
    let corners =
        [-1.0, 1.0].map(|s| Particle { kappa: 0.4, ..blob([2.5 * s; 3], 1.0 / 6.0, 1.0) });
    let particles: Vec<Particle> = corners.into_iter().chain(blob_cluster(100)).collect();
    for direction in [
        "[0, -1, 0]",
        "[1, 0, 0]",
        "[0, 0, -1]",
        "[-1, 0, 0]",
        "[0, 1, 0]",
        "[1, 1, 0]",
        "[-1, -1, -1]",
    ] {
        let lights = sun(direction);
        for offset in [0.0, 0.125, 0.0625, 3.0] {
            let mut scene = floor_under(NO_FORWARD, &lights, particles.clone())?;
            let (at, y, z) = ([offset, -offset, 0.0], [0.0, 0.0, 0.5], [0.5, 0.0, 0.0]);
            scene.surfaces = vec![rectangle(at, y, z, 4), rectangle(at, z, y, 4)];
            let frame = ctx.render(&scene, 0)?;
            direct(c, &frame);
            let is_lit = frame.lit.iter().any(|l| l.direct[0] > 1e-3);
            c.holds(is_lit || offset > 1.0, format_args!("some light along {direction}"));
            at_most_unshadowed(c, &frame, direction);
        }
    }
    Ok(())
}

fn proportional(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let mut before: Vec<f64> = Vec::new();
    for k in 0..=20 {
        let tau = 1e-6 * 10f64.powf(f64::from(k) / 2.0);
        let particles = blob_cluster(60)
            .into_iter()
            .map(|p| blob(p.position.to_array(), p.sigma, tau))
            .collect();
        let mut scene = floor_under(NO_FORWARD, SUN_ABOVE, particles)?;
        scene.surfaces = vec![rectangle([0.0, -3.0, 0.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], 8)];
        let frame = ctx.render(&scene, 0)?;
        direct(c, &frame);
        // The floor's facets; those of the blobs are not compared.
        let depths: Vec<f64> =
            frame.lit[..64].iter().map(|l| -f64::from(l.direct[0]).ln()).collect();
        for (i, (now, before)) in depths.iter().zip(&before).enumerate() {
            let truth = 10f64.sqrt() * before;
            let at = format_args!("depth over facet {i} at optical depth {tau:e}");
            // V is off by 3 + 2x ulp, 2 u each, and by u of energy and cosine: x by as much; the
            // march by 16 u of itself.
            let off = |x: f64| (8.0 + 20.0 * x) * U_F32 * if x < 1e-3 { 2.0 } else { 1.0 };
            if truth < 60.0 {
                c.add(*now, truth, off(*now) + 10f64.sqrt() * off(*before), at);
            } else {
                c.holds(*now > 55.0, at);
            }
        }
        before = depths;
    }
    let has = |is: fn(f64) -> bool| before.iter().any(|d| is(*d));
    c.holds(has(|d| d > 55.0) && has(|d| d < 1.0), "shadow and light");
    Ok(())
}
