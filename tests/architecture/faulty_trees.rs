//! Tests of the checker on small trees of files.

use std::fs;

use super::check;

/// Checks a tree of files in a temporary folder.
fn complaints_of(files: &[(&str, &str)]) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let cargo_toml =
        [("Cargo.toml", "[dependencies]\nash = \"1\"\nglam = \"1\"\nserde_json = \"1\"\n")];
    for (path, text) in cargo_toml.iter().chain(files) {
        let path = folder.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    check(folder.path())
}

#[test]
fn correct_tree_has_no_complaints() {
    let complaints = complaints_of(&[
        ("src/lib.rs", "pub mod model; pub mod gpu;"),
        ("src/main.rs", "use nimbus::{cli, error::Error}; fn main() {}"),
        (
            "src/model/box.rs",
            "use super::life; use glam::DVec3; // use crate::gpu;\nconst A: &str = \"crate::gpu\";",
        ),
        ("src/model/life.rs", "fn f<'a>(x: &'a str) -> char { let _ = r#\"crate::\"gpu\"#; '\"' }"),
        (
            "src/gpu/device.rs",
            "use ash::vk; use crate::error::Result; /* crate::model /* nested */ crate::io */",
        ),
        (
            "src/passes/sort.rs",
            "use crate::{gpu::{self, kernel::Kernel}, layout::key};\n#[cfg(test)]\nmod tests { use \
             super::*; use crate::reference::sort; fn f() { g().unwrap(); } }",
        ),
        ("src/passes/sprites.rs", "pub use ash::vk;"),
        ("src/reference/sort.rs", "use crate::model::{boxes, camera as eye};"),
        ("src/reference/sprites/mod.rs", ""),
        ("src/cli/bench.rs", "fn f() { let e = crate::timing::records::cpu(); e.unwrap_or(1); }"),
        ("tests/passes/sort.rs", ""),
        ("tests/passes/sprites.rs", ""),
        ("shaders/sort_scatter.comp", ""),
        ("shaders/sprites.vert", ""),
    ]);
    assert_eq!(complaints, [""; 0]);
}

/// A faulty file each, in a tree without other faults, and a part of the only complaint.
const BREACHES: [(&str, &str, &str); 23] = [
    ("src/model/a.rs", "use crate::io;", "a.rs:1: model may not import io"),
    (
        "src/io/a.rs",
        "use crate::{\n    model,\n    gpu::device,\n};",
        "a.rs:3: io may not import gpu",
    ),
    ("src/io/a.rs", "use crate::{error::{Error, Result}, measure};", "io may not import measure"),
    ("src/gpu/a.rs", "fn f() -> crate::model::Scene {}", "gpu may not import model"),
    ("src/gpu/a/b.rs", "use super::super::super::model::film;", "gpu may not import model"),
    (
        "src/gpu/a.rs",
        "#[cfg(test)]\nmod tests { use super::super::super::model; }",
        "a.rs:2: gpu may not import model",
    ),
    ("src/measure/a.rs", "use crate :: frame;", "measure may not import frame"),
    ("src/frame/a.rs", "use crate::reference::sort;", "frame may not import reference"),
    ("src/passes/sort.rs", "use crate::reference::sort;", "passes may not import reference"),
    ("src/passes/sort.rs", "use crate::passes::grid::Grid;", "no pass imports a pass"),
    ("src/passes/sort.rs", "use super::{grid::Grid};", "no pass imports a pass"),
    ("src/error.rs", "use crate::model;", "error may not import model"),
    ("src/model/a.rs", "use crate::*;", "model may not import *"),
    ("src/main.rs", "use nimbus::gpu;", "main may not import gpu"),
    ("src/odds/a.rs", "", "\"odds\" is no room"),
    ("src/model/a.rs", "fn f() { serde_json::json!(1); }", "not on serde_json"),
    ("src/frame/a.rs", "use ash::vk;", "only gpu speaks ash"),
    ("src/model/a.rs", "fn f() { g().\n  unwrap(); }", "a.rs:1: .unwrap() outside tests"),
    ("src/model/a.rs", "mod string_utils {}", "string_utils says nothing"),
    ("src/model/box_helper.rs", "", "\"helper\" in a name"),
    ("shaders/include/common.glsl", "", "\"common\" in a name"),
    ("src/reference/long.rs", LONG, "lines, more than 400"),
    ("src/reference/wide.rs", WIDE, "wide.rs:2: more than 100 characters"),
];

/// A text with a line of 101 characters, most of them of two bytes, after a line of 100.
const WIDE: &str = concat!(
    "//äääääääääääääääääääääääääääääääääääääääääääääääää",
    "äääääääääääääääääääääääääääääääääääääääääääääääää\n",
    "//äääääääääääääääääääääääääääääääääääääääääääääääää",
    "ääääääääääääääääääääääääääääääääääääääääääääääääää\n",
);

/// A text of 401 lines.
const LONG: &str = {
    const LINES: [u8; 401] = [b'\n'; 401];
    match std::str::from_utf8(&LINES) {
        Ok(text) => text,
        Err(_) => "",
    }
};

#[test]
fn every_violation_is_reported() {
    for (path, text, complaint) in BREACHES {
        let mut files = vec![(path, text)];
        if path == "src/passes/sort.rs" {
            files.extend([
                ("src/reference/sort.rs", ""),
                ("tests/passes/sort.rs", ""),
                ("shaders/sort.comp", ""),
            ]);
        }
        let complaints = complaints_of(&files);
        assert!(
            complaints.len() == 1 && complaints[0].contains(complaint),
            "{path}: {text}\n{complaints:?}"
        );
    }
}

#[test]
fn circle_of_imports_is_reported() {
    for (files, circle) in [
        (
            &[
                ("src/gpu/a.rs", "use super::b::B;"),
                ("src/gpu/b.rs", "use crate::gpu::c;"),
                ("src/gpu/c/mod.rs", "mod d;\nfn f() { d::g() }"),
                ("src/gpu/c/d.rs", "use super::super::a;"),
            ][..],
            Some("gpu/a.rs, gpu/b.rs, gpu/c/d.rs, gpu/c/mod.rs"),
        ),
        (
            &[
                ("src/gpu/c/mod.rs", "mod d;\npub use d::D;\npub struct C;"),
                ("src/gpu/c/d.rs", "use super::C;\n#[cfg(test)]\nmod tests { use super::*; }"),
            ],
            None,
        ),
    ] {
        let complaints = complaints_of(files);
        let expected = circle.map(|circle| format!("src/: a circle of imports: {circle}"));
        assert_eq!(complaints, expected.into_iter().collect::<Vec<_>>());
    }
}

#[test]
fn incomplete_pass_is_reported() {
    let complaints = complaints_of(&[("src/passes/mod.rs", ""), ("src/passes/grid.rs", "")]);
    assert_eq!(complaints.len(), 3, "{complaints:?}");
    for (complaint, what) in
        complaints.iter().zip(["src/reference/grid.rs", "tests/passes/grid.rs", "shaders/grid"])
    {
        assert!(complaint.contains(what), "{complaint}");
    }
}
