//! `nimbus render SCENE -o FILE`.

use super::args::RenderArgs;
use super::{device_choice, load, refuse_existing};
use crate::error::{Error, Result};
use crate::frame::plan::Pass;
use crate::io::image::{self, ImageKind};
use crate::study::stage::Stage;

pub fn run(args: &RenderArgs) -> Result<()> {
    // All that can be known to be wrong is said before any work.
    ImageKind::of(&args.output)?;
    refuse_existing(&args.output, args.force)?;
    let loaded = load(&args.scene, &args.options)?;
    let time_s = args.time.unwrap_or_else(|| loaded.scene.time.at(args.frame));
    if !time_s.is_finite() {
        return Err(Error::usage(format!("--time {time_s}: expected a finite number of seconds")));
    }
    let film = loaded.scene.film;
    let mut stage = Stage::new(loaded.scene, &device_choice(&args.options), !args.options.no_skip)?;
    let packet = stage.game.step_at(args.frame, time_s)?;
    let rendered = stage.renderer.step(packet)?;
    let rgba = stage.renderer.image()?;
    if args.options.verbose {
        eprintln!("{} ({})", stage.info().name, stage.info().driver);
        for pass in Pass::ALL {
            let decision = rendered.plan.decision(pass);
            let time = rendered.passes.iter().find(|p| p.name == pass.name());
            let time = time.map_or(String::from("-"), |t| format!("{:.3} ms", t.ms()));
            eprintln!("  {:9} {time:>12}  {}", pass.name(), decision.reason);
        }
    }
    stage.close()?;
    let n_bad = rgba.iter().filter(|v| !v.is_finite()).count();
    if n_bad > 0 && !args.options.quiet {
        eprintln!("warning: {n_bad} of {} values of the picture are not finite", rgba.len());
    }
    image::write(&args.output, &film, film.width, film.height, &rgba)
}
