//! `nimbus render SCENE --reference WHICH -o FILE`: the frame in f64, without a device.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};

use super::args::RenderArgs;
use super::interrupt::{self, PATIENCE, graceful_stop};
use super::progress::ReferenceProgress;
use super::scene::print_sizes;
use super::{output, render_layers};
use crate::error::{Error, Result};
use crate::io::console::say;
use crate::io::image::{self, image_hash};
use crate::io::layers::{self, CHANNELS};
use crate::model::backdrop::Backdrop;
use crate::model::scene::{Draw, Scene};
use crate::reference::picture::{
    self, BlobModel, DrawnPicture, Enough, Grown, MAX_SAMPLES, MeanPicture, Pixels, ReferenceKind,
    ReferenceRequest, SampleSums, check_memory, drawn_as_set, layers_as_set, transport_layers,
};
use crate::studies::kept_paths::{KeptPaths, PathSums};
use crate::studies::reference_cache;

/// A picture in f64 and the JSON keys that only its kind has.
struct Computed {
    rgba: Vec<[f64; 4]>,
    keys: Value,
}

/// Draws the reference of a frame and writes it.
///
/// # Errors
/// Fails if the scene has no such reference or the file cannot be written.
pub fn run(args: &RenderArgs, kind: ReferenceKind, scene: &Scene, time_s: f64) -> Result<()> {
    let scene = &*scene.lit();
    let film = scene.film;
    let n_pixels = u64::from(film.width) * u64::from(film.height);
    let n_samples = args.samples.unwrap_or(kind.usual_samples());
    check_memory(n_pixels, n_samples, scene.n_particles())?;
    if args.error.is_some() && !kind.is_random() {
        return Err(Error::usage(format!(
            "--error: only \"transport\" is random; expected --samples with --reference {kind}"
        )));
    }
    if args.options.verbose {
        print_sizes(scene, None);
    }
    let drawing = match kind {
        ReferenceKind::Thin | ReferenceKind::Slices => Some(BlobModel::AsDrawn),
        ReferenceKind::Volume => Some(BlobModel::Volume),
        _ => None,
    };
    if args.layers {
        return match kind.is_random() {
            true => with_transport_layers(args, n_samples, scene, time_s),
            false => with_layers(args, scene, time_s),
        };
    }
    let Computed { rgba, keys } = match drawing.filter(|_| n_samples == 1) {
        Some(drawing) => at_centers(args, drawing, &composed_by(kind, scene), time_s)?,
        None => sampled(args, kind, n_samples, (scene, time_s))?,
    };
    let rgba = picture::to_f32(&rgba);
    let n_bad = rgba.iter().filter(|v| !v.is_finite()).count();
    warn_of_bad(args, n_bad, rgba.len());
    let backdrop = Backdrop::of(scene, time_s);
    image::write(&args.output, &backdrop, film.width, film.height, &rgba)?;
    let hash = image_hash(&rgba);
    tell(args, (kind, scene, time_s), (hash, n_bad), keys)
}

/// Returns `scene` with its own drawing settings, but overlapping blobs composed as in `kind`.
fn composed_by(kind: ReferenceKind, scene: &Scene) -> Scene {
    let Draw { path, overlap, .. } = kind.without_approximations(scene).draw;
    Scene { draw: Draw { path, overlap, ..scene.draw }, ..scene.clone() }
}

/// Draws the layers of the reference "thin" and writes them.
fn with_layers(args: &RenderArgs, scene: &Scene, time_s: f64) -> Result<()> {
    let shown = ReferenceProgress::new(args.options.quiet);
    let drawn = layers_as_set(scene, time_s, &|work, n| shown.advance(work, n))?;
    drop(shown);
    let layers = render_layers::of_reference([scene.film.width, scene.film.height], &drawn);
    let n_bad = layers.n_not_finite();
    warn_of_bad(args, n_bad, layers.beauty.len());
    layers::write(&args.output, &layers)?;
    let hash = image_hash(&layers.beauty);
    let keys = json!({ "channels": CHANNELS });
    tell(args, (ReferenceKind::Thin, scene, time_s), (hash, n_bad), keys)
}

