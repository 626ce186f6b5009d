//! The rules of ARCHITECTURE.md that a machine can check: imports between rooms, one name per pass,
//! meaningful names, file lengths, no `.unwrap()`. The checker is tested on faulty trees first.

#[path = "architecture/faulty_trees.rs"]
mod faulty_trees;
#[path = "architecture/files.rs"]
mod files;
#[path = "architecture/source.rs"]
mod source;

use std::fs;
use std::path::{Path, PathBuf};

use files::Graph;
use source::{Source, Token};

/// The rooms that every room may import, besides itself and `error`.
const MAY_IMPORT: [(&str, &str); 19] = [
    ("error", ""),
    ("model", ""),
    ("io", "model"),
    ("layout", "model"),
    ("reference", "model"),
    ("gpu", "io"),
    ("passes", "layout gpu"),
    ("frame", "passes layout gpu model"),
    ("measure", ""),
    ("inspect", "model io layout reference gpu passes frame"),
    ("timing", "model io gpu frame measure"),
    ("studies", "model io layout reference gpu frame measure timing"),
    ("stress", "model io layout reference gpu passes frame"),
    ("report", "io measure timing studies"),
    ("roof", "layout gpu frame measure timing"),
    ("viewer", "model io layout reference gpu passes frame measure timing studies"),
    ("farm", "model io layout reference gpu passes frame measure timing studies report"),
    (
        "cli",
        "model io layout reference gpu passes frame measure inspect timing studies stress report \
         roof viewer farm",
    ),
    ("main", "cli"),
];

/// Words that say nothing about the content of a file or module.
const EMPTY_WORDS: [&str; 9] =
    ["manager", "managers", "util", "utils", "helper", "helpers", "common", "commons", "misc"];
/// The module of arguments that several passes share.
const SHARED_BY_PASSES: &str = "blobs";
/// Most lines of a file.
const MAX_LINES: usize = 400;
/// Most characters of a line. rustfmt keeps code within them, but neither comments nor text.
const MAX_WIDTH: usize = 100;
/// The only crates that `model` may use.
const MODEL_CRATES: [&str; 4] = ["glam", "hw_skymodel", "libm", "nalgebra"];
const SHADER_KINDS: [&str; 3] = ["comp", "vert", "frag"];

#[test]
fn sources_follow_the_architecture() {
    let complaints = check(Path::new(env!("CARGO_MANIFEST_DIR")));
    assert!(complaints.is_empty(), "{} breaches:\n{}", complaints.len(), complaints.join("\n"));
}

/// Rust files under src/.
fn sources(root: &Path) -> Vec<Source> {
    let paths = files_under(&root.join("src"));
    let is_rust = |path: &&PathBuf| path.extension().is_some_and(|extension| extension == "rs");
    let read = |path: &PathBuf| {
        let relative = path.strip_prefix(root.join("src")).unwrap();
        Source::read(relative, &fs::read_to_string(path).unwrap())
    };
    paths.iter().filter(is_rust).map(read).collect()
}

/// Files of the folder of a test program that neither its `main.rs` nor its `mod.rs` declares.
/// Cargo would not compile them.
fn undeclared(folder: &Path) -> Vec<PathBuf> {
    let text = |name: &str| fs::read_to_string(folder.join(name)).unwrap_or_default();
    let declared = text("main.rs") + &text("mod.rs");
    let is_forgotten = |path: &PathBuf| {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        path.extension().is_some_and(|extension| extension == "rs")
            && !["main", "mod"].contains(&name.as_ref())
            && !declared.contains(&format!("mod {name};"))
    };
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(is_forgotten).collect()
}

#[test]
fn every_test_is_compiled() {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let folders = fs::read_dir(tests).unwrap().map(|entry| entry.unwrap().path());
    let programs: Vec<PathBuf> =
        folders.filter(|folder| folder.join("main.rs").is_file()).collect();
    let forgotten: Vec<PathBuf> = programs.iter().flat_map(|folder| undeclared(folder)).collect();
    assert!(programs.len() >= 10 && forgotten.is_empty(), "{forgotten:?}");

    let dir = tempfile::tempdir().expect("a folder");
    for (name, text) in [("main.rs", "mod a;"), ("a.rs", ""), ("b.rs", ""), ("c.txt", "")] {
        fs::write(dir.path().join(name), text).expect("a file");
    }
    assert_eq!(undeclared(dir.path()), [dir.path().join("b.rs")]);
}

