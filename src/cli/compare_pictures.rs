//! `nimbus compare A.exr B.exr`, or of two PNGs.

use std::path::Path;

use glam::DVec3;
use serde_json::{Map, Value, json};

use super::args::CompareArgs;
use super::output::{self, claim_file, or_dash};
use crate::error::{Error, Result};
use crate::io::image::{self, Image, ImageKind};
use crate::measure::picture::flip::{self, Flip};
use crate::measure::picture::{self, PEAK, RELATIVE_EPSILON, ssim};
use crate::model::film::{Film, FilmFormat, ToneMap};

/// Version of the output of `--json`. A change of a key or of its meaning raises it.
const REPORT_SCHEMA: u32 = 1;

/// A metric over red, green and blue together, or over alpha if both files have it.
struct Metric {
    name: &'static str,
    /// `None` if it is not defined for these pictures.
    value: Option<f64>,
    /// The value as the table has it.
    text: String,
    /// The numbers that it compares.
    of: String,
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
        (true, true) if !args.more.is_empty() => {
            let n = 2 + args.more.len();
            Err(Error::usage(format!("expected two pictures, found {n} arguments")))
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
    let mut _claim = None;
    if let Some(path) = &args.output {
        if ImageKind::of(path) != Ok(ImageKind::Png) {
            return Err(Error::usage(format!(
                "{}: expected a file name that ends in .png",
                path.display()
            )));
        }
        _claim = claim_file(path, args.force)?;
    }
    let (a, b) = (image::read(&args.a)?, image::read(&args.b)?);
    check_alike(args, &a, &b)?;
    let pixels_per_degree = args.pixels_per_degree.unwrap_or(flip::PIXELS_PER_DEGREE);
    let (metrics, flip) = measure(&a, &b, pixels_per_degree).ok_or_else(|| {
        let (a, b) = (args.a.display(), args.b.display());
        Error::usage(format!("{a} and {b}: no pixel is finite in both"))
    })?;
    let not_finite = a.rgba.iter().zip(&b.rgba).filter(|(p, q)| !both_finite(p, q)).count();
    let of_each = [&a, &b].map(|image| picture::n_not_finite(&image.rgba));
    if let Some(path) = &args.output {
        image::write_bytes(path, a.width, a.height, &flip.shown())?;
        output::wrote(path, "FLIP of every pixel, black to yellow", false);
    }
    if args.json {
        let values: Map<String, Value> =
            metrics.iter().map(|m| (m.name.to_owned(), m.value.into())).collect();
        output::object(&json!({
            "schema": REPORT_SCHEMA,
            "a": args.a.display().to_string(), "b": args.b.display().to_string(),
            "width": a.width, "height": a.height, "values": values_of(&a),
            "not_finite_a": of_each[0], "not_finite_b": of_each[1],
            // Pixels that are not finite in A or B, which the errors leave out.
            "not_finite": not_finite,
            "metrics": values, "rel_mse_epsilon": RELATIVE_EPSILON, "psnr_peak": PEAK,
            "pixels_per_degree": pixels_per_degree,
        }))?;
    } else {
        output::text(&text(args, &a, &metrics, not_finite, of_each))?;
    }
    let beyond = beyond(args, &metrics, not_finite);
    if beyond.is_empty() { Ok(()) } else { Err(Error::Check { what: beyond.join("; ") }) }
}

/// Returns "linear" for an EXR, "display" for a PNG (sRGB in 0..1).
fn values_of(image: &Image) -> &'static str {
    if image.kind == ImageKind::Exr { "linear" } else { "display" }
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
fn measure(a: &Image, b: &Image, pixels_per_degree: f64) -> Option<(Vec<Metric>, Flip)> {
    let pairs = || a.rgba.iter().zip(&b.rgba).filter(|(p, q)| both_finite(p, q));
    let color = picture::errors(pairs().flat_map(|(p, q)| (0..3).map(|i| (p[i], q[i]))))?;
    let alpha = (a.has_alpha && b.has_alpha)
        .then(|| picture::errors(pairs().map(|(p, q)| (p[3], q[3]))))
        .flatten();
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
        |shown: &[[f64; 3]]| -> Vec<f64> { shown.iter().map(|p| ssim::luminance(*p)).collect() };
    let (width, height) = (a.width as usize, a.height as usize);
    let ssim = ssim::ssim(width, height, &luminance(&shown_a), &luminance(&shown_b));
    let how = if a.kind == ImageKind::Exr { "over black, tone-mapped" } else { "as stored" };
    let of_ssim = format!("luminance, {how}; Gaussian window 11, σ 1.5, C1 = 0.01², C2 = 0.03²");
    let exact = |v: f64| format!("{v:.6e}");
    let metrics = [
        ("rmse", Some(color.rmse), exact(color.rmse), format!("{} values, RGB", values_of(a))),
        ("max", Some(color.max_abs), exact(color.max_abs), "the same".to_owned()),
        (
            "relmse",
            Some(color.rel_mse),
            exact(color.rel_mse),
            format!("the same, (b - a)²/(a² + {RELATIVE_EPSILON})"),
        ),
        (
            "psnr",
            Some(color.psnr_db),
            format!("{:.3} dB", color.psnr_db),
            format!("the same, peak {PEAK}"),
        ),
        ("ssim", ssim, or_dash(ssim, |v| format!("{v:.6}")), of_ssim),
        (
            "flip",
            Some(flip.mean()),
            format!("{:.6}", flip.mean()),
            format!("mean, {how}; {pixels_per_degree:.2} pixels a degree"),
        ),
        ("alpha_rmse", alpha.map(|e| e.rmse), or_dash(alpha, |e| exact(e.rmse)), "alpha".into()),
        (
            "alpha_max",
            alpha.map(|e| e.max_abs),
            or_dash(alpha, |e| exact(e.max_abs)),
            "alpha".into(),
        ),
    ];
    let metric = |(name, value, text, of)| Metric { name, value, text, of };
    Some((metrics.map(metric).into(), flip))
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

/// Returns the table for people. `of_each` counts the pixels that are not finite in A and in B.
fn text(
    args: &CompareArgs,
    a: &Image,
    metrics: &[Metric],
    not_finite: usize,
    of_each: [usize; 2],
) -> String {
    let n_bad = not_finite.to_string();
    let mut rows = vec![["metric", "value", "of"]];
    // Without alpha in both pictures the table is shorter.
    let shown = metrics.iter().filter(|m| m.value.is_some() || m.name == "ssim");
    rows.extend(shown.map(|m| [m.name, &m.text, &m.of]));
    rows.push(["not_finite", &n_bad, "pixels, left out"]);
    let [name, value] =
        [0, 1].map(|c| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0));
    let (path_a, path_b) = (args.a.display(), args.b.display());
    let mut out = format!("A  {path_a}\nB  {path_b}, {}×{} pixels\n\n", a.width, a.height);
    for [n, v, of] in &rows {
        out += &format!("{n:name$}  {v:>value$}  {of}\n");
    }
    if not_finite > 0 {
        let [of_a, of_b] = of_each;
        out += &format!("\nnot finite: {of_a} pixels of A, {of_b} of B\n");
    }
    out
}

/// Returns a line for every limit that a metric exceeds.
fn beyond(args: &CompareArgs, metrics: &[Metric], not_finite: usize) -> Vec<String> {
    let value = |name: &str| match metrics.iter().find(|m| m.name == name) {
        Some(metric) => metric.value,
        None => Some(not_finite as f64),
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
