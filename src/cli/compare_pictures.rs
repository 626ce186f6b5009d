//! `nimbus compare A.exr B.exr`, or of two PNGs.

use std::path::Path;

use glam::DVec3;
use serde::Serialize;

use super::args::CompareArgs;
use super::output::{self, or_dash, refuse_existing};
use crate::error::{Error, Result};
use crate::io::image::{self, Image, ImageKind};
use crate::measure::picture::flip::{self, Flip};
use crate::measure::picture::{self, Errors, PEAK, RELATIVE_EPSILON, ssim};
use crate::model::film::{Film, FilmFormat, ToneMap};

/// The output of `--json`. A change of a key or of its meaning raises `schema`.
#[derive(Debug, Serialize)]
struct Report {
    schema: u32,
    a: String,
    b: String,
    width: u32,
    height: u32,
    /// "linear" (EXR) or "display" (PNG, sRGB in 0..1).
    values: &'static str,
    /// Pixels that are not finite in A.
    not_finite_a: usize,
    /// Pixels that are not finite in B.
    not_finite_b: usize,
    /// Pixels that are not finite in A or B, which the errors leave out.
    not_finite: usize,
    metrics: Metrics,
    /// Constant of the metrics.
    rel_mse_epsilon: f64,
    psnr_peak: f64,
    pixels_per_degree: f64,
}

const REPORT_SCHEMA: u32 = 1;

/// Metrics over red, green and blue together, and over alpha if both files have it.
#[derive(Debug, Clone, Copy, Serialize)]
struct Metrics {
    rmse: f64,
    max: f64,
    relmse: f64,
    /// In dB; null if the pictures are equal.
    psnr: f64,
    /// Null if the pictures are smaller than its window.
    ssim: Option<f64>,
    flip: f64,
    alpha_rmse: Option<f64>,
    alpha_max: Option<f64>,
}

/// Metrics that grow with the difference of pictures, and those that fall.
const OF_DIFFERENCE: [&str; 7] =
    ["rmse", "max", "relmse", "flip", "alpha_rmse", "alpha_max", "not_finite"];
const OF_LIKENESS: [&str; 2] = ["psnr", "ssim"];

/// Returns whether A and B are pictures and not results folders.
///
/// # Errors
/// Fails if only one is a picture, or a flag belongs to the other kind.
pub fn has_pictures(args: &CompareArgs) -> Result<bool> {
    let is_picture = |path: &Path| !path.is_dir() && ImageKind::of(path).is_ok();
    let mixed = |picture: &Path, other: &Path| {
        let (picture, other) = (picture.display(), other.display());
        Err(Error::usage(format!(
            "{picture} is a picture, {other} is not; expected two pictures or two results folders"
        )))
    };
    match (is_picture(&args.a), is_picture(&args.b)) {
        (true, false) => mixed(&args.a, &args.b),
        (false, true) => mixed(&args.b, &args.a),
        (true, true) if !args.allow.is_empty() => {
            Err(Error::usage("--allow is for results folders, not for pictures"))
        }
        (true, true) => Ok(true),
        (false, false) => {
            let is_set = args.output.is_some() || args.pixels_per_degree.is_some();
            match is_set || !args.fail_above.is_empty() || !args.fail_below.is_empty() {
                true => Err(Error::usage(format!(
                    "-o, --pixels-per-degree, --fail-above and --fail-below are for pictures; {} \
                     is none (.png or .exr)",
                    args.a.display()
                ))),
                false => Ok(false),
            }
        }
    }
}