/// Draws the layers of the reference "transport" and writes them.
fn with_transport_layers(
    args: &RenderArgs,
    n_samples: u32,
    scene: &Scene,
    time_s: f64,
) -> Result<()> {
    let pixels = Pixels::all(scene.film.width, scene.film.height);
    let subject = ReferenceRequest { kind: ReferenceKind::Transport, scene, time_s };
    let of = (&pixels, PathSums::Layers);
    let (drawn, n_kept) = with_kept(args, &subject, of, Some(n_samples), |_, grown| {
        transport_layers(scene, time_s, n_samples, grown)
    })?;
    let channels = render_layers::of_transport(&drawn);
    let n_bad = channels.iter().flatten().filter(|v| !v.is_finite()).count();
    warn_of_bad(args, n_bad, channels.iter().map(Vec::len).sum());
    let names = render_layers::TRANSPORT_CHANNELS;
    let size = [scene.film.width, scene.film.height];
    layers::write_channels(&args.output, size, names.into_iter().zip(channels))?;
    let hash = image_hash(&picture::to_f32(&drawn.rgba));
    let keys = json!({ "channels": names, "samples": n_samples, "samples_kept": n_kept });
    tell(args, (ReferenceKind::Transport, scene, time_s), (hash, n_bad), keys)
}

fn warn_of_bad(args: &RenderArgs, n_bad: usize, n: usize) {
    if n_bad > 0 && !args.options.quiet {
        say!("warning: {n_bad} of {n} values of the picture are not finite");
    }
}

/// Prints that the picture is written and, with `--json`, its keys.
fn tell(
    args: &RenderArgs,
    (kind, scene, time_s): (ReferenceKind, &Scene, f64),
    (hash, n_bad): (String, usize),
    keys: Value,
) -> Result<()> {
    let film = scene.film;
    output::wrote_picture(&args.output, film.width, film.height, args.options.quiet);
    if !args.json {
        return Ok(());
    }
    let mut all = json!({
        "file": args.output.display().to_string(), "width": film.width, "height": film.height,
        "image_hash": hash, "reference": kind.to_string(),
        "frame": args.time.is_none().then_some(args.frame), "time_s": time_s, "not_finite": n_bad,
    });
    if let (Value::Object(all), Value::Object(keys)) = (&mut all, keys) {
        all.extend(keys);
    }
    output::object(&all)
}

/// Draws every pixel at its centre.
fn at_centers(
    args: &RenderArgs,
    drawing: BlobModel,
    scene: &Scene,
    time_s: f64,
) -> Result<Computed> {
    let shown = ReferenceProgress::new(args.options.quiet);
    let DrawnPicture { rgba, error, brightest, n_particles, omitted } =
        drawn_as_set(scene, time_s, drawing, &|work, n| shown.advance(work, n))?;
    drop(shown);
    if let Some(error) = error.filter(|_| args.options.verbose) {
        say!(
            "error of the integral: at most about {error:.1e}; the brightest particle has \
             {brightest:.3e}"
        );
    }
    let share = (drawing == BlobModel::AsDrawn).then(|| omitted.share());
    if let Some(share) = share.filter(|_| args.options.verbose && scene.draw.threshold.is_active())
    {
        let n = omitted.n_layers;
        say!(
            "draw.threshold cuts {n} layers of a pixel at most, and changes it by at most \
             {share:.1e} of the radiances"
        );
    }
    let keys = json!({
        "particles": n_particles, "error": error, "brightest": brightest,
        "layers_cut": share.map(|_| omitted.n_layers), "cut_changes": share,
    });
    Ok(Computed { rgba, keys })
}

