//! `nimbus render SCENE -o FILE`.

use serde_json::{Value, json};

use super::args::RenderArgs;
use super::progress::spinner;
use super::scene::{check_time, device_choice, load, print_notes, print_sizes, print_unseen};
use super::{capture_note, output, render_frames, render_layers, render_reference};
use crate::error::Result;
use crate::frame::plan::Pass;
use crate::frame::{Counts, DrawnFrame, Rendered, Stage, scene_of_layers};
use crate::io::console::say;
use crate::io::image::{self, ImageKind, image_hash};
use crate::io::layers::{self, CHANNELS};
use crate::model::backdrop::Backdrop;
use crate::model::film::FilmFormat;
use crate::model::scene::Scene;
use crate::timing::machine::device_record;

/// Runs `nimbus render`.
///
/// # Errors
/// Fails if the arguments or the scene are faulty, the device fails, or the file cannot be written.
pub fn run(args: &RenderArgs) -> Result<()> {
    if let Some(span) = args.frames {
        return render_frames::run(args, span);
    }
    // Faults of the arguments are reported before any work.
    ImageKind::of(&args.output)?;
    render_layers::check(args)?;
    output::refuse_existing(&args.output, args.force)?;
    let loaded = load(&args.scene, &args.options)?;
    let time_s = args.time.unwrap_or_else(|| loaded.scene.time.at(args.frame));
    let i_frame = args.time.map_or(args.frame, |time_s| loaded.scene.time.frame_at(time_s));
    let scene = loaded.at_frame(i_frame);
    let scene = if args.layers { scene_of_layers(scene)? } else { scene };
    check_time(&scene, time_s)?;
    let _claim = output::claim_file(&args.output, args.force)?;
    match args.reference {
        Some(reference) => render_reference::run(args, reference, &scene, time_s),
        None => render(args, scene, time_s),
    }
}

fn render(args: &RenderArgs, scene: Scene, time_s: f64) -> Result<()> {
    let (film, backdrop) = (scene.film, Backdrop::of(&scene, time_s));
    let quiet = args.options.quiet;
    let drawing = spinner("drawing", quiet);
    let mut choice = device_choice(&args.options);
    choice.options.captured_frame = args.capture.then_some(0);
    let mut stage = Stage::new(scene, &choice, !args.options.no_skip)?;
    let packet = stage.game.step_at(args.frame, time_s)?;
    let rendered = stage.renderer.step(packet)?;
    let rgba = stage.renderer.image()?;
    let layers = args.layers.then(|| stage.layers()).transpose()?;
    drop(drawing);
    print_notes(&mut stage, &args.options)?;
    print_unseen(&stage.scene, DrawnFrame::of(time_s, &rendered), &rgba, quiet)?;

    let device = device_record(stage.info());
    if args.options.verbose {
        print_sizes(&stage.scene, Some(&stage));
        for pass in Pass::ALL {
            let time = output::or_dash(pass_ms(&rendered, pass), |ms| format!("{ms:.3} ms"));
            say!("  {:9} {time:>12}  {}", pass.name(), rendered.plan.decision(pass).reason);
        }
    }
    let counts = (args.options.verbose || args.json)
        .then(|| Counts::new(&mut stage.renderer, &stage.device, &stage.scene))
        .transpose()?;
    if let (Some(counts), true) = (&counts, args.options.verbose) {
        say!("  {}", counts.text());
    }
    capture_note::print(stage.device.captured(), choice.options.captured_frame, quiet);
    stage.close()?;
    let n_bad = match &layers {
        Some(layers) => layers.n_not_finite(),
        None => rgba.iter().filter(|v| !v.is_finite()).count(),
    };
    if n_bad > 0 && !quiet {
        say!("warning: {}", not_finite(n_bad, rgba.len(), film.format));
    }
    let writing = spinner("writing", quiet);
    match &layers {
        Some(layers) => layers::write(&args.output, layers)?,
        None => image::write(&args.output, &backdrop, film.width, film.height, &rgba)?,
    }
    let hash = args.json.then(|| image_hash(&rgba));
    drop(writing);
    output::wrote_picture(&args.output, film.width, film.height, quiet);
    let Some(hash) = hash else { return Ok(()) };
    output::object(&json!({
        "file": args.output.display().to_string(), "width": film.width, "height": film.height,
        "image_hash": hash, "device": device,
        // A time that was asked for belongs to no frame.
        "frame": args.time.is_none().then_some(args.frame), "time_s": time_s,
        "not_finite": n_bad, "counts": counts, "channels": layers.map(|_| CHANNELS),
        "passes": Pass::ALL.map(|pass| pass_json(&rendered, pass)),
    }))
}

fn not_finite(n_bad: usize, n: usize, format: FilmFormat) -> String {
    let hint = match format {
        FilmFormat::Rgba16f => "; film.format = \"rgba32f\" holds more than 65504",
        FilmFormat::Rgba8 | FilmFormat::Rgba32f => "",
    };
    format!("{n_bad} of {n} values of the picture are not finite{hint}")
}

fn pass_json(rendered: &Rendered, pass: Pass) -> Value {
    let decision = rendered.plan.decision(pass);
    json!({
        "name": pass.name(), "run": decision.run, "reason": decision.reason.to_string(),
        "ms": pass_ms(rendered, pass),
    })
}

/// Returns the device time of a pass that ran, in ms; None without timestamps.
fn pass_ms(rendered: &Rendered, pass: Pass) -> Option<f64> {
    rendered.passes.iter().find(|p| p.name == pass.name()).map(|p| p.ms())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_warning_about_values_that_are_not_finite_names_a_wider_format() {
        let plain = "3 of 8 values of the picture are not finite";
        assert_eq!(not_finite(3, 8, FilmFormat::Rgba32f), plain);
        let half = not_finite(3, 8, FilmFormat::Rgba16f);
        assert_eq!(half, format!("{plain}; film.format = \"rgba32f\" holds more than 65504"));
    }
}
