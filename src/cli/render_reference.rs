//! `nimbus render SCENE --reference thin|volume -o FILE`: the frame in f64, without a device.

use std::sync::{Mutex, PoisonError};

use serde_json::json;

use super::args::{ReferenceArg, RenderArgs};
use super::output::{self, LateProgress, Spinner};
use super::render::{image_hash, not_finite};
use super::say_sizes;
use crate::error::Result;
use crate::io::{atomic, image};
use crate::model::film::FilmFormat;
use crate::model::scene::Scene;
use crate::study::picture::{Drawing, Picture, Work, picture};

pub fn run(args: &RenderArgs, reference: ReferenceArg, scene: &Scene, time_s: f64) -> Result<()> {
    // What may take minutes is not begun where it could not be kept.
    atomic::check_place(&args.output)?;
    let quiet = args.options.quiet;
    if args.options.verbose {
        say_sizes(scene, None);
    }
    let Picture { rgba, error, brightest, n_particles, cut } = draw(scene, time_s, reference, quiet)?;
    let rgba: Vec<f32> = rgba.iter().flatten().map(|v| *v as f32).collect();
    let n_bad = rgba.iter().filter(|v| !v.is_finite()).count();
    if n_bad > 0 && !quiet {
        // The file has f32, whatever the film's format.
        eprintln!("warning: {}", not_finite(n_bad, rgba.len(), FilmFormat::Rgba32f));
    }
    let film = scene.film;
    if let Some(error) = error.filter(|_| args.options.verbose) {
        eprintln!("error of the integral: at most about {error:.1e}; the brightest particle has {brightest:.3e}");
    }
    let share = (reference == ReferenceArg::Thin).then(|| cut.share());
    if let Some(share) = share.filter(|_| args.options.verbose && scene.draw.threshold.is_some()) {
        let n = cut.n_layers;
        eprintln!(
            "draw.threshold cuts {n} layers of a pixel at most, and changes it by at most {share:.1e} of the radiances"
        );
    }
    image::write(&args.output, &film, film.width, film.height, &rgba)?;
    if !args.json {
        return Ok(());
    }
    output::text(&format!(
        "{:#}\n",
        json!({
            "file": args.output.display().to_string(), "width": film.width, "height": film.height,
            "image_hash": image_hash(&rgba), "reference": name(reference),
            "frame": args.time.is_none().then_some(args.frame), "time_s": time_s, "not_finite": n_bad,
            "particles": n_particles, "error": error, "brightest": brightest,
            "layers_cut": share.map(|_| cut.n_layers), "cut_changes": share,
        })
    ))
}

/// What a person sees of the work.
pub(super) enum Shown {
    Nothing,
    /// Generating, lighting once, composing: work without a count.
    Spinner {
        _spinner: Spinner,
    },
    Bar {
        work: Work,
        n_left: usize,
        bar: LateProgress,
    },
}

impl Shown {
    pub(super) fn spinner(quiet: bool) -> Shown {
        Shown::Spinner { _spinner: output::spinner("drawing in f64", quiet) }
    }

    /// One more of `n` parts of `work` is done.
    pub(super) fn advance(&mut self, work: Work, n: usize, quiet: bool) {
        if !matches!(self, Shown::Bar { work: shown, .. } if *shown == work) {
            let what = match work {
                Work::Lighting => "lighting",
                Work::Drawing => "drawing",
            };
            // The line is cleared before another is drawn on it.
            *self = Shown::Nothing;
            *self = Shown::Bar { work, n_left: n, bar: output::late_progress(n as u64, what, quiet) };
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

/// The picture, with a bar or a spinner for what takes longer than a second.
fn draw(scene: &Scene, time_s: f64, reference: ReferenceArg, quiet: bool) -> Result<Picture> {
    let shown = Mutex::new(Shown::spinner(quiet));
    let on_part = |work: Work, n: usize| {
        shown.lock().unwrap_or_else(PoisonError::into_inner).advance(work, n, quiet);
    };
    let drawing = match reference {
        ReferenceArg::Thin => Drawing::Thin,
        ReferenceArg::Volume => Drawing::Volume,
    };
    picture(scene, time_s, drawing, &on_part)
}

fn name(reference: ReferenceArg) -> &'static str {
    match reference {
        ReferenceArg::Thin => "thin",
        ReferenceArg::Volume => "volume",
    }
}
