//! Clouds as a medium: even light, vanishing and huge optical depths, clouds that scatter nothing.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::case::{Case, Comparison};
use super::context::StressContext;
use super::scenes::{
    HEIGHT, SUN_ABOVE, WIDTH, blob, blob_cluster, cloud_of, floor, rectangle, surface_scene,
};
use crate::error::Result;
use crate::model::cloud::{CloudSource, Particle};
use crate::model::scene::{Draw, DrawPath, LightingMode, Overlap, Scene};
use crate::reference::picture::{Emitters, FrameReference, Pixels, drawn_by_settings};
use crate::reference::rounding::U_F32;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "scattering/furnace",
        what: "a white cloud in even light, of optical depth 1e-6 to 1e4, without and with white \
            floors: as bright as the light, by diffusion",
        bound: "128 u, relative: (cells across)^2 / 8",
        check: furnace,
    },
    Case {
        name: "scattering/thin",
        what: "a blob of optical depth 1e-12 in even light: as bright as the light, scattered once",
        bound: "16 u, relative",
        check: thin,
    },
    Case {
        name: "scattering/thick",
        what: "blobs of optical depth 1e5, in all modes: finite light, not negative, none beyond \
            the phase function's peak",
        bound: "finite, at least 0",
        check: thick,
    },
    Case {
        name: "scattering/black",
        what: "a cloud that scatters nothing, in all modes: no light at all",
        bound: "0",
        check: black,
    },
    Case {
        name: "scattering/forward",
        what: "a cloud that scatters straight on (g = 0.99 and 1), in all modes: finite light",
        bound: "finite, at least 0",
        check: forward,
    },
    Case {
        name: "scattering/barred",
        what: "a cloud and a floor under a roof that hides the sun, in all modes, with \
            factors of 0 on depths: no light at all",
        bound: "0",
        check: barred,
    },
    Case {
        name: "scattering/inside",
        what: "clouds of optical depth 1e-6 to 1e4 in the sun, by diffusion: the light inside of \
            blobs is that in f64",
        bound: "that of the drawing, and 1e-3 of the brightest blob",
        check: inside,
    },
];

/// Light of radiance 1/π from everywhere.
const EVEN: &str =
    "[[light]]\nkind = 'sky'\nirradiance = [1e-6, 1e-6, 1e-6]\nconstant = 1000000.0\n";
/// The share of it that comes from above alone.
const UNEVEN: f64 = 1e-6;
const SUN: &str = "[[light]]\nkind = 'directional'\ndirection = [-0.5, -0.8, -0.3]\n\
    irradiance = [1, 1, 1]\n";
/// Mean cosine of the phase function where nothing else is said.
const G: f64 = 0.85;
const MEDIA: [LightingMode; 4] = [
    LightingMode::Single,
    LightingMode::Similarity,
    LightingMode::Octaves,
    LightingMode::Diffusion,
];

fn scene(
    mode: LightingMode,
    lights: &str,
    material: &str,
    particles: Vec<Particle>,
) -> Result<Scene> {
    let lighting = "grid = 32\ndiffusion_cycles = 24";
    let mut scene = surface_scene(lighting, lights, material, [])?;
    scene.lighting.mode = mode;
    scene.clouds.push(cloud_of(CloudSource::Particles(particles.into())));
    Ok(scene)
}

fn cluster(tau: f64) -> Vec<Particle> {
    let white = |p: Particle| Particle { kappa: p.kappa * tau, color: DVec3::ONE, ..p };
    blob_cluster(60).into_iter().map(white).collect()
}

fn furnace(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const WHITE: &str = "kd = [1, 1, 1]\nalbedo = [1, 1, 1]\n";
    // In the box, just below it, and far below; none is under another.
    let places = [[0.0, -0.3, 0.0], [3.0, -2.0, 0.0], [-3.0, -6.0, 0.0]];
    let floors = places.map(|at| floor(at, 8)).to_vec();
    for (tau, surfaces) in
        [1e-6, 1.0, 1e4].into_iter().flat_map(|t| [(t, vec![]), (t, floors.clone())])
    {
        let mut scene = scene(LightingMode::Diffusion, EVEN, WHITE, cluster(tau))?;
        scene.surfaces = surfaces;
        for (bounces, cells, order) in [(0, 1, 1), (2, 1, 2), (2, 2, 1), (2, 2, 2)] {
            let of = &mut scene.lighting.diffusion;
            (of.bounces, of.bounce_cells, of.bounce_order) = (bounces, cells, order);
            let frame = ctx.render(&scene, 0)?;
            for (i, lit) in frame.lit.iter().enumerate() {
                let what = format_args!("radiance of facet {i}, depth {tau:e}, {bounces} bounces");
                // A change has that error, too.
                let n = 1.0 + f64::from(bounces);
                let bound = (n * 128.0 * U_F32 + 4.0 * UNEVEN) * FRAC_1_PI;
                c.add(f64::from(lit.first[0]), FRAC_1_PI, bound, what);
            }
        }
    }
    Ok(())
}

fn thin(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let one = vec![blob([0.0; 3], 0.5, 1e-12)];
    let scene = scene(LightingMode::Single, EVEN, "albedo = [1, 1, 1]\n", one)?;
    let frame = ctx.render(&scene, 0)?;
    let bound = (16.0 * U_F32 + UNEVEN) * FRAC_1_PI;
    c.add(f64::from(frame.lit[0].first[0]), FRAC_1_PI, bound, "radiance of the blob");
    Ok(())
}

