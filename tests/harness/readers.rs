//! Checks of parsers, shared by the fuzz targets (fuzz/fuzz_targets) and the regression tests.
//!
//! Every check parses an input. The parser returns either one clean error or a complete value,
//! which is then written and parsed again. A fault is a panic.

#![allow(dead_code, reason = "each program uses its own part")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use nimbus::error::{Error, Place, Result};
use nimbus::frame::Game;
use nimbus::io::scene_file::{LoadedScene, parse_beside};
use nimbus::io::weather::{netcdf, wrf};
use nimbus::io::{box_file, particle_file, ply};
use nimbus::model::weather::particles::Layout;
use nimbus::report::pages::page;
use nimbus::report::pages::source::{Results, Source};
use nimbus::studies::error::files::parse_earlier;
use nimbus::studies::error::records::Study;
use nimbus::studies::ledger::records::Ledger;
use nimbus::timing::compare::Comparison;
use nimbus::timing::json;
use nimbus::timing::results::parse_results;
use nimbus::timing::verdict::MARGIN;
use serde_json::Value;

/// A folder that does not exist, so that no input reads files of the machine.
pub const NOWHERE: &str = "/nowhere/of/nimbus";

/// Largest scene whose frames are computed, in particles, facets and waves. Larger scenes are only
/// parsed.
const MAX_PLAYED: u64 = 4096;

/// Length limit of a message, bytes. A longer message repeats its input.
const MAX_MESSAGE: usize = 4096;

/// Splits an input into files, which are separated by zero bytes.
fn parts(bytes: &[u8]) -> Option<Vec<&str>> {
    bytes.split(|b| *b == 0).map(|part| std::str::from_utf8(part).ok()).collect()
}

/// Checks the parser of scenes. The parts of the input are the scene, the content of every box
/// file, the content of every particle list (.csv), and arguments of `--set`.
pub fn scene_file(bytes: &[u8]) -> std::result::Result<(), String> {
    let Some(parts) = parts(bytes) else { return Err("no text".to_owned()) };
    let part = |i: usize| parts.get(i).copied().unwrap_or_default();
    let overrides: Vec<String> = parts.iter().skip(3).map(|s| (*s).to_owned()).collect();
    let path = Path::new(NOWHERE).join("scene.toml");
    let files = |path: &Path, first: &str| -> Result<String> {
        let is_list = path.extension().is_some_and(|e| e == "csv");
        let text = part(if is_list { 2 } else { 1 });
        match text.trim().is_empty() {
            true => Err(Error::scene(
                Place::line(path, 1, 1),
                format!("the file is empty: expected {first}"),
            )),
            false => Ok(text.to_owned()),
        }
    };
    let loaded = match parse_beside(part(0).to_owned(), &path, &overrides, None, &files) {
        Ok(loaded) => loaded,
        Err(error) => return Err(clean(&error, &parts)),
    };
    let resolved = to_toml(&loaded.resolved);
    let again = parse_beside(resolved.clone(), &path, &[], None, &files);
    let again =
        again.unwrap_or_else(|e| panic!("the resolved scene does not load: {e}\n{resolved}"));
    assert_eq!(again.hash(), loaded.hash(), "the resolved scene is another one:\n{resolved}");
    play(&loaded);
    Ok(())
}

/// Runs the game step of the first and the last frame.
fn play(loaded: &LoadedScene) {
    let scene = &loaded.scene;
    let n_waves: u64 = scene.clouds.iter().map(|c| u64::from(c.gust.n_waves)).sum();
    // Computing the basis of a lobe takes longer than everything else.
    let is_glossy = scene.materials.iter().any(|m| m.is_glossy());
    if is_glossy || scene.n_particles() + scene.n_surface_facets() + n_waves > MAX_PLAYED {
        return;
    }
    let mut game = Game::new(Arc::new(scene.clone()), None);
    for i_frame in [0, scene.time.n_frames - 1] {
        match game.step(i_frame) {
            Ok(packet) => assert!(
                packet.radius.is_finite() && packet.heaviest.is_finite(),
                "a packet of numbers"
            ),
            Err(error) => drop(clean(&error, &[])),
        }
    }
}

/// Checks the parser of box files.
pub fn boxes(bytes: &[u8]) -> std::result::Result<(), String> {
    let Ok(text) = std::str::from_utf8(bytes) else { return Err("no text".to_owned()) };
    let path = Path::new("b.dat");
    let boxes = box_file::parse(text, path).map_err(|e| clean(&e, &[text]))?;
    let written = box_file::format(&boxes);
    let again = box_file::parse(&written, path)
        .unwrap_or_else(|e| panic!("what was written is not read: {e}\n{written}"));
    assert_eq!(again, boxes, "{written}");
    Ok(())
}

/// Checks the parser of particle lists: every particle has its own line.
pub fn particle_list(bytes: &[u8]) -> std::result::Result<(), String> {
    let Ok(text) = std::str::from_utf8(bytes) else { return Err("no text".to_owned()) };
    let (particles, lines) =
        particle_file::parse(text, Path::new("p.csv")).map_err(|e| clean(&e, &[text]))?;
    assert_eq!(particles.len(), lines.len());
    // CSV ends a row at a single carriage return, where no line ends.
    let is_after = |w: &[usize]| if text.contains('\r') { w[0] <= w[1] } else { w[0] < w[1] };
    assert!(lines.windows(2).all(is_after), "lines in order: {lines:?}");
    assert!(
        lines.last().is_none_or(|last| *last <= text.split('\n').count()),
        "a line of the file"
    );
    Ok(())
}

