//! `nimbus render SCENE --reference WHICH -o FILE`: the frame in f64, without a device.

use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};

use super::args::RenderArgs;
use super::output::{self, LateProgress, Spinner};
use super::render::not_finite;
use super::say_sizes;
use crate::error::Result;
use crate::io::atomic;
use crate::io::image::{self, image_hash};
use crate::model::film::FilmFormat;
use crate::model::scene::Scene;
use crate::reference::picture::{
    self, BlobModel, DrawnPicture, Pixels, ReferenceKind, ReferenceRequest, RenderStage,
    drawn_as_set,
};

/// The picture of `reference`, of so many samples as were asked for.
pub fn run(args: &RenderArgs, reference: ReferenceKind, scene: &Scene, time_s: f64) -> Result<()> {
    // What may take minutes is not begun where it could not be kept.
    atomic::check_place(&args.output)?;
    if args.options.verbose {
        say_sizes(scene, None);
    }
    match reference {
        ReferenceKind::Thin if args.samples == 1 => {
            centered(args, reference, BlobModel::Thin, scene, time_s)
        }
        ReferenceKind::Volume if args.samples == 1 => {
            centered(args, reference, BlobModel::Volume, scene, time_s)
        }
        _ => sampled(args, reference, scene, time_s),
    }
}

/// Of one sample, and what of the drawing there is to be said.
fn centered(
    args: &RenderArgs,
    reference: ReferenceKind,
    drawing: BlobModel,
    scene: &Scene,
    time_s: f64,
) -> Result<()> {
    let shown = Progress::new(args.options.quiet);
    let DrawnPicture { rgba, error, brightest, n_particles, omitted } =
        drawn_as_set(scene, time_s, drawing, &|work, n| shown.hear(work, n))?;
    drop(shown);
    if let Some(error) = error.filter(|_| args.options.verbose) {
        eprintln!(
            "error of the integral: at most about {error:.1e}; the brightest particle has \
             {brightest:.3e}"
        );
    }
    let share = (drawing == BlobModel::Thin).then(|| omitted.share());
    if let Some(share) = share.filter(|_| args.options.verbose && scene.draw.threshold.is_active())
    {
        let n = omitted.n_layers;
        eprintln!(
            "draw.threshold cuts {n} layers of a pixel at most, and changes it by at most \
             {share:.1e} of the radiances"
        );
    }
    let more = json!({
        "particles": n_particles, "error": error, "brightest": brightest,
        "layers_cut": share.map(|_| omitted.n_layers), "cut_changes": share,
    });
    write((args, reference), scene, time_s, &rgba, more)
}

/// Of any number of samples, in the order and with the sums that parts of it have.
fn sampled(args: &RenderArgs, reference: ReferenceKind, scene: &Scene, time_s: f64) -> Result<()> {
    let (film, never) = (scene.film, AtomicBool::new(false));
    let pixels = Pixels::all(film.width, film.height);
    let shown = Progress::new(args.options.quiet);
    let subject = ReferenceRequest { kind: reference, scene, time_s };
    let sums =
        picture::sums(&subject, &pixels, 0..args.samples, &never, &|work, n| shown.hear(work, n))?;
    drop(shown);
    let mean = sums.mean();
    let accuracy = reference.accuracy_text(scene, args.samples);
    if args.options.verbose {
        eprintln!(
            "off by about {:.1e} (root mean square of the pixels' estimates; {accuracy})",
            mean.own_error
        );
    }
    let more =
        json!({ "samples": args.samples, "own_error": mean.own_error, "accuracy": accuracy });
    write((args, reference), scene, time_s, &mean.rgba, more)
}

fn write(
    (args, reference): (&RenderArgs, ReferenceKind),
    scene: &Scene,
    time_s: f64,
    rgba: &[[f64; 4]],
    more: Value,
) -> Result<()> {
    let rgba = picture::to_f32(rgba);
    let n_bad = rgba.iter().filter(|v| !v.is_finite()).count();
    if n_bad > 0 && !args.options.quiet {
        // The file has f32, whatever the film's format.
        eprintln!("warning: {}", not_finite(n_bad, rgba.len(), FilmFormat::Rgba32f));
    }
    let film = scene.film;
    image::write(&args.output, &film, film.width, film.height, &rgba)?;
    if !args.json {
        return Ok(());
    }
    let mut said = json!({
        "file": args.output.display().to_string(), "width": film.width, "height": film.height,
        "image_hash": image_hash(&rgba), "reference": reference.to_string(),
        "frame": args.time.is_none().then_some(args.frame), "time_s": time_s, "not_finite": n_bad,
    });
    if let (Value::Object(said), Value::Object(more)) = (&mut said, more) {
        said.extend(more);
    }
    output::text(&format!("{said:#}\n"))
}

/// A bar or a spinner for what takes longer than a second; heard from any thread.
struct Progress {
    shown: Mutex<Shown>,
    quiet: bool,
}

impl Progress {
    fn new(quiet: bool) -> Progress {
        Progress { shown: Mutex::new(Shown::spinner(quiet)), quiet }
    }

    fn hear(&self, work: RenderStage, n: usize) {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner).advance(work, n, self.quiet);
    }
}

/// What a person sees of the work.
pub(super) enum Shown {
    Nothing,
    /// Generating, lighting once, composing: work without a count.
    Spinner {
        _spinner: Spinner,
    },
    Bar {
        work: RenderStage,
        n_left: usize,
        bar: LateProgress,
    },
}

impl Shown {
    pub(super) fn spinner(quiet: bool) -> Shown {
        Shown::Spinner { _spinner: output::spinner("drawing in f64", quiet) }
    }

    /// One more of `n` parts of `work` is done.
    pub(super) fn advance(&mut self, work: RenderStage, n: usize, quiet: bool) {
        if !matches!(self, Shown::Bar { work: shown, .. } if *shown == work) {
            let what = match work {
                RenderStage::Lighting => "lighting",
                RenderStage::Drawing => "drawing",
                RenderStage::Sampling => "samples",
            };
            // The line is cleared before another is drawn on it.
            *self = Shown::Nothing;
            *self =
                Shown::Bar { work, n_left: n, bar: output::late_progress(n as u64, what, quiet) };
        }
        if let Shown::Bar { n_left, bar, .. } = self {
            bar.advance();
            *n_left -= 1;
            if *n_left == 0 {
                *self = Shown::Nothing;
                *self = Shown::spinner(quiet);
            }
        }
    }
}