/// Draws the mean of several samples a pixel, summed in the order in which parts of it are joined.
fn sampled(
    args: &RenderArgs,
    kind: ReferenceKind,
    n_samples: u32,
    (scene, time_s): (&Scene, f64),
) -> Result<Computed> {
    let (film, never) = (scene.film, AtomicBool::new(false));
    let pixels = Pixels::all(film.width, film.height);
    let subject = ReferenceRequest { kind, scene, time_s };
    let (sums, n_kept) = if kind.is_random() {
        let (sums, n_kept) = paths(args, n_samples, &subject, &pixels)?;
        (sums, Some(n_kept))
    } else {
        let shown = ReferenceProgress::new(args.options.quiet);
        let listener = &|work, n| shown.advance(work, n);
        (picture::sums(&subject, &pixels, 0..n_samples, &never, listener)?, None)
    };
    let (n_samples, mean) = (sums.n_samples, sums.mean());
    let accuracy = kind.accuracy_text(scene, n_samples);
    if args.options.verbose {
        say!(
            "off by about {:.1e} (root mean square of the pixels' estimates; {accuracy})",
            mean.own_error
        );
        say!("the mean of all pixels is known to {:.1e} of it", mean.relative_error);
    }
    let keys = json!({
        "samples": n_samples, "samples_kept": n_kept, "own_error": mean.own_error,
        "accuracy": accuracy, "relative_error": mean.relative_error,
    });
    Ok(Computed { rgba: mean.rgba, keys })
}

/// Traces random paths, as many as asked for. Returns their sums, and how many paths of a pixel an
/// earlier run had kept.
fn paths(
    args: &RenderArgs,
    n_samples: u32,
    subject: &ReferenceRequest<'_>,
    pixels: &Pixels,
) -> Result<(SampleSums, u32)> {
    let of = (pixels, PathSums::Spread);
    let Some(error) = args.error else {
        let enough = Enough { least: n_samples, most: n_samples, is_enough: &|_| false };
        return with_kept(args, subject, of, Some(n_samples), |_, grown| {
            picture::sums_until(subject, pixels, false, &enough, grown)
        });
    };
    let is_enough = &|mean: &MeanPicture| mean.relative_error <= error;
    let n_pixels = pixels.at.len() as u64;
    // More samples take more memory.
    let fits = |n: &u32| check_memory(n_pixels, *n, subject.scene.n_particles()).is_ok();
    let most = (1..=MAX_SAMPLES.ilog2()).rev().map(|k| 1 << k).find(fits).unwrap_or(2);
    let enough = Enough { least: 2, most, is_enough };
    with_kept(args, subject, of, None, |kept, grown| {
        let sums = kept.total().filter(|sums| enough.holds(sums));
        sums.map_or_else(|| picture::sums_until(subject, pixels, false, &enough, grown), Ok)
    })
}

/// Adds random paths to those that an earlier run has kept, unless there are more than `at_most`,
/// and keeps them, after Ctrl-C too. Returns what `add` returns, and how many paths of a pixel were
/// kept before.
fn with_kept<T>(
    args: &RenderArgs,
    subject: &ReferenceRequest<'_>,
    (pixels, of): (&Pixels, PathSums),
    at_most: Option<u32>,
    add: impl FnOnce(&KeptPaths, &Grown<'_>) -> Result<T>,
) -> Result<(T, u32)> {
    let folder = reference_cache::default_folder();
    let kept = Arc::new(KeptPaths::open(folder.as_deref(), subject, pixels, of, at_most)?);
    let n_before = kept.n_before();
    if n_before > 0 && args.options.verbose {
        say!("goes on from {n_before} paths a pixel that an earlier run kept");
    }
    let stop = graceful_stop();
    let mut keeping = {
        let kept = kept.clone();
        interrupt::keep(PATIENCE, move || cut_short(&kept))
    };
    let shown = ReferenceProgress::new(args.options.quiet);
    let listener = &|work, n| shown.advance(work, n);
    let added = kept.grow(stop, listener, |grown| add(&kept, grown));
    keeping.finish();
    drop(shown);
    match added {
        Err(Error::Interrupted) => Err(cut_short(&kept)),
        added => Ok((added?, n_before)),
    }
}

/// Keeps the paths that are traced, and says how many. Returns the error that the program ends
/// with.
fn cut_short(kept: &KeptPaths) -> Error {
    output::kept_paths(Some(kept.keep()));
    Error::Interrupted
}