#[test]
fn the_diagram_shows_the_imports_between_rooms() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
    let rooms = Graph::new(&sources(root)).rooms();
    let complaints = files::compare(&files::diagram(&text), &rooms);
    assert!(rooms.len() > 20 && complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn circles_and_wrong_diagrams_are_reported() {
    let tree = |files: &[(&str, &str)]| {
        let read = |(path, text): &(&str, &str)| Source::read(Path::new(path), text);
        Graph::new(&files.iter().map(read).collect::<Vec<_>>())
    };
    let circles = |files: &[(&str, &str)]| {
        tree(files).circles().iter().map(|c| c.join(" ")).collect::<Vec<_>>()
    };
    let a = ("gpu/a.rs", "use super::b::B;");
    assert_eq!(circles(&[a, ("gpu/b.rs", "")]), [""; 0]);
    assert_eq!(circles(&[a, ("gpu/b.rs", "use crate::gpu::a;")]), ["gpu/a.rs gpu/b.rs"]);
    assert_eq!(
        circles(&[a, ("gpu/b.rs", "#[cfg(test)] mod tests { use crate::gpu::a; }")]),
        [""; 0]
    );
    // Through a third file, and through a name that the folder hands on.
    let c = ("gpu/c.rs", "fn f() { super::a::g() }");
    assert_eq!(circles(&[a, ("gpu/b.rs", "use super::c::C;"), c]), ["gpu/a.rs gpu/b.rs gpu/c.rs"]);
    let door = ("gpu/mod.rs", "mod a; mod b; pub use a::A; pub use b::{B, D as E};");
    assert_eq!(circles(&[a, ("gpu/b.rs", "use super::A;"), door]), ["gpu/a.rs gpu/b.rs"]);
    assert_eq!(circles(&[a, ("gpu/b.rs", ""), door]), [""; 0]);
    // A folder that uses its own child, which uses the folder.
    let both = [("gpu/mod.rs", "mod a; use a::A; pub struct G;"), ("gpu/a.rs", "use super::G;")];
    assert_eq!(circles(&both), ["gpu/mod.rs gpu/a.rs"]);
    let rooms = tree(&[("io/a.rs", "use crate::model::b;"), ("model/b.rs", "")]).rooms();
    let drawn = |text: &str| files::compare(&files::diagram(text), &rooms);
    assert_eq!(drawn("```mermaid\ngraph TD\n    io --> model\n```"), [""; 0]);
    assert!(drawn("```mermaid\n```")[0].contains("no way there"));
    assert_eq!(drawn("```mermaid\n io --> gpu\n gpu --> model\n```").len(), 2);
}

fn check(root: &Path) -> Vec<String> {
    let mut complaints = Vec::new();
    let mut sources = Vec::new();
    let crates = dependencies(&fs::read_to_string(root.join("Cargo.toml")).unwrap());
    for path in files_under(&root.join("src")) {
        check_name_and_length(root, &path, &mut complaints);
        if path.extension().is_some_and(|extension| extension == "rs") {
            let relative = path.strip_prefix(root.join("src")).unwrap();
            let source = Source::read(relative, &fs::read_to_string(&path).unwrap());
            check_imports(&source, &mut complaints);
            check_crates(&source, &crates, &mut complaints);
            check_words_and_unwrap(&source, &mut complaints);
            sources.push(source);
        }
    }
    for circle in Graph::new(&sources).circles() {
        complaints.push(format!("src/: a circle of imports: {}", circle.join(", ")));
    }
    for path in files_under(&root.join("shaders")) {
        check_name_and_length(root, &path, &mut complaints);
    }
    check_rooms(root, &mut complaints);
    complaints
}

fn check_imports(source: &Source, complaints: &mut Vec<String>) {
    let Some(from) = source.room() else { return };
    let may = MAY_IMPORT.iter().find(|(room, _)| *room == from);
    let Some((_, may)) = may else {
        complaints.push(format!("src/{}: \"{from}\" is no room of the house", source.path));
        return;
    };
    for import in source.imports() {
        let at = format!("src/{}:{}", source.path, import.line);
        let to = import.path[0].as_str();
        // Tests may compare a pass with its reference.
        let meets_in_test = import.in_test
            && matches!((from, to), ("passes", "reference") | ("reference", "passes"));
        let allowed =
            to == from || to == "error" || may.split(' ').any(|room| room == to) || meets_in_test;
        if !allowed {
            complaints.push(format!("{at}: {from} may not import {to}"));
        }
        if let (Some(own), "passes") = (source.pass(), to) {
            let other = import.path.get(1).map_or("all passes", String::as_str);
            if other != own && other != SHARED_BY_PASSES {
                complaints.push(format!(
                    "{at}: the pass {own} imports {other}, and no pass imports a pass"
                ));
            }
        }
    }
}

fn check_crates(source: &Source, crates: &[String], complaints: &mut Vec<String>) {
    let Some(room) = source.room() else { return };
    for Token { text, line, .. } in source.crate_mentions(crates) {
        let at = format!("src/{}:{line}", source.path);
        // Work spread over threads has a file of its own.
        let spreads = text == "rayon" && source.path == "model/parallel.rs";
        if room == "model" && !MODEL_CRATES.contains(&text.as_str()) && !spreads {
            let on = MODEL_CRATES.join(", ");
            complaints.push(format!("{at}: model rests on std, {on}, not on {text}"));
        }
        if text == "ash" && room != "gpu" && source.pass() != Some("sprites") {
            complaints.push(format!("{at}: only gpu speaks ash"));
        }
    }
}

fn check_words_and_unwrap(source: &Source, complaints: &mut Vec<String>) {
    for (i, token) in source.tokens.iter().enumerate() {
        let next = |n: usize| source.tokens.get(i + n).map_or("", |token| token.text.as_str());
        let at = || format!("src/{}:{}", source.path, token.line);
        if token.text == "mod" && !empty_words(next(1)).is_empty() {
            complaints.push(format!("{}: a module named {} says nothing", at(), next(1)));
        }
        if token.text == "." && next(1) == "unwrap" && next(2) == "(" && !token.in_test {
            complaints.push(format!("{}: .unwrap() outside tests", at()));
        }
    }
}

fn check_name_and_length(root: &Path, path: &Path, complaints: &mut Vec<String>) {
    let shown = path.strip_prefix(root).unwrap().display();
    for part in path.strip_prefix(root).unwrap().components() {
        for word in empty_words(&part.as_os_str().to_string_lossy()) {
            complaints.push(format!("{shown}: \"{word}\" in a name says nothing"));
        }
    }
    let bytes = fs::read(path).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    let n_lines = text.lines().count();
    if n_lines > MAX_LINES {
        complaints.push(format!("{shown}: {n_lines} lines, more than {MAX_LINES}"));
    }
    if let Some(i) = text.lines().position(|line| line.chars().count() > MAX_WIDTH) {
        complaints.push(format!("{shown}:{}: more than {MAX_WIDTH} characters", i + 1));
    }
}

fn empty_words(name: &str) -> Vec<&str> {
    let words = name.split(|c: char| !c.is_alphanumeric());
    words.filter(|word| EMPTY_WORDS.contains(&word.to_lowercase().as_str())).collect()
}

/// Checks that every pass has a reference, a test and a shader of its name.
fn check_rooms(root: &Path, complaints: &mut Vec<String>) {
    let shaders: Vec<String> =
        files_under(&root.join("shaders")).iter().map(|path| file_name(path)).collect();
    let references = files_under(&root.join("src/reference"));
    for entry in fs::read_dir(root.join("src/passes")).into_iter().flatten() {
        let path = entry.unwrap().path();
        let room = path.file_stem().unwrap().to_string_lossy().into_owned();
        if room == "mod" || room == SHARED_BY_PASSES {
            continue;
        }
        let mut need = |there: bool, what: String| {
            if !there {
                complaints.push(format!("the pass {room} has no {what}"));
            }
        };
        let is_reference = |path: &PathBuf| {
            let folder = path.parent().and_then(Path::file_name);
            [path.file_stem(), folder].contains(&Some(room.as_ref()))
        };
        need(references.iter().any(is_reference), format!("src/reference/{room}.rs"));
        let test = format!("tests/passes/{room}.rs");
        need(root.join(&test).is_file(), test);
        let is_shader = |name: &String| {
            name.split_once('.')
                .is_some_and(|(stem, kind)| stem.starts_with(&room) && SHADER_KINDS.contains(&kind))
        };
        need(shaders.iter().any(is_shader), format!("shaders/{room}*.{{comp,vert,frag}}"));
    }
}

/// Returns the keys of `[dependencies]` as Rust identifiers.
fn dependencies(cargo_toml: &str) -> Vec<String> {
    let section = cargo_toml.lines().skip_while(|line| line.trim() != "[dependencies]").skip(1);
    let section = section.take_while(|line| !line.starts_with('['));
    section.filter_map(|line| Some(line.split_once('=')?.0.trim().replace('-', "_"))).collect()
}

fn files_under(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() { files.extend(files_under(&path)) } else { files.push(path) }
    }
    files.sort();
    files
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}
