//! `nimbus render SCENE --reference thin|volume -o FILE`: the frame in f64, without a device.

use std::sync::{Mutex, PoisonError};

use serde_json::json;

use super::args::{ReferenceArg, RenderArgs};
use super::output::{self, LateProgress};
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
    let Picture { rgba, error, brightest, n_particles } = draw(scene, time_s, reference, quiet)?;
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
        })
    ))
}

/// The picture, with bars for what takes longer than a second.
fn draw(scene: &Scene, time_s: f64, reference: ReferenceArg, quiet: bool) -> Result<Picture> {
    // Lighting is counted, and so is the volume; what lies between them is short.
    let bar: Mutex<Option<(Work, LateProgress)>> = Mutex::new(None);
    let on_part = |work: Work, n: usize| {
        let mut bar = bar.lock().unwrap_or_else(PoisonError::into_inner);
        if bar.as_ref().is_none_or(|(shown, _)| *shown != work) {
            let what = match work {
                Work::Lighting => "lighting",
                Work::Drawing => "drawing",
            };
            // The old one is cleared before the new one is drawn.
            drop(bar.take());
            *bar = Some((work, output::late_progress(n as u64, what, quiet)));
        }
        if let Some((_, bar)) = &*bar {
            bar.advance();
        }
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