/// Checks the parser of PLY files: what is written is read again.
pub fn ply(bytes: &[u8]) -> std::result::Result<(), String> {
    let found = ply::parse(bytes, Path::new("p.ply")).map_err(|e| clean(&e, &[]))?;
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("p.ply");
    ply::write(&path, &found.particles).expect("room");
    let written = std::fs::read(&path).expect("what was written");
    let again = ply::parse(&written, Path::new("p.ply")).expect("what was written");
    assert_eq!(again.particles.len(), found.particles.len());
    for (a, b) in again.particles.iter().zip(&found.particles) {
        // The axes are stored within 5e-6 radians.
        let (found, expected) = (a.shape.covariance(), b.shape.covariance());
        assert!(found.abs_diff_eq(expected, 3e-5 * b.shape.widest().powi(2)), "{a:?} {b:?}");
        assert!((a.shape.volume() / b.shape.volume() - 1.0).abs() < 1e-12, "{a:?} {b:?}");
        assert_eq!(
            (a.position, a.sigma, a.kappa, a.color),
            (b.position, b.sigma, b.kappa, b.color)
        );
    }
    Ok(())
}

/// Checks the parsers of results: a JSON file and, after a zero byte, its table. Complete results
/// become a page that compares them with themselves.
pub fn results(bytes: &[u8]) -> std::result::Result<(), String> {
    let Some(parts) = parts(bytes) else { return Err("no text".to_owned()) };
    let (text, table) = (parts[0], parts.get(1).copied().unwrap_or_default());
    let path = |name: &str| Path::new(NOWHERE).join(name);
    let mut errors = Vec::new();
    let mut refuse = |e: Error| errors.push(clean(&e, &[]));
    let mut found = Vec::new();
    match json::parse(text, &path("run.json")) {
        Ok(run) => match parse_results(run, table, &path("frames.csv")) {
            Ok(recorded) => found.push(Results::Bench(Box::new(recorded))),
            Err(e) => refuse(e),
        },
        Err(e) => refuse(e),
    }
    match json::parse::<Study>(text, &path("study.json")) {
        // A study without a table is one that will not be resumed.
        Ok(study) => match parse_earlier(study.clone(), table, &path("times.csv")) {
            Err(e) if !table.is_empty() => refuse(e),
            _ => found.push(Results::Study(Box::new(study))),
        },
        Err(e) => refuse(e),
    }
    match json::parse::<Ledger>(text, &path("ledger.json")) {
        Ok(ledger) => found.push(Results::Ledger(Box::new(ledger))),
        Err(e) => refuse(e),
    }
    if found.is_empty() {
        return Err(errors.join(" | "));
    }
    found.into_iter().try_for_each(show)
}

/// Checks the reader of weather files, with their first steps.
pub fn weather(bytes: &[u8]) -> std::result::Result<(), String> {
    const MOST_STEPS: usize = 4;
    let container = netcdf::from_bytes(bytes.to_vec())?;
    let file = wrf::from_container(container, Path::new("w.nc")).map_err(|e| clean(&e, &[]))?;
    for i_step in 0..file.n_steps.min(MOST_STEPS) {
        let step = file.step(i_step).map_err(|e| clean(&e, &[]))?;
        let layout = Layout::new(&step.grid, &[&step.extinction], 100, 1);
        for blob in layout.blobs(&step.grid, &step.extinction) {
            assert!(
                blob.position.is_finite() && blob.kappa >= 0.0 && blob.kappa.is_finite(),
                "{blob:?}"
            );
        }
        let ground = file.terrain(i_step).map_err(|e| clean(&e, &[]))?;
        assert!(ground.iter().flat_map(|(_, heights_m)| heights_m).all(|h| h.abs() <= 200_000.0));
    }
    Ok(())
}

/// Creates a page of results compared with themselves, and compares benches as `nimbus compare`
/// does.
fn show(results: Results) -> std::result::Result<(), String> {
    if let Results::Bench(recorded) = &results {
        drop(Comparison::new(recorded, recorded, MARGIN));
    }
    let source = |name: &str| Source {
        name: name.to_owned(),
        folder: PathBuf::from(NOWHERE),
        results: results.clone(),
    };
    let html = page(&[source("a"), source("b")]).map_err(|e| clean(&e, &[]))?;
    assert!(html.ends_with("</html>"), "a whole page");
    Ok(())
}

/// Checks that an error reports bad input in a short message with a valid line number, and returns
/// the message.
fn clean(error: &Error, texts: &[&str]) -> String {
    let message = error.to_string();
    assert_eq!(error.exit_code(), 2, "{message}");
    if let Error::Scene { at, what } = error {
        assert!(
            !what.is_empty() && what.len() < MAX_MESSAGE,
            "{} bytes of message: {what:.200}",
            what.len()
        );
        let n_lines = texts.iter().map(|text| text.split('\n').count()).max().unwrap_or(usize::MAX);
        assert!(at.line <= n_lines, "{message}");
    }
    message
}

/// Converts JSON to TOML. Strings, numbers and lists are equal in both, except that TOML requires
/// DEL to be escaped.
fn to_toml(resolved: &Value) -> String {
    fn string(text: &str) -> String {
        Value::from(text).to_string().replace('\u{7f}', "\\u007f")
    }
    fn inline(v: &Value) -> String {
        match v {
            Value::Object(map) => {
                let items: Vec<String> =
                    map.iter().map(|(k, v)| format!("{} = {}", string(k), inline(v))).collect();
                format!("{{ {} }}", items.join(", "))
            }
            Value::Array(list) => {
                format!("[{}]", list.iter().map(inline).collect::<Vec<_>>().join(", "))
            }
            Value::String(text) => string(text),
            other => other.to_string(),
        }
    }
    let root = resolved.as_object().expect("a scene is a table");
    root.iter().map(|(k, v)| format!("{k} = {}\n", inline(v))).collect()
}
