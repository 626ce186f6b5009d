//! `nimbus weather FILE`.

use serde_json::{Value, json};

use super::args::WeatherArgs;
use super::output::{self, header, or_dash};
use super::progress::progress;
use crate::error::{Error, Result};
use crate::io::weather::container::Variable;
use crate::io::weather::wrf::{self, Clouds, Step, WeatherFile};
use crate::model::weather::agreement::Agreement;
use crate::model::weather::diagnosed;
use crate::model::weather::extinction::InvalidCounts;
use crate::model::weather::statistics::{self, CloudStatistics};
use crate::model::weather::{steps, sun};

/// Runs `nimbus weather`.
///
/// # Errors
/// Fails if the file is no output of WRF or has no such step.
pub fn run(args: &WeatherArgs) -> Result<()> {
    let file = wrf::open(&args.file)?;
    if args.diagnosed && (file.clouds == Clouds::Diagnosed || !file.has_vapour()) {
        let what = "--diagnosed: expected a file with clouds (QCLOUD, QICE or QSNOW) and QVAPOR, \
                    to compare them";
        return Err(Error::usage(format!("{}: {what}", args.file.display())));
    }
    let wanted = match args.step {
        Some(i_step) => {
            if i_step >= file.n_steps {
                // Reading a step beyond the last says how many there are.
                file.step(i_step)?;
            }
            i_step..i_step.saturating_add(1)
        }
        None => 0..file.n_steps,
    };
    let bar = progress(wanted.len() as u64, "reading steps", args.quiet);
    let mut steps = Vec::with_capacity(wanted.len());
    for i_step in wanted {
        steps.push(StepSummary::read(&file, i_step, args.diagnosed)?);
        bar.advance();
    }
    drop(bar);
    let name = args.file.display().to_string();
    let notes: Vec<String> = file.notes.iter().cloned().chain(notes(&steps)).collect();
    if args.json {
        return output::object(&to_json(&name, &file, &notes, &steps));
    }
    let notes = if args.quiet { &[] } else { &notes[..] };
    output::text(&describe(&name, &file, notes, &steps))
}

/// The clouds of one step, and its oddities.
struct StepSummary {
    i_step: usize,
    time: Option<String>,
    /// Latitude and longitude of the middle of the domain.
    middle_deg: Option<(f64, f64)>,
    /// Direction of the sun in the middle of the domain: above the horizon, and from north over
    /// east.
    sun_deg: Option<(f64, f64)>,
    clouds: CloudStatistics,
    /// Clouds diagnosed from humidity, compared with these.
    diagnosed: Option<Diagnosed>,
    /// Least and greatest height of the ground; none if the file has no valid heights.
    ground_m: Option<[f64; 2]>,
    /// The fault of its heights.
    ground_fault: Option<String>,
    /// Mixing ratios that are below 0, and those that are NaN or fill values.
    oddities: InvalidCounts,
}

/// Clouds diagnosed from humidity.
struct Diagnosed {
    /// Cells of these and of the given clouds.
    cells: Agreement,
    mean_opacity: f64,
}

impl Diagnosed {
    fn of(step: &Step) -> Diagnosed {
        let found = diagnosed::extinction(&step.grid, &step.air);
        Diagnosed {
            cells: Agreement::of(&step.extinction, &found),
            mean_opacity: statistics::of(&step.grid, &found).mean_opacity,
        }
    }

    fn to_json(&self) -> Value {
        let Agreement { n_hits, n_missed, n_false, n_clear } = self.cells;
        json!({
            "hits": n_hits, "missed": n_missed, "false_alarms": n_false, "clear": n_clear,
            "bias": self.cells.bias(), "hit_rate": self.cells.hit_rate(),
            "false_alarm_rate": self.cells.false_alarm_rate(),
            "false_alarm_ratio": self.cells.false_alarm_ratio(),
            "mean_opacity": self.mean_opacity,
        })
    }
}

