//! What is done with an input by the fuzz target of its kind (fuzz/fuzz_targets) and by the
//! regression tests: it is read, and either gives one clean error or something whole, which is then
//! written and read again. A fault is a panic.

#![allow(dead_code, reason = "each program uses its own part")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use nimbus::error::{Error, Place, Result};
use nimbus::frame::game::Game;
use nimbus::io::scene_file::{LoadedScene, parse_beside};
use nimbus::io::weather::{netcdf, wrf};
use nimbus::io::{box_file, particle_file};
use nimbus::model::weather::particles::Layout;
use nimbus::report::pages::page;
use nimbus::report::pages::source::{Found, Source};
use nimbus::studies::error::files::parse_found;
use nimbus::studies::error::records::Study;
use nimbus::studies::ledger::records::Ledger;
use nimbus::timing::compare::Comparison;
use nimbus::timing::json;
use nimbus::timing::results::parse_results;
use serde_json::Value;

/// A folder that does not exist: what is read here names files, and none may be found.
pub const NOWHERE: &str = "/nowhere/of/nimbus";

/// What is longer is read, but not played: frames and pages are made in a moment or not at all.
const MAX_PLAYED: u64 = 4096;

/// A message that holds more than this echoes its input.
const LONGEST_MESSAGE: usize = 4096;

/// An input of several files, which zero bytes part.
fn parts(bytes: &[u8]) -> Option<Vec<&str>> {
    bytes.split(|b| *b == 0).map(|part| std::str::from_utf8(part).ok()).collect()
}

/// A scene; then the box file that it finds under every name, the particle list that it finds under
/// every name in .csv, and what is given with `--set`, one a part.
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
    assert_eq!(again.hash, loaded.hash, "the resolved scene is another one:\n{resolved}");
    play(&loaded);
    Ok(())
}

/// The first frame and the last, as far as the host has to do with them.
fn play(loaded: &LoadedScene) {
    let scene = &loaded.scene;
    let n_waves: u64 = scene.clouds.iter().map(|c| u64::from(c.gust.n_waves)).sum();
    // The basis of a lobe takes longer than all else together.
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

/// A box file; what it holds is written and read again.
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

/// A particle list; every particle has a line of its own.
pub fn particle_list(bytes: &[u8]) -> std::result::Result<(), String> {
    let Ok(text) = std::str::from_utf8(bytes) else { return Err("no text".to_owned()) };
    let (particles, lines) = particle_file::parse_with_lines(text, Path::new("p.csv"))
        .map_err(|e| clean(&e, &[text]))?;
    assert_eq!(particles.len(), lines.len());
    // CSV takes a carriage return alone for a row's end; no editor counts a line there.
    let is_after = |w: &[usize]| if text.contains('\r') { w[0] <= w[1] } else { w[0] < w[1] };
    assert!(lines.windows(2).all(is_after), "lines in order: {lines:?}");
    assert!(
        lines.last().is_none_or(|last| *last <= text.split('\n').count()),
        "a line of the file"
    );
    Ok(())
}

/// A JSON file of results and, after a zero byte, the table that belongs to it. What is whole is
/// made a page of, beside itself.
pub fn results(bytes: &[u8]) -> std::result::Result<(), String> {
    let Some(parts) = parts(bytes) else { return Err("no text".to_owned()) };
    let (text, table) = (parts[0], parts.get(1).copied().unwrap_or_default());
    let path = |name: &str| Path::new(NOWHERE).join(name);
    // Of every kind, of which a text can be one at most.
    let mut errors = Vec::new();
    let mut refuse = |e: Error| errors.push(clean(&e, &[]));
    let mut found = Vec::new();
    match json::parse(text, &path("run.json")) {
        Ok(run) => match parse_results(run, table, &path("frames.csv")) {
            Ok(recorded) => found.push(Found::Bench(Box::new(recorded))),
            Err(e) => refuse(e),
        },
        Err(e) => refuse(e),
    }
    match json::parse::<Study>(text, &path("study.json")) {
        // A study alone is one that is not gone on with.
        Ok(study) => match parse_found(study.clone(), table, &path("times.csv")) {
            Err(e) if !table.is_empty() => refuse(e),
            _ => found.push(Found::Study(Box::new(study))),
        },
        Err(e) => refuse(e),
    }
    match json::parse::<Ledger>(text, &path("ledger.json")) {
        Ok(ledger) => found.push(Found::Ledger(Box::new(ledger))),
        Err(e) => refuse(e),
    }
    if found.is_empty() {
        return Err(errors.join(" | "));
    }
    found.into_iter().try_for_each(show)
}

/// A weather file and its first steps.
pub fn weather(bytes: &[u8]) -> std::result::Result<(), String> {
    const MOST_STEPS: usize = 4;
    let container = netcdf::from_bytes(bytes.to_vec())?;
    let file =
        wrf::from_container(Box::new(container), Path::new("w.nc")).map_err(|e| clean(&e, &[]))?;
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

/// A page of a result and, once more, of itself; two benches are compared as `nimbus compare` does.
fn show(found: Found) -> std::result::Result<(), String> {
    if let Found::Bench(recorded) = &found {
        drop(Comparison::new(recorded, recorded));
    }
    let source = |name: &str| Source {
        name: name.to_owned(),
        folder: PathBuf::from(NOWHERE),
        found: found.clone(),
    };
    let html = page(&[source("a"), source("b")]).map_err(|e| clean(&e, &[]))?;
    assert!(html.ends_with("</html>"), "a whole page");
    Ok(())
}

/// The message of an error that an input may give: of bad input, short, and at a place that the
/// input has.
fn clean(error: &Error, texts: &[&str]) -> String {
    let message = error.to_string();
    assert_eq!(error.exit_code(), 2, "{message}");
    if let Error::Scene { at, what } = error {
        assert!(
            !what.is_empty() && what.len() < LONGEST_MESSAGE,
            "{} bytes of message: {what:.200}",
            what.len()
        );
        let n_lines = texts.iter().map(|text| text.split('\n').count()).max().unwrap_or(usize::MAX);
        assert!(at.line <= n_lines, "{message}");
    }
    message
}

/// JSON's strings, numbers and lists are TOML's but for DEL, which TOML wants escaped, and `:`,
/// which is `=` there.
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
