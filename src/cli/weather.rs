//! `nimbus weather FILE`.

use serde::Serialize;

use super::args::WeatherArgs;
use super::output::{self, header, or_dash};
use super::progress::LateProgress;
use crate::error::Result;
use crate::io::weather::container::Variable;
use crate::io::weather::wrf::{self, Clouds, WeatherFile};
use crate::model::weather::statistics::{self, CloudStatistics};
use crate::model::weather::{steps, sun};

/// Runs `nimbus weather`.
///
/// # Errors
/// Fails if the file is no output of WRF or has no such step.
pub fn run(args: &WeatherArgs) -> Result<()> {
    let file = wrf::open(&args.file)?;
    let wanted = match args.step {
        Some(i_step) => i_step..i_step + 1,
        None => 0..file.n_steps,
    };
    let progress = LateProgress::new(wanted.len() as u64, "reading steps", args.quiet);
    let mut of_steps = Vec::with_capacity(wanted.len());
    for i_step in wanted {
        of_steps.push(step_row(&file, i_step)?);
        progress.advance();
    }
    drop(progress);
    let mut found =
        Report { about: about(&file, &args.file.display().to_string()), steps: of_steps };
    found.about.notes.extend(notes(&found.steps));
    if args.json {
        return output::object(&found);
    }
    output::text(&describe(&found, args.quiet))
}

#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    about: About,
    steps: Vec<StepRow>,
}

#[derive(Serialize)]
struct About {
    file: String,
    container: &'static str,
    title: Option<String>,
    grid: GridRow,
    n_steps: usize,
    /// "given" as mixing ratios, or "diagnosed" from humidity.
    clouds: &'static str,
    notes: Vec<String>,
    variables: Vec<VariableRow>,
}

#[derive(Serialize)]
struct GridRow {
    nx: usize,
    ny: usize,
    nz: usize,
    dx_m: f64,
    dy_m: f64,
    /// Name of the map projection in the file.
    projection: String,
    /// Whether the domain has no map.
    idealised: bool,
}

#[derive(Serialize)]
struct VariableRow {
    name: String,
    r#type: String,
    dimensions: Vec<DimensionRow>,
    units: String,
    description: String,
}

#[derive(Serialize)]
struct DimensionRow {
    name: String,
    length: u64,
}

#[derive(Serialize)]
struct StepRow {
    step: usize,
    time: Option<String>,
    /// Position of the middle of the domain.
    latitude_deg: Option<f64>,
    longitude_deg: Option<f64>,
    /// Direction of the sun in the middle of the domain: above the horizon, and from north over
    /// east.
    sun_elevation_deg: Option<f64>,
    sun_azimuth_deg: Option<f64>,
    clouds: CloudRow,
    /// Least and greatest height of the ground; none if the file has no valid heights.
    ground_m: Option<[f64; 2]>,
    /// The fault of its heights.
    #[serde(skip)]
    ground_fault: Option<String>,
    /// Mixing ratios below 0.
    negative: u64,
    /// Mixing ratios that are NaN or fill values.
    missing: u64,
}

#[derive(Serialize)]
struct CloudRow {
    cells: usize,
    columns: usize,
    greatest_extinction_per_m: f64,
    greatest_depth: f64,
    mean_opacity: f64,
    base_m: Option<f64>,
    top_m: Option<f64>,
    /// Columns with cloud in the highest level.
    columns_to_the_top: usize,
}

impl From<CloudStatistics> for CloudRow {
    fn from(s: CloudStatistics) -> Self {
        CloudRow {
            cells: s.n_cells,
            columns: s.n_columns,
            greatest_extinction_per_m: s.greatest_extinction,
            greatest_depth: s.greatest_depth,
            mean_opacity: s.mean_opacity,
            base_m: s.base_and_top_m.map(|(base, _)| base),
            top_m: s.base_and_top_m.map(|(_, top)| top),
            columns_to_the_top: s.n_columns_to_the_top,
        }
    }
}

fn about(file: &WeatherFile, name: &str) -> About {
    let container = &file.container;
    let projection = file.text("MAP_PROJ_CHAR").filter(|text| !text.is_empty());
    About {
        file: name.to_owned(),
        container: container.kind,
        title: file.text("TITLE").map(plain),
        grid: GridRow {
            nx: file.shape.nx,
            ny: file.shape.ny,
            nz: file.shape.nz,
            dx_m: file.spacing_m.0,
            dy_m: file.spacing_m.1,
            projection: plain(projection.unwrap_or(if file.is_idealised {
                "none"
            } else {
                "unknown"
            })),
            idealised: file.is_idealised,
        },
        n_steps: file.n_steps,
        clouds: if file.clouds == Clouds::Given { "given" } else { "diagnosed" },
        notes: file.notes.clone(),
        variables: container.variables.iter().map(variable_row).collect(),
    }
}