/// Draws in all modes, and with bounces; light must be finite and not negative. Returns the
/// greatest radiance.
fn all_modes(
    ctx: &mut StressContext,
    c: &mut Comparison,
    (material, forward): (&str, f64),
    particles: &[Particle],
) -> Result<f64> {
    let lights = [EVEN, SUN].concat();
    let mut most = 0.0f64;
    let bounces = [1, 2].map(|order| (LightingMode::Diffusion, 2, order));
    let all = MEDIA.map(|mode| (mode, 0, 1)).into_iter().chain(bounces);
    for (mode, bounces, order) in all {
        let mut scene = scene(mode, &lights, material, particles.to_vec())?;
        scene.lighting.forward = forward;
        let of = &mut scene.lighting.diffusion;
        (of.bounces, of.bounce_order) = (bounces, order);
        let frame = ctx.render(&scene, 0)?;
        let mut light = frame.lit.iter().flat_map(|l| l.direct.into_iter().chain(l.first));
        let mode = mode.name();
        let what =
            format!("finite light, not negative, {mode}, {bounces} bounces of order {order}");
        c.holds(light.all(|v| v.is_finite() && v >= 0.0), what);
        c.finite(&frame.rgba, "picture");
        let radiance = frame.lit.iter().flat_map(|l| l.first).map(f64::from);
        most = radiance.fold(most, f64::max);
    }
    Ok(most)
}

fn thick(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    // Forward, and back.
    for (material, g) in [("albedo = [1, 1, 1]\n", G), ("albedo = [1, 1, 1]\nphase = -0.9\n", 0.9)]
    {
        let most = all_modes(ctx, c, (material, G), &cluster(1e5))?;
        // The sun's light at the phase function's peak, and the even light in eight octaves.
        let peak = (1.0 + g) / (4.0 * std::f64::consts::PI * (1.0 - g).powi(2));
        c.holds(most > 0.0, "light");
        c.add(most, 0.0, 2.0 * (peak + FRAC_1_PI), "the greatest radiance");
    }
    Ok(())
}

fn black(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let most = all_modes(ctx, c, ("albedo = [0, 0, 0]\n", G), &cluster(1.0))?;
    c.add(most, 0.0, 0.0, "radiance");
    Ok(())
}

fn forward(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    // A material's mean cosine is at most 0.99, and lighting.forward 1.
    for material in [("albedo = [1, 1, 1]\nphase = 0.99\n", G), ("albedo = [1, 1, 1]\n", 1.0)] {
        all_modes(ctx, c, material, &cluster(1.0))?;
        all_modes(ctx, c, material, &[blob([0.0; 3], 0.5, 1e4)])?;
    }
    Ok(())
}

fn barred(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for mode in MEDIA {
        let mut scene = scene(mode, SUN_ABOVE, "albedo = [1, 1, 1]\n", cluster(1.0))?;
        let flat = |y: f64, n: u32| rectangle([0.0, y, 0.0], [0.0, 0.0, 50.0], [50.0, 0.0, 0.0], n);
        scene.surfaces = vec![flat(-4.0, 8), flat(4.0, 1)];
        const N_FLOOR: usize = 64;
        (scene.lighting.forward, scene.lighting.octaves.depth) = (1.0, 0.0);
        let frame = ctx.render(&scene, 0)?;
        // The facets of the floor come first, and then the roof's, which the sun reaches.
        for (i, lit) in frame.lit.iter().enumerate().filter(|(i, _)| *i != N_FLOOR) {
            let light = lit.direct.into_iter().chain(lit.first).fold(0.0, f32::max);
            c.add(f64::from(light), 0.0, 0.0, format_args!("light of facet {i}, {}", mode.name()));
        }
    }
    Ok(())
}

fn inside(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    const WAYS: [(DrawPath, Overlap); 3] = [
        (DrawPath::Sprites, Overlap::Thin),
        (DrawPath::Tiles, Overlap::Thin),
        (DrawPath::Tiles, Overlap::Slices),
    ];
    for tau in [1e-6, 1.0, 1e4] {
        for (path, overlap) in WAYS {
            let mut scene =
                scene(LightingMode::Diffusion, SUN, "albedo = [1, 1, 1]\n", cluster(tau))?;
            scene.draw = Draw { path, overlap, ..scene.draw }.exact();
            let frame = ctx.render(&scene, 0)?;
            let truth = FrameReference::new(&scene, scene.time.at(0))?;
            let radiance = Emitters::radiance(&scene, &truth);
            let brightest = radiance.iter().map(|l| l.max_element()).fold(0.0, f64::max);
            let emitters = (&Emitters::new(&scene, &truth), &radiance[..]);
            let pixels = Pixels::all(WIDTH as u32, HEIGHT as u32);
            let (values, bounds) =
                drawn_by_settings(&scene, &truth, emitters, &pixels, DVec2::ZERO);
            let numbers = values.concat().into_iter().zip(bounds.concat());
            for (i, (found, (value, bound))) in frame.rgba.iter().zip(numbers).enumerate() {
                let what = format_args!("number {i}, {path:?}, {overlap:?}, depth {tau:e}");
                c.add(f64::from(*found), value, bound + 1e-3 * brightest, what);
            }
        }
    }
    Ok(())
}
