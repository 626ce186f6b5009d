//! Frames that must have the same bytes however they are computed.
//!
//! The variants are: repeated, other workgroup sizes, one or two threads, with and without
//! skipping, alone or in sequence, guarded memory.

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::StressContext;
use super::scenes::{LIT, PATHS, blob_cluster, box_scene, centred_box, cloud_of};
use crate::error::Result;
use crate::frame::{FrameTimes, Renderer, parallel, serial};
use crate::model::cloud::CloudSource;
use crate::model::gust::Gust;
use crate::model::scene::{Scene, Threading};

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "determinism/runs",
        what: "a frame with every feature, rendered twice",
        bound: "0: the same bytes",
        check: |ctx, c| {
            for path in PATHS {
                let scene = full_scene(path)?;
                let (a, b) = (ctx.render(&scene, 2)?, ctx.render(&scene, 2)?);
                c.same(&a.bytes, &b.bytes, format_args!("bytes, {path}"));
                c.same(&a.lit, &b.lit, format_args!("lit facets, {path}"));
                let is_drawn = a.bytes.iter().any(|b| *b != 0);
                c.holds(is_drawn, format_args!("the picture is not empty, {path}"));
            }
            Ok(())
        },
    },
    Case {
        name: "determinism/workgroups-32",
        what: "shaders that treat single records, in workgroups of 32 instead of 64",
        bound: "0: the same bytes",
        check: |ctx, c| {
            let other = ctx.with_workgroup_size(32)?;
            same_on(ctx, c, other)
        },
    },
    Case {
        name: "determinism/workgroups-128",
        what: "shaders that treat single records, in workgroups of 128 instead of 64",
        bound: "0: the same bytes",
        check: |ctx, c| {
            let other = ctx.with_workgroup_size(128)?;
            same_on(ctx, c, other)
        },
    },
    Case {
        name: "determinism/threads",
        what: "six frames, with game step and render step in parallel and in sequence",
        bound: "0: the same bytes",
        check: |ctx, c| same_frames(ctx, c, (Threading::Serial, true), (Threading::Parallel, true)),
    },
    Case {
        name: "determinism/skipping",
        what: "six frames with skipping of unchanged passes and without",
        bound: "0: the same bytes",
        check: |ctx, c| same_frames(ctx, c, (Threading::Serial, true), (Threading::Serial, false)),
    },
    Case {
        name: "determinism/alone",
        what: "a frame after five others, and the same frame alone",
        bound: "0: the same bytes",
        check: |ctx, c| {
            for path in PATHS {
                let scene = full_scene(path)?;
                let all = frames(ctx, &scene, Threading::Serial, true)?;
                let alone = ctx.render(&scene, N_FRAMES - 1)?;
                let last = &all[N_FRAMES as usize - 1];
                c.same(last, &alone.bytes, format_args!("bytes, {path}"));
            }
            Ok(())
        },
    },
    Case {
        name: "determinism/guard",
        what: "buffers full of NaN with guard bands behind them, and buffers without",
        bound: "0: the same bytes",
        check: |ctx, c| {
            let guarded = ctx.with_options(|options| options.guard = true)?;
            same_on(ctx, c, guarded)
        },
    },
    Case {
        name: "determinism/parts",
        what: "work submitted in parts of 0.2 ms, and in one submission a frame",
        bound: "0: the same bytes",
        check: |ctx, c| {
            let parted = ctx.with_options(|options| options.max_submit_ms = Some(0.2))?;
            same_on(ctx, c, parted)
        },
    },
];

const N_FRAMES: u32 = 6;

/// Returns a scene with boxes, a list of particles, gusts, wind, two reflections and a floor.
fn full_scene(path: &str) -> Result<Scene> {
    let text = LIT.replace("mode = 'first'", "mode = 'two-reflection'\nfacets_per_cloud = 48");
    let text = format!(
        "{text}[[surface]]\ncenter = [0, -3, 0]\nu = [0, 0, 4]\nv = [4, 0, 0]\n\
         subdivide = [3, 3]\nmaterial = 'cloud'\n[time]\nstep_s = 0.25\n[draw]\n{path}\n"
    );
    let boxes = vec![centred_box(150, [2.0, 1.0, 2.0], 0.8), centred_box(80, [1.0, 2.0, 1.0], 0.5)];
    let mut scene = box_scene(&text, boxes)?;
    scene.clouds[0].gust = Gust { amplitude: 0.2, length: 2.0, period_s: 3.0, n_waves: 8 };
    let mut list = cloud_of(CloudSource::Particles(blob_cluster(60).into()));
    list.wind = DVec3::new(0.3, 0.0, -0.1);
    scene.clouds.push(list);
    Ok(scene)
}

/// Compares a frame with that of another context.
fn same_on(ctx: &mut StressContext, c: &mut Comparison, mut other: StressContext) -> Result<()> {
    for path in PATHS {
        let scene = full_scene(path)?;
        let (a, b) = (ctx.render(&scene, 2)?, other.render(&scene, 2)?);
        c.same(&a.bytes, &b.bytes, format_args!("bytes, {path}"));
        c.same(&a.particles, &b.particles, format_args!("particles, {path}"));
        c.same(&a.lit, &b.lit, format_args!("lit facets, {path}"));
        c.finite(&b.rgba, path);
    }
    other.close()
}

/// Returns the bytes of every frame of a run.
fn frames(
    ctx: &StressContext,
    scene: &Scene,
    threading: Threading,
    skip: bool,
) -> Result<Vec<Vec<u8>>> {
    let mut player = ctx.player(scene, skip)?;
    let mut all = Vec::new();
    let on_frame = &mut |_: FrameTimes, renderer: &mut Renderer| {
        all.push(renderer.image_bytes()?);
        Ok(true)
    };
    let (game, renderer) = (&mut player.game, &mut player.renderer);
    match threading {
        Threading::Serial => serial::run(game, renderer, 0..N_FRAMES, on_frame)?,
        Threading::Parallel => parallel::run(game, renderer, 0..N_FRAMES, on_frame)?,
    }
    Ok(all)
}

/// Compares the frames of two runs, each given by its threading and whether it skips passes.
fn same_frames(
    ctx: &StressContext,
    c: &mut Comparison,
    a: (Threading, bool),
    b: (Threading, bool),
) -> Result<()> {
    for path in PATHS {
        let scene = full_scene(path)?;
        let (a, b) = (frames(ctx, &scene, a.0, a.1)?, frames(ctx, &scene, b.0, b.1)?);
        for (i, (a, b)) in a.iter().zip(&b).enumerate() {
            c.same(a, b, format_args!("bytes of frame {i}, {path}"));
        }
        c.holds(a.len() == N_FRAMES as usize && a[0] != a[1], "the frames of a run differ");
    }
    Ok(())
}