fn variable_row(v: &Variable) -> VariableRow {
    let text = |name| plain(v.text(name).unwrap_or_default());
    let dimension = |name: &str, length| DimensionRow { name: plain(name), length };
    VariableRow {
        name: plain(&v.name),
        r#type: v.kind.clone(),
        dimensions: v.dimensions.iter().map(|d| dimension(&d.name, d.length)).collect(),
        units: text("units"),
        description: text("description"),
    }
}

/// Shortens a text from a file and escapes control characters, which a terminal would interpret.
fn plain(text: &str) -> String {
    text.chars()
        .take(80)
        .flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] })
        .collect()
}

fn step_row(file: &WeatherFile, i_step: usize) -> Result<StepRow> {
    let step = file.step(i_step)?;
    let ground = file.terrain(i_step);
    let time_s = file.times_s.as_ref().map(|times| times[i_step]);
    let toward =
        time_s.zip(step.middle).map(|(time_s, (north, east))| sun::toward(time_s, north, east));
    Ok(StepRow {
        step: i_step,
        time: time_s.map(steps::format),
        latitude_deg: step.middle.map(|(latitude, _)| latitude.to_degrees()),
        longitude_deg: step.middle.map(|(_, longitude)| longitude.to_degrees()),
        sun_elevation_deg: toward.map(|d| d.y.asin().to_degrees()),
        sun_azimuth_deg: toward.map(|d| d.x.atan2(-d.z).to_degrees().rem_euclid(360.0)),
        clouds: statistics::of(&step.grid, &step.extinction).into(),
        ground_m: ground
            .as_ref()
            .ok()
            .and_then(|found| found.as_ref())
            .map(|(_, heights_m)| extent(heights_m)),
        ground_fault: ground.err().map(|e| e.to_string()),
        negative: step.oddities.n_negative,
        missing: step.oddities.n_missing,
    })
}

/// Returns notes on clouds that the highest level cuts off and on faulty ground.
fn notes(rows: &[StepRow]) -> Vec<String> {
    let cut = rows
        .iter()
        .max_by_key(|r| r.clouds.columns_to_the_top)
        .filter(|r| r.clouds.columns_to_the_top > 0);
    let cut = cut.map(|r| {
        let (n, step) = (r.clouds.columns_to_the_top, r.step);
        format!(
            "at step {step} clouds of {n} columns reach the highest level; the file has nothing \
             above"
        )
    });
    let fault =
        rows.iter().find_map(|r| r.ground_fault.clone()).map(|what| format!("no ground: {what}"));
    cut.into_iter().chain(fault).collect()
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

fn describe(found: &Report, quiet: bool) -> String {
    let (a, g) = (&found.about, &found.about.grid);
    let mut out =
        format!("{}: {}, {}\n", a.file, a.container, a.title.as_deref().unwrap_or("no title"));
    let map =
        if g.idealised { "idealised, no map".to_owned() } else { format!("map {}", g.projection) };
    out += &format!(
        "{} x {} columns of {} x {} m, {} levels; {map}\n",
        g.nx, g.ny, g.dx_m, g.dy_m, g.nz
    );
    let source = if a.clouds == "given" {
        "the file's mixing ratios"
    } else {
        "relative humidity: diagnosed"
    };
    out += &format!("clouds from {source}\n");
    for note in a.notes.iter().filter(|_| !quiet) {
        out += &format!("note: {note}\n");
    }
    out += &format!(
        "\n{}\n{}",
        output::table(&variables(&a.variables)),
        output::table(&clouds(&found.steps, a.clouds))
    );
    out
}

fn variables(rows: &[VariableRow]) -> Vec<Vec<String>> {
    let mut table = header(["variable", "type", "shape", "units"]);
    for v in rows {
        let shape: Vec<String> = v.dimensions.iter().map(|d| d.length.to_string()).collect();
        table.push(vec![v.name.clone(), v.r#type.clone(), shape.join(" x "), v.units.clone()]);
    }
    table
}

fn clouds(rows: &[StepRow], source: &str) -> Vec<Vec<String>> {
    let cells = if source == "given" { "cloudy cells" } else { "diagnosed cells" };
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
    for r in rows {
        let c = &r.clouds;
        let odd = match (r.negative, r.missing) {
            (0, 0) => "0".to_owned(),
            (negative, missing) => format!("{negative} negative, {missing} missing"),
        };
        table.push(vec![
            r.step.to_string(),
            or_dash(r.time.clone(), |time| time),
            or_dash(r.latitude_deg.zip(r.longitude_deg), place),
            or_dash(r.sun_elevation_deg, |degrees| format!("{degrees:.1}°")),
            if c.cells == 0 { "no cloud".to_owned() } else { c.cells.to_string() },
            c.columns.to_string(),
            format!("{:.4}", c.greatest_extinction_per_m),
            format!("{:.2}", c.greatest_depth),
            format!("{:.4}", c.mean_opacity),
            or_dash(c.base_m, metres),
            or_dash(c.top_m, metres),
            or_dash(r.ground_m, |[least, most]| format!("{} to {}", whole(least), whole(most))),
            odd,
        ]);
    }
    table
}
