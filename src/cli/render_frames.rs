//! `nimbus render SCENE --frames FIRST..END -o DIR|CLIP.mp4`: a picture of each frame.

use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use serde_json::json;

use super::args::{RenderArgs, Span};
use super::interrupt::{self, PATIENCE, graceful_stop};
use super::output;
use super::progress::progress;
use super::scene::{check_time, device_choice, load};
use crate::error::{Error, Result};
use crate::frame::{FrameDrawer, GpuContext};
use crate::io::clip::Clip;
use crate::io::console::say;
use crate::io::image::{self, ImageKind};
use crate::io::result_folder::{Existing, ResultFolder};
use crate::io::scene_file::LoadedScene;
use crate::model::film::Film;
use crate::model::scene::{Scene, Time};
use crate::timing::machine::device_record;

/// Kind of the results, which have pictures and their list, as those of `farm merge`.
const KIND: &str = "frames";
/// Pictures a second of a clip whose scene has another step than a film has.
const USUAL_RATE: f64 = 30.0;

/// The place of the pictures.
enum Sink {
    Folder(ResultFolder),
    Clip(Clip),
}

/// A place that the thread of Ctrl-C may take over.
type SharedSink = Arc<Mutex<Option<Sink>>>;

fn lock(sink: &SharedSink) -> MutexGuard<'_, Option<Sink>> {
    sink.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Draws the frames of `span`.
///
/// # Errors
/// The arguments or the scene are faulty, the device fails, a file cannot be written, or Ctrl-C
/// came; what is finished is kept.
pub fn run(args: &RenderArgs, span: Span) -> Result<()> {
    let is_clip = is_clip(&args.output)?;
    if is_clip && args.format.is_some() {
        return Err(Error::usage("--format is that of single pictures; a clip has none"));
    }
    output::check_out(&args.output, args.force)?;
    let loaded = load(&args.scene, &args.options)?;
    let quiet = args.options.quiet;
    let gpu = GpuContext::open(&device_choice(&args.options))?;
    let format = args.format.map_or(ImageKind::Png, Into::into);
    let _claim = if is_clip { output::claim_file(&args.output, args.force)? } else { None };
    let sink = SharedSink::default();
    let _keeping = {
        let (sink, place) = (sink.clone(), args.output.clone());
        interrupt::keep(PATIENCE, move || keep(&sink, &place, quiet))
    };
    *lock(&sink) = Some(if is_clip {
        let Scene { film, time, .. } = &loaded.scene;
        check_sizes(&loaded)?;
        Sink::Clip(Clip::start(&args.output, [film.width, film.height], rate(time))?)
    } else {
        let planned: Vec<String> = (span.first..span.end).map(|i| format.frame_name(i)).collect();
        let existing = Existing::new(args.force);
        Sink::Folder(ResultFolder::open(&args.output, KIND, existing, &planned)?)
    });

    let (stop, begin) = (graceful_stop(), Instant::now());
    let bar = progress(u64::from(span.end - span.first), "frames", quiet);
    let mut drawer = FrameDrawer::new(&gpu, !args.options.no_skip);
    for i_frame in span.first..span.end {
        if stop.load(Ordering::Relaxed) {
            drop(bar);
            return Err(keep(&sink, &args.output, quiet));
        }
        let scene = loaded.exact_at_frame(i_frame);
        check_time(&scene, scene.time.at(i_frame))?;
        let (rgba, shown) = drawer.draw(scene, i_frame)?;
        let Film { width, height, .. } = shown.film;
        match &mut *lock(&sink) {
            Some(Sink::Clip(clip)) => {
                clip.add(&image::display_bytes(&shown, width, height, &rgba))?
            }
            Some(Sink::Folder(folder)) => {
                let name = format.frame_name(i_frame);
                folder.add(&name, |path| image::write(path, &shown, width, height, &rgba))?;
            }
            None => {}
        }
        bar.advance();
    }
    drop((bar, drawer));
    let device = device_record(gpu.device.info());
    gpu.close()?;
    finish(lock(&sink).take(), &args.output, quiet)?;
    if !args.json {
        return Ok(());
    }
    output::object(&json!({
        "file": args.output.display().to_string(), "first": span.first, "end": span.end,
        "device": device, "seconds": begin.elapsed().as_secs_f64(),
    }))
}

/// Returns whether the pictures become a clip.
fn is_clip(output: &Path) -> Result<bool> {
    let extension = output.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("mp4") => Ok(true),
        Some("png" | "exr") => Err(Error::usage(format!(
            "{}: --frames draws several pictures; expected -o DIR, or a clip that ends in .mp4",
            output.display()
        ))),
        _ => Ok(false),
    }
}

/// Checks that all pictures of a clip have one size.
fn check_sizes(loaded: &LoadedScene) -> Result<()> {
    let size = |scene: &Scene| (scene.film.width, scene.film.height);
    let whole = size(&loaded.scene);
    match loaded.phases.iter().find(|phase| size(&phase.scene) != whole) {
        None => Ok(()),
        Some(phase) => Err(Error::usage(format!(
            "phase \"{}\" has pictures of another size, and a clip has one size; expected -o DIR",
            phase.name
        ))),
    }
}

/// Returns the pictures a second of a clip: as many as the scene has, if films have as many.
fn rate(time: &Time) -> f64 {
    let rate = (1.0 / time.step_s).round();
    if (1.0..=240.0).contains(&rate) { rate } else { USUAL_RATE }
}

/// Puts finished pictures into their place.
fn finish(sink: Option<Sink>, place: &Path, quiet: bool) -> Result<()> {
    match sink {
        Some(Sink::Clip(clip)) => {
            let n = clip.n_frames();
            clip.finish()?;
            output::wrote(place, &format!("{n} frames"), quiet);
        }
        Some(Sink::Folder(mut folder)) => {
            folder.finish(&[], |_| Ok(()))?;
            output::wrote_folder(&folder, true, quiet);
        }
        None => {}
    }
    Ok(())
}

/// Keeps the pictures that are finished. Returns the error that the command ends with.
fn keep(sink: &SharedSink, place: &Path, quiet: bool) -> Error {
    match lock(sink).take() {
        Some(Sink::Clip(clip)) if clip.n_frames() > 0 => {
            let n = clip.n_frames();
            match clip.finish() {
                Ok(()) => output::wrote(place, &format!("the first {n} frames"), quiet),
                Err(error) => return error,
            }
        }
        Some(Sink::Folder(folder)) if folder.unfinished_at().is_some() => {
            output::wrote_folder(&folder, false, quiet);
        }
        _ => say!("no frame was finished, nothing is kept"),
    }
    Error::Interrupted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_has_the_rate_of_its_scene() {
        let of = |step_s| rate(&Time { start_s: 0.0, step_s, n_frames: 1 });
        assert_eq!([of(0.0333), of(0.04), of(1.0)], [30.0, 25.0, 1.0]);
        assert_eq!([of(0.0), of(300.0), of(1e-6)], [USUAL_RATE; 3]);
    }

    #[test]
    fn single_pictures_are_no_place_for_frames() {
        assert!(is_clip(Path::new("a/b.MP4")).unwrap());
        assert!(!is_clip(Path::new("a/b")).unwrap());
        let error = is_clip(Path::new("a/b.png")).unwrap_err().to_string();
        assert!(error.contains("-o DIR"), "{error}");
    }
}