/// Compares two pictures.
///
/// # Errors
/// Fails if the pictures cannot be read or compared, or a metric is beyond its limit.
pub fn run(args: &CompareArgs) -> Result<()> {
    check_names(&args.fail_above, &OF_DIFFERENCE, "--fail-above")?;
    check_names(&args.fail_below, &OF_LIKENESS, "--fail-below")?;
    if let Some(path) = &args.output {
        if ImageKind::of(path) != Ok(ImageKind::Png) {
            return Err(Error::usage(format!(
                "{}: expected a file name that ends in .png",
                path.display()
            )));
        }
        refuse_existing(path, args.force)?;
    }
    let (a, b) = (image::read(&args.a)?, image::read(&args.b)?);
    check_alike(args, &a, &b)?;
    let pixels_per_degree = args.pixels_per_degree.unwrap_or(flip::PIXELS_PER_DEGREE);
    let (metrics, flip) = measure(&a, &b, pixels_per_degree).ok_or_else(|| {
        let (a, b) = (args.a.display(), args.b.display());
        Error::usage(format!("{a} and {b}: no pixel is finite in both"))
    })?;
    let report = Report {
        schema: REPORT_SCHEMA,
        a: args.a.display().to_string(),
        b: args.b.display().to_string(),
        width: a.width,
        height: a.height,
        values: if a.kind == ImageKind::Exr { "linear" } else { "display" },
        not_finite_a: picture::n_not_finite(&a.rgba),
        not_finite_b: picture::n_not_finite(&b.rgba),
        not_finite: a.rgba.iter().zip(&b.rgba).filter(|(p, q)| !both_finite(p, q)).count(),
        metrics,
        rel_mse_epsilon: RELATIVE_EPSILON,
        psnr_peak: PEAK,
        pixels_per_degree,
    };
    if let Some(path) = &args.output {
        image::write_bytes(path, a.width, a.height, &flip.shown())?;
    }
    if args.json {
        output::object(&report)?
    } else {
        output::text(&text(&report))?
    }
    let beyond = beyond(args, &report);
    if beyond.is_empty() { Ok(()) } else { Err(Error::Check { what: beyond.join("; ") }) }
}

fn check_names(limits: &[(String, f64)], known: &[&str], flag: &str) -> Result<()> {
    match limits.iter().find(|(name, _)| !known.contains(&name.as_str())) {
        Some((name, _)) => {
            Err(Error::usage(format!("{flag} {name}: expected one of {}", known.join(", "))))
        }
        None => Ok(()),
    }
}

fn check_alike(args: &CompareArgs, a: &Image, b: &Image) -> Result<()> {
    let both = |of: &dyn Fn(&Image) -> String| {
        let (path_a, path_b) = (args.a.display(), args.b.display());
        format!("{path_a} {}, {path_b} {}", of(a), of(b))
    };
    if a.kind != b.kind {
        let what = both(&|i| {
            if i.kind == ImageKind::Exr { "is linear".into() } else { "is for display".into() }
        });
        return Err(Error::usage(format!("{what}; expected two .exr or two .png")));
    }
    if (a.width, a.height) != (b.width, b.height) {
        let what = both(&|i| format!("has {}×{} pixels", i.width, i.height));
        return Err(Error::usage(format!("{what}; expected pictures of one size")));
    }
    Ok(())
}

fn both_finite(a: &[f64; 4], b: &[f64; 4]) -> bool {
    picture::is_finite(a) && picture::is_finite(b)
}

/// Computes the metrics and the FLIP map; None if no pixel is finite in both.
fn measure(a: &Image, b: &Image, pixels_per_degree: f64) -> Option<(Metrics, Flip)> {
    let pairs = || a.rgba.iter().zip(&b.rgba).filter(|(p, q)| both_finite(p, q));
    let color = picture::errors(pairs().flat_map(|(p, q)| (0..3).map(|i| (p[i], q[i]))))?;
    let alpha: Option<Errors> = if a.has_alpha && b.has_alpha {
        picture::errors(pairs().map(|(p, q)| (p[3], q[3])))
    } else {
        None
    };
    // Display values; a pixel that the errors leave out is black in both.
    let show = |of: &Image| -> Vec<[f64; 3]> {
        let shown = |((p, q), own): ((&[f64; 4], &[f64; 4]), &[f64; 4])| match both_finite(p, q) {
            true => display(of.kind, own),
            false => [0.0; 3],
        };
        a.rgba.iter().zip(&b.rgba).zip(&of.rgba).map(shown).collect()
    };
    let (shown_a, shown_b) = (show(a), show(b));
    let bytes = |shown: &[[f64; 3]]| -> Vec<u8> {
        shown.iter().flatten().map(|v| (255.0 * v).round() as u8).collect()
    };
    let flip = flip::flip(a.width, a.height, &bytes(&shown_a), &bytes(&shown_b), pixels_per_degree);
    let luminance =
        |shown: &[[f64; 3]]| shown.iter().map(|p| ssim::luminance(*p)).collect::<Vec<f64>>();
    let metrics = Metrics {
        rmse: color.rmse,
        max: color.max_abs,
        relmse: color.rel_mse,
        psnr: color.psnr_db,
        ssim: ssim::ssim(
            a.width as usize,
            a.height as usize,
            &luminance(&shown_a),
            &luminance(&shown_b),
        ),
        flip: flip.mean(),
        alpha_rmse: alpha.map(|e| e.rmse),
        alpha_max: alpha.map(|e| e.max_abs),
    };
    Some((metrics, flip))
}

