//! `nimbus ledger SCENE`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use super::args::LedgerArgs;
use super::render_reference::Shown;
use super::{device_choice, load, output};
use crate::error::{Error, Result};
use crate::frame::GpuContext;
use crate::frame::limits;
use crate::io::atomic::check_place;
use crate::reference::picture::{Pixels, ReferenceKind, RenderStage, n_reflections};
use crate::report::charts;
use crate::studies::error::players::Frames;
use crate::studies::ledger::records::{LEDGER_FILE, Ledger, Row};
use crate::studies::ledger::run::Setup;
use crate::studies::provenance::{Figure, Provenance};
use crate::timing::json::{self, ResultFile};
use crate::timing::machine;
use crate::timing::results::prepare_out_dir;

/// `graceful`: set, as rows that are finished are kept on Ctrl-C.
pub fn run(args: &LedgerArgs, stop: &AtomicBool, graceful: &AtomicBool) -> Result<()> {
    if let Some(out) = &args.out {
        super::refuse_existing(out, args.force)?;
    }
    let mut options = args.options.clone();
    let loaded = load(&args.scene, &options)?;
    let loaded = match args.plain && !loaded.scene.clouds.is_empty() {
        true => {
            options.set.push("cloud.*.texture=\"none\"".to_owned());
            load(&args.scene, &super::SceneArgs { quiet: true, ..options })?
        }
        false => loaded,
    };
    let time_s = loaded.scene.time.at(args.frame);
    let scene = loaded.clone().at_frame(args.frame).exact().into_owned();
    super::check_time(&scene, time_s)?;
    ReferenceKind::Model.check(&scene, time_s).map_err(|error| match error {
        Error::Usage { what } if what.contains("textured") => {
            Error::usage(format!("{what}, or --plain for all clouds"))
        }
        other => other,
    })?;
    if args.reflections < n_reflections(&scene) {
        return Err(Error::usage(format!(
            "--reflections {}: the scene has {}; expected at least as many",
            args.reflections,
            n_reflections(&scene)
        )));
    }
    let bed = GpuContext::open(&device_choice(&args.options))?;
    limits::check(&scene, bed.device.limits())?;
    let clocks =
        machine::clocks_record(bed.device.info(), &mut bed.player(scene.clone(), true)?.renderer)?;
    let made = Provenance::now(Ledger::SCHEMA, &args.scene, &loaded, bed.device.info(), clocks);
    if let Some(out) = &args.out {
        prepare_out_dir(out, true)?;
        check_place(&out.join(LEDGER_FILE))?;
    }
    graceful.store(true, Ordering::Relaxed);
    let ledger = measure(args, &bed, &scene, time_s, made, stop)?;
    if let Some(out) = &args.out {
        json::write(&out.join(LEDGER_FILE), &ledger)?;
        output::write_chart(&out.join("ledger.svg"), &charts::ledger::chart(&ledger))?;
    }
    if args.json {
        output::object(&ledger)?;
    } else {
        output::text(&report(&ledger))?;
    }
    bed.close()?;
    match (ledger.interrupted, ledger.holds) {
        (true, _) => Err(Error::Interrupted),
        (false, false) => Err(Error::Check {
            what: format!(
                "the total {:.3e} is more than the sum of all rows {:.3e}",
                ledger.total.value, ledger.sum
            ),
        }),
        (false, true) => Ok(()),
    }
}

fn measure(
    args: &LedgerArgs,
    bed: &GpuContext,
    scene: &crate::model::scene::Scene,
    time_s: f64,
    made: Provenance,
    stop: &AtomicBool,
) -> Result<Ledger> {
    let quiet = args.options.quiet;
    let shown = Mutex::new(Shown::spinner(quiet));
    let on_part = |work: RenderStage, n: usize| {
        shown.lock().unwrap_or_else(PoisonError::into_inner).advance(work, n, quiet);
    };
    let pixels = Pixels::sample(scene.film.width, scene.film.height, args.pixels);
    let frames = Frames { i_frame: args.frame, time_s, n_frames: args.frames, as_played: false };
    let n_rounds = args.rounds as usize;
    Setup { bed, scene, frames, n_rounds, pixels: &pixels, n_reflections: args.reflections, stop }
        .run(made, &on_part)
}

/// What is printed for people.
fn report(ledger: &Ledger) -> String {
    let made = &ledger.made;
    let mut out = format!(
        "{}\n{} ({}), {}\n",
        made.scene_file, made.device.name, made.device.driver, made.cpu.model
    );
    out += &format!(
        "frame {}, {} of {} pixels; the last row's truth has an RMS of {:.3}{}\n\n",
        ledger.frame,
        ledger.n_pixels,
        u64::from(ledger.width) * u64::from(ledger.height),
        ledger.magnitude,
        if ledger.interrupted { "; INTERRUPTED: what was finished" } else { "" }
    );
    out += &output::table(&rows(ledger));
    out += &format!(
        "\nas it is drawn against the last truth: RMSE {:.2e}; the rows sum to {:.2e}, in \
         quadrature to {:.2e}\n",
        ledger.total.value, ledger.sum, ledger.quadrature
    );
    if ledger.rows.iter().any(|row| !row.is_resolved) {
        out += "! the two pictures' own errors are more than a tenth of it\n";
    }
    out
}

fn rows(ledger: &Ledger) -> Vec<Vec<String>> {
    let head = [
        "approximation",
        "is",
        "stands for",
        "RMSE",
        "95 %",
        "relative",
        "share",
        "own error",
        "GPU time by without",
    ];
    let interval = |f: &Figure, text: &dyn Fn(f64) -> String| {
        f.low
            .zip(f.high)
            .map_or("-".to_owned(), |(low, high)| format!("{} to {}", text(low), text(high)))
    };
    let small = |v: f64| if v == 0.0 { "0".to_owned() } else { format!("{v:.2e}") };
    let of = |row: &Row| {
        let ratio = row.time_ratio.map_or("-".to_owned(), |f| {
            format!("{:.3} ({})", f.value, interval(&f, &|v| format!("{v:.3}")))
        });
        vec![
            row.name.clone(),
            row.from.clone(),
            row.to.clone(),
            format!("{}{}", if row.is_resolved { "" } else { "!" }, small(row.error.value)),
            interval(&row.error, &small),
            format!("{:.2} %", 100.0 * row.relative),
            format!("{:.1} %", 100.0 * row.share),
            small(row.own_error),
            ratio,
        ]
    };
    std::iter::once(head.map(str::to_owned).to_vec()).chain(ledger.rows.iter().map(of)).collect()
}