impl StepSummary {
    fn read(file: &WeatherFile, i_step: usize, is_compared: bool) -> Result<StepSummary> {
        let step = file.step(i_step)?;
        let (ground_m, ground_fault) = match file.terrain(i_step) {
            Ok(found) => (found.map(|(_, heights_m)| extent(&heights_m)), None),
            Err(fault) => (None, Some(fault.to_string())),
        };
        let time_s = file.times_s.as_ref().map(|times| times[i_step]);
        let toward =
            time_s.zip(step.middle).map(|(time_s, (north, east))| sun::toward(time_s, north, east));
        let azimuth = |x: f64, z: f64| x.atan2(-z).to_degrees().rem_euclid(360.0);
        Ok(StepSummary {
            i_step,
            time: time_s.map(steps::format),
            middle_deg: step.middle.map(|(north, east)| (north.to_degrees(), east.to_degrees())),
            sun_deg: toward.map(|d| (d.y.asin().to_degrees(), azimuth(d.x, d.z))),
            clouds: statistics::of(&step.grid, &step.extinction),
            diagnosed: is_compared.then(|| Diagnosed::of(&step)),
            ground_m,
            ground_fault,
            oddities: step.oddities,
        })
    }

    fn to_json(&self) -> Value {
        let c = &self.clouds;
        json!({
            "step": self.i_step, "time": self.time,
            "latitude_deg": self.middle_deg.map(|(north, _)| north),
            "longitude_deg": self.middle_deg.map(|(_, east)| east),
            "sun_elevation_deg": self.sun_deg.map(|(elevation, _)| elevation),
            "sun_azimuth_deg": self.sun_deg.map(|(_, azimuth)| azimuth),
            "clouds": {
                "cells": c.n_cells, "columns": c.n_columns,
                "greatest_extinction_per_m": c.greatest_extinction,
                "greatest_depth": c.greatest_depth, "mean_opacity": c.mean_opacity,
                "base_m": c.base_and_top_m.map(|(base, _)| base),
                "top_m": c.base_and_top_m.map(|(_, top)| top),
                "columns_to_the_top": c.n_columns_to_the_top,
            },
            "diagnosed": self.diagnosed.as_ref().map(Diagnosed::to_json),
            "ground_m": self.ground_m,
            "negative": self.oddities.n_negative, "missing": self.oddities.n_missing,
        })
    }
}

fn to_json(name: &str, file: &WeatherFile, notes: &[String], steps: &[StepSummary]) -> Value {
    json!({
        "file": name, "container": file.container.kind, "title": file.text("TITLE").map(plain),
        "grid": {
            "nx": file.shape.nx, "ny": file.shape.ny, "nz": file.shape.nz,
            "dx_m": file.spacing_m.0, "dy_m": file.spacing_m.1,
            "projection": projection(file), "idealised": file.is_idealised,
        },
        "n_steps": file.n_steps,
        // Given as mixing ratios, or diagnosed from humidity.
        "clouds": if file.clouds == Clouds::Given { "given" } else { "diagnosed" },
        "notes": notes,
        "variables": file.container.variables.iter().map(variable_json).collect::<Vec<_>>(),
        "steps": steps.iter().map(StepSummary::to_json).collect::<Vec<_>>(),
    })
}

fn variable_json(v: &Variable) -> Value {
    let text = |name| plain(v.text(name).unwrap_or_default());
    let dimensions = v.dimensions.iter();
    let dimensions = dimensions.map(|d| json!({ "name": plain(&d.name), "length": d.length }));
    json!({
        "name": plain(&v.name), "type": v.kind, "dimensions": dimensions.collect::<Vec<_>>(),
        "units": text("units"), "description": text("description"),
    })
}

/// Returns the name of the map projection.
fn projection(file: &WeatherFile) -> String {
    let found = file.text("MAP_PROJ_CHAR").filter(|text| !text.is_empty());
    plain(found.unwrap_or(if file.is_idealised { "none" } else { "unknown" }))
}

/// Shortens a text from a file and escapes control characters, which a terminal would interpret.
fn plain(text: &str) -> String {
    text.chars()
        .take(80)
        .flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] })
        .collect()
}

/// Returns notes on clouds that the highest level cuts off and on faulty ground.
fn notes(steps: &[StepSummary]) -> impl Iterator<Item = String> {
    let cut = steps.iter().max_by_key(|s| s.clouds.n_columns_to_the_top);
    let cut = cut.filter(|s| s.clouds.n_columns_to_the_top > 0).map(|s| {
        format!(
            "at step {} clouds of {} columns reach the highest level; the file has nothing above",
            s.i_step, s.clouds.n_columns_to_the_top
        )
    });
    let fault = steps.iter().find_map(|s| s.ground_fault.as_ref());
    cut.into_iter().chain(fault.map(|what| format!("no ground: {what}")))
}

/// Returns a number without decimals; a zero has no sign.
fn whole(number: f64) -> String {
    format!("{:.0}", if number.round() == 0.0 { 0.0 } else { number })
}