/// Returns the display values of a pixel: those of a PNG as stored, those of an EXR over black and
/// through the default tone map.
fn display(kind: ImageKind, pixel: &[f64; 4]) -> [f64; 3] {
    let [r, g, b, a] = *pixel;
    match kind {
        ImageKind::Png => [r, g, b],
        ImageKind::Exr => {
            let (format, tone_map) = (FilmFormat::Rgba32f, ToneMap::Neutral);
            let film = Film {
                width: 1,
                height: 1,
                format,
                background: DVec3::ZERO,
                exposure: 1.0,
                tone_map,
            };
            film.display(DVec3::new(r, g, b), a).to_array()
        }
    }
}

/// Returns the table for people.
fn text(report: &Report) -> String {
    let Metrics { rmse, max, relmse, psnr, ssim, flip, alpha_rmse, alpha_max } = report.metrics;
    let shown = if report.values == "linear" { "over black, tone-mapped" } else { "as stored" };
    let mut rows = output::header(["metric", "value", "of"]);
    let mut row =
        |name: &str, value: String, of: String| rows.push(vec![name.to_owned(), value, of]);
    row("rmse", format!("{rmse:.6e}"), format!("{} values, RGB", report.values));
    row("max", format!("{max:.6e}"), "the same".into());
    row("relmse", format!("{relmse:.6e}"), format!("the same, (b - a)²/(a² + {RELATIVE_EPSILON})"));
    row("psnr", format!("{psnr:.3} dB"), format!("the same, peak {PEAK}"));
    let of_ssim = format!("luminance, {shown}; Gaussian window 11, σ 1.5, C1 = 0.01², C2 = 0.03²");
    row("ssim", or_dash(ssim, |v| format!("{v:.6}")), of_ssim);
    row(
        "flip",
        format!("{flip:.6}"),
        format!("mean, {shown}; {:.2} pixels a degree", report.pixels_per_degree),
    );
    if let (Some(rmse), Some(max)) = (alpha_rmse, alpha_max) {
        row("alpha_rmse", format!("{rmse:.6e}"), "alpha".into());
        row("alpha_max", format!("{max:.6e}"), "alpha".into());
    }
    row("not_finite", report.not_finite.to_string(), "pixels, left out".into());
    let widths = [0, 1].map(|c| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0));
    let mut out =
        format!("A  {}\nB  {}, {}×{} pixels\n\n", report.a, report.b, report.width, report.height);
    for row in &rows {
        let [name, value] = [0, 1].map(|c| " ".repeat(widths[c] - row[c].chars().count()));
        out += format!("{}{name}  {value}{}  {}", row[0], row[1], row[2]).trim_end();
        out.push('\n');
    }
    if report.not_finite > 0 {
        let Report { not_finite_a, not_finite_b, .. } = report;
        out += &format!("\nnot finite: {not_finite_a} pixels of A, {not_finite_b} of B\n");
    }
    out
}

/// Returns a line for every limit that a metric exceeds.
fn beyond(args: &CompareArgs, report: &Report) -> Vec<String> {
    let m = &report.metrics;
    let value = |name: &str| match name {
        "rmse" => Some(m.rmse),
        "max" => Some(m.max),
        "relmse" => Some(m.relmse),
        "psnr" => Some(m.psnr),
        "ssim" => m.ssim,
        "flip" => Some(m.flip),
        "alpha_rmse" => m.alpha_rmse,
        "alpha_max" => m.alpha_max,
        _ => Some(report.not_finite as f64),
    };
    let check = |(name, limit): &(String, f64), is_above: bool| match value(name) {
        None => Some(format!("{name} of these pictures is not defined")),
        Some(v) if is_above && v > *limit => Some(format!("{name} is {v}, above {limit}")),
        Some(v) if !is_above && v < *limit => Some(format!("{name} is {v}, below {limit}")),
        Some(_) => None,
    };
    let above = args.fail_above.iter().filter_map(|limit| check(limit, true));
    above.chain(args.fail_below.iter().filter_map(|limit| check(limit, false))).collect()
}
