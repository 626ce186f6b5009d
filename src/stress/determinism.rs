//! The same bytes whatever way a frame is made: again, in workgroups of other sizes, on one thread
//! or two, with what is left out and without, alone or after others, from memory that holds NaN.

use super::case::{Case, Comparison, Found};
use super::desk::Desk;
use super::scenes::{LIT, heap, one_box, with_boxes};
use crate::error::Result;
use crate::frame::{FrameTimes, parallel, serial};
use crate::model::cloud::CloudSource;
use crate::model::gust::Gust;
use crate::model::scene::{Scene, Threading};
use crate::stress::scenes::cloud_of;

pub const CASES: &[Case] = &[
    Case {
        name: "determinism/runs",
        what: "a frame of everything, made twice",
        bound: "0: the same bytes",
        run: runs,
    },
    Case {
        name: "determinism/workgroups-32",
        what: "shaders that work by single records in workgroups of 32 and not 64",
        bound: "0: the same bytes",
        run: |desk| workgroups(desk, 32),
    },
    Case {
        name: "determinism/workgroups-128",
        what: "shaders that work by single records in workgroups of 128",
        bound: "0: the same bytes",
        run: |desk| workgroups(desk, 128),
    },
    Case {
        name: "determinism/threads",
        what: "six frames, game step and render step side by side and one after the other",
        bound: "0: the same bytes",
        run: threads,
    },
    Case {
        name: "determinism/skipping",
        what: "six frames with what they do not need left out, and with everything done",
        bound: "0: the same bytes",
        run: skipping,
    },
    Case {
        name: "determinism/alone",
        what: "a frame after five others, and the same one alone",
        bound: "0: the same bytes",
        run: alone,
    },
    Case {
        name: "determinism/poison",
        what: "buffers that hold NaN before anything is written to them, and others",
        bound: "0: the same bytes",
        run: poison,
    },
];

/// Boxes beside a list, gusts and wind, two reflections, a floor; drawn by `path`.
fn everything(desk: &Desk, path: &str) -> Result<Scene> {
    let text = LIT.replace("mode = 'first'", "mode = 'two-reflection'\nfacets_per_cloud = 48");
    let text = format!(
        "{text}[[surface]]\ncenter = [0, -3, 0]\nu = [0, 0, 4]\nv = [4, 0, 0]\nsubdivide = [3, \
         3]\nmaterial = 'cloud'\n\
         [time]\nstep_s = 0.25\n[draw]\npath = '{path}'\n"
    );
    let mut scene = with_boxes(
        desk,
        &text,
        vec![one_box(150, [2.0, 1.0, 2.0], 0.8), one_box(80, [1.0, 2.0, 1.0], 0.5)],
    )?;
    scene.clouds[0].gust = Gust { amplitude: 0.2, length: 2.0, period_s: 3.0, n_waves: 8 };
    let mut list = cloud_of(CloudSource::Particles(heap(60)));
    list.wind = glam::DVec3::new(0.3, 0.0, -0.1);
    scene.clouds.push(list);
    Ok(scene)
}

const PATHS: [&str; 2] = ["sprites", "tiles"];
const N_FRAMES: u32 = 6;

fn runs(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for path in PATHS {
        let scene = everything(desk, path)?;
        let (a, b) = (desk.play(&scene, 2)?, desk.play(&scene, 2)?);
        c.same(&a.bytes, &b.bytes, &format!("bytes, {path}"));
        c.same(&a.lit, &b.lit, &format!("lit facets, {path}"));
        c.holds(a.bytes.iter().any(|b| *b != 0), || format!("that something is drawn, {path}"));
    }
    Ok(c.into())
}

fn workgroups(desk: &mut Desk, n: u32) -> Result<Found> {
    let mut other = desk.in_workgroups_of(n)?;
    let mut c = Comparison::default();
    for path in PATHS {
        let scene = everything(desk, path)?;
        let (a, b) = (desk.play(&scene, 2)?, other.play(&scene, 2)?);
        c.same(&a.bytes, &b.bytes, &format!("bytes, {path}"));
        c.same(&a.particles, &b.particles, &format!("particles, {path}"));
        c.same(&a.lit, &b.lit, &format!("lit facets, {path}"));
    }
    other.close()?;
    Ok(c.into())
}

/// The bytes of every frame of a run.
fn frames(desk: &Desk, scene: &Scene, threading: Threading, skip: bool) -> Result<Vec<Vec<u8>>> {
    let mut player = desk.player(scene, skip)?;
    let mut all = Vec::new();
    let on_frame = &mut |_: FrameTimes, renderer: &mut crate::frame::render::Renderer| {
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

fn compare(desk: &Desk, a: (Threading, bool), b: (Threading, bool)) -> Result<Found> {
    let mut c = Comparison::default();
    for path in PATHS {
        let scene = everything(desk, path)?;
        let (a, b) = (frames(desk, &scene, a.0, a.1)?, frames(desk, &scene, b.0, b.1)?);
        for (i, (a, b)) in a.iter().zip(&b).enumerate() {
            c.same(a, b, &format!("bytes of frame {i}, {path}"));
        }
        c.holds(a.len() == N_FRAMES as usize && a[0] != a[1], || {
            "frames that differ from each other".to_owned()
        });
    }
    Ok(c.into())
}

fn threads(desk: &mut Desk) -> Result<Found> {
    compare(desk, (Threading::Serial, true), (Threading::Parallel, true))
}

fn skipping(desk: &mut Desk) -> Result<Found> {
    compare(desk, (Threading::Serial, true), (Threading::Serial, false))
}

fn alone(desk: &mut Desk) -> Result<Found> {
    let mut c = Comparison::default();
    for path in PATHS {
        let scene = everything(desk, path)?;
        let after = frames(desk, &scene, Threading::Serial, true)?;
        let alone = desk.play(&scene, N_FRAMES - 1)?;
        c.same(&after[N_FRAMES as usize - 1], &alone.bytes, &format!("bytes, {path}"));
    }
    Ok(c.into())
}

fn poison(desk: &mut Desk) -> Result<Found> {
    let mut poisoned = desk.poisoned()?;
    let mut c = Comparison::default();
    for path in PATHS {
        let scene = everything(desk, path)?;
        let (a, b) = (desk.play(&scene, 2)?, poisoned.play(&scene, 2)?);
        c.same(&a.bytes, &b.bytes, &format!("bytes, {path}"));
        c.same(&a.lit, &b.lit, &format!("lit facets, {path}"));
        c.add(b.n_odd() as f64, 0.0, 0.0, || format!("numbers that are not finite, {path}"));
    }
    poisoned.close()?;
    Ok(c.into())
}
