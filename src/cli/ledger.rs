//! `nimbus ledger SCENE`.

use std::path::Path;
use std::sync::{Arc, Mutex};

use super::args::LedgerArgs;
use super::interrupt::{self, PATIENCE, graceful_stop};
use super::output::{
    self, SharedFolder, check_out, header, interval, lock_folder, or_dash, scientific,
};
use super::progress::{ReferenceProgress, about, spinner};
use super::scene::{StudyScene, load_study, open_for_study, pixels, with_texture_hint};
use crate::error::{Error, Result};
use crate::io::console::say;
use crate::io::result_folder::{Existing, ResultFolder};
use crate::model::scene::LightingMode;
use crate::reference::picture::{Pixels, ReferenceKind, n_reflections};
use crate::report::charts;
use crate::studies::error::device_runner::FrameChoice;
use crate::studies::kept_paths::Traced;
use crate::studies::ledger::records::{Ledger, Row};
use crate::studies::ledger::study::{LedgerParts, LedgerStudy, lock};
use crate::studies::provenance::Provenance;
use crate::timing::json::{self, ResultFile};
use crate::timing::limits::check_study;

const CHART: &str = "ledger.svg";
/// Files of a ledger; the record is last.
const FILES: [&str; 2] = [CHART, Ledger::FILE];

/// Runs `nimbus ledger`.
///
/// # Errors
/// Fails if the arguments or the scene are faulty, the device fails, the rows do not sum up, or
/// Ctrl-C came.
pub fn run(args: &LedgerArgs) -> Result<()> {
    if let Some(out) = &args.out {
        check_out(out, args.force)?;
        interrupt::note_until_keep("interrupted before the first row: nothing was written");
    }
    let StudyScene { options, loaded, scene, time_s } =
        load_study(&args.scene, &args.options, args.plain, args.frame)?;
    let scene = &scene.exact().into_owned();
    ReferenceKind::Model.check(scene, time_s).map_err(|error| with_texture_hint(error, ""))?;
    let n_least = n_reflections(scene);
    if args.reflections < n_least {
        return Err(Error::usage(format!(
            "--reflections {}: the scene has {n_least}; expected at least as many",
            args.reflections
        )));
    }
    // The pictures that the device draws, one for each approximation of its own.
    const MOST_DRAWN: u64 = 16;
    check_study(MOST_DRAWN, args.rounds, args.frames)?;
    let (gpu, clocks) = open_for_study(&options, scene, time_s)?;
    let made = Provenance::now(Ledger::SCHEMA, &args.scene, &loaded, gpu.device.info(), clocks);
    let stop = graceful_stop();
    let frames =
        FrameChoice { i_frame: args.frame, time_s, n_frames: args.frames, as_played: false };
    let pixels = pixels(scene, args.pixels)?;
    let parts = Arc::new(Mutex::new(LedgerParts::default()));
    let (folder, traced) = (SharedFolder::default(), Traced::default());
    let mut keeping = {
        let (args, made, pixels, parts, folder) =
            (args.clone(), made.clone(), pixels.clone(), parts.clone(), folder.clone());
        let traced = traced.clone();
        interrupt::keep(PATIENCE, move || {
            output::kept_paths(traced.keep());
            cut_short(&args, &folder, made, frames, &pixels, &parts)
        })
    };
    let (existing, planned) = (Existing::new(args.force), FILES.map(str::to_owned));
    let open = |out| ResultFolder::open(out, "ledger", existing, &planned);
    *lock_folder(&folder) = args.out.as_deref().map(open).transpose()?;
    let study = LedgerStudy {
        gpu: &gpu,
        scene,
        frames,
        n_rounds: args.rounds as usize,
        pixels: &pixels,
        n_reflections: args.reflections,
        n_paths: args.paths,
        stop,
        traced: &traced,
        parts: &parts,
    };
    announce(args, &study)?;
    let shown = ReferenceProgress::new(args.options.quiet);
    let ledger = study.run(made, &|work, n| shown.advance(work, n))?;
    keeping.finish();
    drop(shown);
    deliver(args, &folder, &ledger)?;
    gpu.close()?;
    if ledger.interrupted {
        output::kept_paths(traced.keep());
        return Err(Error::Interrupted);
    }
    if !ledger.holds {
        let (total, sum) = (ledger.total.value, ledger.sum);
        let what = format!("the total {total:.3e} is more than the sum of all rows {sum:.3e}");
        return Err(Error::Check { what });
    }
    Ok(())
}