fn extent(numbers: &[f64]) -> [f64; 2] {
    [
        numbers.iter().copied().fold(f64::INFINITY, f64::min),
        numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ]
}

fn describe(name: &str, file: &WeatherFile, notes: &[String], steps: &[StepSummary]) -> String {
    let container = &file.container;
    let title = file.text("TITLE").map_or("no title".to_owned(), plain);
    let mut out = format!("{name}: {}, {title}\n", container.kind);
    let map = match file.is_idealised {
        true => "idealised, no map".to_owned(),
        false => format!("map {}", projection(file)),
    };
    let (shape, (dx_m, dy_m)) = (file.shape, file.spacing_m);
    out += &format!(
        "{} x {} columns of {dx_m} x {dy_m} m, {} levels; {map}\n",
        shape.nx, shape.ny, shape.nz
    );
    let (source, cells) = match file.clouds {
        Clouds::Given => ("the file's mixing ratios", "cloudy cells"),
        Clouds::Diagnosed => ("relative humidity: diagnosed", "diagnosed cells"),
    };
    out += &format!("clouds from {source}\n");
    for note in notes {
        out += &format!("note: {note}\n");
    }
    let (variables, clouds) = (variables(&container.variables), clouds(steps, cells));
    out += &format!("\n{}\n{}", output::table(&variables), output::table(&clouds));
    if steps.iter().any(|s| s.diagnosed.is_some()) {
        out += &format!(
            "\nclouds diagnosed from humidity, by cells:\n{}",
            output::table(&agreements(steps))
        );
    }
    out
}

fn agreements(steps: &[StepSummary]) -> Vec<Vec<String>> {
    let mut table =
        header(["step", "bias", "hit rate", "false alarm rate", "false alarm ratio", "opacity"]);
    let rate = |rate: Option<f64>| or_dash(rate, |rate| format!("{rate:.3}"));
    for s in steps {
        let Some(Diagnosed { cells, mean_opacity }) = &s.diagnosed else { continue };
        table.push(vec![
            s.i_step.to_string(),
            rate(cells.bias()),
            rate(cells.hit_rate()),
            rate(cells.false_alarm_rate()),
            rate(cells.false_alarm_ratio()),
            format!("{mean_opacity:.4}"),
        ]);
    }
    table
}

fn variables(variables: &[Variable]) -> Vec<Vec<String>> {
    let mut table = header(["variable", "type", "shape", "units"]);
    for v in variables {
        let shape: Vec<String> = v.dimensions.iter().map(|d| d.length.to_string()).collect();
        let units = plain(v.text("units").unwrap_or_default());
        table.push(vec![plain(&v.name), v.kind.clone(), shape.join(" x "), units]);
    }
    table
}

fn clouds(steps: &[StepSummary], cells: &str) -> Vec<Vec<String>> {
    let mut table = header([
        "step",
        "time (UTC)",
        "middle",
        "sun",
        cells,
        "columns",
        "max 1/m",
        "max depth",
        "opacity",
        "base m",
        "top m",
        "ground m",
        "odd",
    ]);
    let place = |(north, east): (f64, f64)| {
        let side = |degrees: f64, ahead, behind| {
            format!("{:.1}° {}", degrees.abs(), if degrees < 0.0 { behind } else { ahead })
        };
        format!("{} {}", side(north, "N", "S"), side(east, "E", "W"))
    };
    let metres = |m: f64| format!("{m:.0}");
    for s in steps {
        let c = &s.clouds;
        let odd = match (s.oddities.n_negative, s.oddities.n_missing) {
            (0, 0) => "0".to_owned(),
            (negative, missing) => format!("{negative} negative, {missing} missing"),
        };
        table.push(vec![
            s.i_step.to_string(),
            or_dash(s.time.clone(), |time| time),
            or_dash(s.middle_deg, place),
            or_dash(s.sun_deg, |(elevation, _)| format!("{elevation:.1}°")),
            if c.n_cells == 0 { "no cloud".to_owned() } else { c.n_cells.to_string() },
            c.n_columns.to_string(),
            format!("{:.4}", c.greatest_extinction),
            format!("{:.2}", c.greatest_depth),
            format!("{:.4}", c.mean_opacity),
            or_dash(c.base_and_top_m, |(base, _)| metres(base)),
            or_dash(c.base_and_top_m, |(_, top)| metres(top)),
            or_dash(s.ground_m, |[least, most]| format!("{} to {}", whole(least), whole(most))),
            odd,
        ]);
    }
    table
}
