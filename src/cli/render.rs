//! `nimbus render SCENE -o FILE`.

use serde_json::{Value, json};

use super::args::RenderArgs;
use super::{
    check_time, device_choice, load, output, refuse_existing, render_reference, say_notes,
    say_sizes,
};
use crate::error::Result;
use crate::frame::Counts;
use crate::frame::Rendered;
use crate::frame::Stage;
use crate::frame::plan::Pass;
use crate::io::image::{self, ImageKind, image_hash};
use crate::model::film::FilmFormat;
use crate::timing::machine::device_record;

pub fn run(args: &RenderArgs) -> Result<()> {
    // All that can be known to be wrong is said before any work.
    ImageKind::of(&args.output)?;
    refuse_existing(&args.output, args.force)?;
    let loaded = load(&args.scene, &args.options)?;
    let time_s = args.time.unwrap_or_else(|| loaded.scene.time.at(args.frame));
    let i_frame = args.time.map_or(args.frame, |time_s| loaded.scene.time.frame_at(time_s));
    let scene = loaded.at_frame(i_frame);
    check_time(&scene, time_s)?;
    if let Some(reference) = args.reference {
        return render_reference::run(args, reference, &scene, time_s);
    }
    let film = scene.film;
    let quiet = args.options.quiet;

    let spinner = output::spinner("drawing", quiet);
    let mut stage = Stage::new(scene, &device_choice(&args.options), !args.options.no_skip)?;
    let packet = stage.game.step_at(args.frame, time_s)?;
    let rendered = stage.renderer.step(packet)?;
    let rgba = stage.renderer.image()?;
    drop(spinner);
    say_notes(&mut stage, &args.options)?;

    let device = device_record(stage.info());
    if args.options.verbose {
        say_sizes(&stage.scene, Some(&stage));
        for pass in Pass::ALL {
            let time =
                pass_ms(&rendered, pass).map_or(String::from("-"), |ms| format!("{ms:.3} ms"));
            eprintln!("  {:9} {time:>12}  {}", pass.name(), rendered.plan.decision(pass).reason);
        }
    }
    let counts = (args.options.verbose || args.json)
        .then(|| Counts::new(&mut stage.renderer, &stage.device, &stage.scene))
        .transpose()?;
    if let (Some(counts), true) = (&counts, args.options.verbose) {
        eprintln!("  {}", counts.text());
    }
    stage.close()?;
    let n_bad = rgba.iter().filter(|v| !v.is_finite()).count();
    if n_bad > 0 && !quiet {
        eprintln!("warning: {}", not_finite(n_bad, rgba.len(), film.format));
    }
    let spinner = output::spinner("writing", quiet);
    image::write(&args.output, &film, film.width, film.height, &rgba)?;
    let hash = args.json.then(|| image_hash(&rgba));
    drop(spinner);
    let Some(hash) = hash else { return Ok(()) };
    output::text(&format!(
        "{:#}\n",
        json!({
            "file": args.output.display().to_string(), "width": film.width, "height": film.height,
            "image_hash": hash, "device": device,
            // A time that was asked for is no frame's.
            "frame": args.time.is_none().then_some(args.frame), "time_s": time_s, "not_finite": n_bad, "counts": counts,
            "passes": Pass::ALL.map(|pass| pass_json(&rendered, pass)),
        })
    ))
}

pub(super) fn not_finite(n_bad: usize, n: usize, format: FilmFormat) -> String {
    let hint = match format {
        FilmFormat::Rgba16f => "; film.format = \"rgba32f\" holds more than 65504",
        FilmFormat::Rgba8 | FilmFormat::Rgba32f => "",
    };
    format!("{n_bad} of {n} values of the picture are not finite{hint}")
}

fn pass_json(rendered: &Rendered, pass: Pass) -> Value {
    let decision = rendered.plan.decision(pass);
    json!({
        "name": pass.name(), "run": decision.run, "reason": decision.reason.to_string(), "ms": pass_ms(rendered, pass),
    })
}

/// GPU time of a pass that ran, where the device has timestamps.
fn pass_ms(rendered: &Rendered, pass: Pass) -> Option<f64> {
    rendered.passes.iter().find(|p| p.name == pass.name()).map(|p| p.ms())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_is_warned_of_with_the_way_out() {
        let plain = "3 of 8 values of the picture are not finite";
        assert_eq!(not_finite(3, 8, FilmFormat::Rgba32f), plain);
        let half = not_finite(3, 8, FilmFormat::Rgba16f);
        assert_eq!(half, format!("{plain}; film.format = \"rgba32f\" holds more than 65504"));
    }
}