/// Says how long a ledger will take.
fn announce(args: &LedgerArgs, study: &LedgerStudy<'_>) -> Result<()> {
    /// Time beyond which a user may want less.
    const LONG_S: f64 = 60.0;
    if args.options.quiet || study.scene.lighting.mode == LightingMode::None {
        return Ok(());
    }
    let estimating = spinner("estimating the time", false);
    let (seconds, paths_s) = (study.expected_s()?, study.expected_paths_s()?);
    drop(estimating);
    let least = n_reflections(study.scene);
    let hint = match seconds > LONG_S && args.reflections > least {
        true => format!("; --reflections {least} leaves out the longest row"),
        false => String::new(),
    };
    say!("the pictures in f64 take about {} on this machine{hint}", about(seconds));
    if paths_s > 0.0 {
        say!("the random paths take at most about {}; --paths 0 leaves them out", about(paths_s));
    }
    Ok(())
}

/// Keeps what a ledger has finished whose present picture takes too long to stop. Returns the error
/// that the program ends with.
fn cut_short(
    args: &LedgerArgs,
    folder: &SharedFolder,
    made: Provenance,
    frames: FrameChoice,
    pixels: &Pixels,
    parts: &Mutex<LedgerParts>,
) -> Error {
    let parts = lock(parts);
    if !parts.has_row() {
        say!("no row was finished, nothing is kept");
        drop(lock_folder(folder).take());
        return Error::Interrupted;
    }
    let ledger = parts.ledger(made, frames, pixels, true);
    let kept = ledger.and_then(|ledger| deliver(args, folder, &ledger));
    kept.err().unwrap_or(Error::Interrupted)
}

/// Prints the ledger and writes its files.
fn deliver(args: &LedgerArgs, folder: &SharedFolder, ledger: &Ledger) -> Result<()> {
    // The table appears even where the files cannot be written, and the other way round.
    let printed = if args.json { output::object(ledger) } else { output::text(&report(ledger)) };
    if let Some(folder) = &mut *lock_folder(folder) {
        let write = |folder: &Path| {
            output::write_chart(&folder.join(CHART), &charts::ledger::chart(ledger))?;
            json::write(&folder.join(Ledger::FILE), ledger)
        };
        folder.write_last(!ledger.interrupted, &FILES, write)?;
        output::wrote_folder(folder, !ledger.interrupted, args.options.quiet);
    }
    printed
}

/// Returns the text for people.
fn report(ledger: &Ledger) -> String {
    let made = &ledger.made;
    let mut out = format!(
        "{}\n{} ({}), {}\n",
        made.scene_file, made.device.name, made.device.driver, made.cpu.model
    );
    out += &format!(
        "frame {}, {} of {} pixels; the last picture has an RMS of {:.3}{}\n\n",
        ledger.frame,
        ledger.n_pixels,
        u64::from(ledger.width) * u64::from(ledger.height),
        ledger.magnitude,
        if ledger.interrupted { "; INTERRUPTED: what was finished" } else { "" }
    );
    out += &output::table(&rows(ledger));
    out += &format!(
        "\nas it is drawn against the last picture: RMSE {:.2e}; the rows sum to {:.2e}, in \
         quadrature to {:.2e}\n",
        ledger.total.value, ledger.sum, ledger.quadrature
    );
    if ledger.rows.iter().any(|row| row.time_ratio.is_none()) {
        out += "GPU time by without: - : the row has no counterpart on the device, passes are \
            not timed there, or the ledger ended before\n";
    }
    if ledger.rows.iter().any(|row| row.error.low.is_none()) {
        out += "95 %: - : an interval needs more pixels; see --pixels\n";
    }
    if ledger.rows.iter().any(|row| !row.is_resolved) {
        out += "! the two pictures' own errors are more than a tenth of it\n";
    }
    out
}

fn rows(ledger: &Ledger) -> Vec<Vec<String>> {
    let mut rows = header([
        "approximation",
        "is",
        "stands for",
        "RMSE",
        "95 %",
        "relative",
        "share",
        "own error",
        "GPU time by without",
    ]);
    let mark = |row: &Row| if row.is_resolved { "" } else { "!" };
    let three = |v: f64| format!("{v:.3}");
    rows.extend(ledger.rows.iter().map(|row| {
        vec![
            row.name.clone(),
            row.from.clone(),
            row.to.clone(),
            format!("{}{}", mark(row), scientific(row.error.value)),
            interval(Some(row.error), scientific),
            format!("{:.2} %", 100.0 * row.relative),
            format!("{:.1} %", 100.0 * row.share),
            scientific(row.own_error),
            or_dash(row.time_ratio, |f| format!("{:.3} ({})", f.value, interval(Some(f), three))),
        ]
    }));
    rows
}
