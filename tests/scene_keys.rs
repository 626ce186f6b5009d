//! The reference of scene keys (docs/reference/scene.md) is written from their declarations.
//! `NIMBUS_BLESS=1 cargo test --test scene_keys` rewrites it.

use std::fmt::Write;
use std::path::Path;

use nimbus::io::scene_keys::{DEFAULT_LIGHTS, Key, tables};
use serde_json::Value;

const INTRODUCTION: &str = "\
# Scene keys

A scene file is TOML. An unknown key is refused, and every message names file, line and column.
Paths of files are relative to the scene's folder. On the command line, `--set key.path=VALUE`
sets any key: `--set film.width=640`, `--set cloud.0.seed=7`, `--set 'cloud.*.texture=none'`.

*unit* is the scene's unit of length. Colours, radiance and irradiance are linear RGB. A scene
without `[[material]]` has the material \"cloud\", and one without `[[light]]` has these lights:
";
const GENERATED: &str = "\
This page is generated from the declarations in `src/io/scene_keys` by `tests/scene_keys.rs`.
";
const WIDTH: usize = 100;

fn item(key: &Key) -> String {
    let about = (key.about)();
    let mut text = format!("- `{}`: {}", key.name, about.expected);
    if !key.unit.is_empty() {
        write!(text, ", in {}", key.unit).unwrap();
    }
    match about.default {
        None => text += "; required",
        Some(Value::Null) => {}
        Some(default) => write!(text, "; default `{default}`").unwrap(),
    }
    text + ". " + key.docs.trim()
}

/// Breaks a text between words into lines of at most [`WIDTH`] columns, indented from the second
/// on.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().unwrap();
        if line.is_empty() {
            line.push_str(word);
        } else if line.chars().count() + 1 + word.chars().count() <= WIDTH {
            line.push(' ');
            line.push_str(word);
        } else {
            lines.push(format!("  {word}"));
        }
    }
    lines.join("\n")
}

fn reference() -> String {
    let lights = DEFAULT_LIGHTS.trim();
    let mut text = format!("{INTRODUCTION}\n```toml\n{lights}\n```\n\n{GENERATED}");
    for table in tables() {
        let name = if table.name.is_empty() { "Before every table" } else { &table.name };
        let name = if table.name.is_empty() { name.to_owned() } else { format!("`{name}`") };
        write!(text, "\n## {name}\n\n").unwrap();
        for key in table.keys {
            text += &wrapped(&item(key));
            text.push('\n');
        }
    }
    text
}

#[test]
fn the_reference_lists_every_key_as_it_is_declared() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/scene.md");
    if std::env::var_os("NIMBUS_BLESS").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, reference()).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == reference(), "{} is stale: run with NIMBUS_BLESS=1", path.display());
}

#[test]
fn every_key_has_docs_and_no_table_has_a_key_twice() {
    for table in tables() {
        for (i, key) in table.keys.iter().enumerate() {
            assert!(key.docs.trim().ends_with('.'), "{} {}", table.name, key.name);
            let is_again = table.keys[..i].iter().any(|before| before.name == key.name);
            assert!(!is_again, "{} {}", table.name, key.name);
        }
    }
}
