//! Properties of every scene and every number, checked on generated inputs, which are the same in
//! every run.

mod drawn;
mod laws;
mod scenes;

use std::path::Path;

use crate::generated::check;
use crate::readers;
use glam::DVec3;
use nimbus::error::{Error, Place};
use nimbus::io::box_file;
use nimbus::io::plain_text::one_line;
use nimbus::io::scene_file::{LoadedScene, parse_beside};
use nimbus::model::boxes::CloudBox;
use proptest::collection::vec;
use proptest::prelude::*;

fn load(text: &str, overrides: &[String]) -> Result<LoadedScene, Error> {
    let files = |path: &Path, first: &str| match path.file_name().and_then(|name| name.to_str()) {
        Some("b.dat") => Ok(scenes::BOXES.to_owned()),
        Some("p.csv") => Ok(scenes::LIST.to_owned()),
        _ => Err(Error::scene(
            Place::line(path, 1, 1),
            format!("the file is empty: expected {first}"),
        )),
    };
    parse_beside(text.to_owned(), Path::new("scene.toml"), overrides, None, &files)
}

/// Checks a scene's text like the fuzz target: it resolves to a scene with the same hash, whose
/// frames are computed.
fn read(text: &str) -> Result<(), String> {
    readers::scene_file([text, scenes::BOXES, scenes::LIST].join("\0").as_bytes())
}

#[test]
fn usual_scenes_load_and_resolve_to_themselves() {
    let n_read = std::cell::Cell::new(0);
    check(300, scenes::usual(), |text| {
        let message = match read(&text) {
            Ok(()) => {
                n_read.set(n_read.get() + 1);
                return Ok(());
            }
            Err(message) => message,
        };
        // Keys whose validity depends on other keys.
        let together =
            ["`lighting.step`", "`lighting.exponents`", "`camera.position`", "`cloud.", "`draw."];
        prop_assert!(together.iter().any(|key| message.contains(key)), "{message}");
        Ok(())
    });
    assert!(n_read.get() > 200, "only {} of 300 load", n_read.get());
}

#[test]
fn unusual_scenes_load_or_give_one_error_with_its_place() {
    let n_refused = std::cell::Cell::new(0);
    check(600, scenes::unusual(), |text| {
        let Err(message) = read(&text) else { return Ok(()) };
        n_refused.set(n_refused.get() + 1);
        let error = load(&text, &[]).expect_err("it was refused before");
        let Error::Scene { at, what } = &error else { return Err(TestCaseError::fail(message)) };
        prop_assert!(!what.is_empty());
        // The error is in a file that the scene names, or in the scene.
        let lines: Vec<&str> = match at.source.ends_with("scene.toml") {
            true => text.split('\n').collect(),
            false => vec![],
        };
        // An error of all phases together has no line.
        if text.contains("[[phase]]") && at.line == 0 {
            return Ok(());
        }
        prop_assert!(at.line >= 1 && at.column >= 1, "{message}");
        let line = lines.get(at.line - 1);
        prop_assert!(
            lines.is_empty() || line.is_some_and(|line| at.column <= line.chars().count() + 1),
            "{message}"
        );
        Ok(())
    });
    assert!(n_refused.get() > 300, "only {} of 600 are refused", n_refused.get());
}

#[test]
fn overrides_equal_keys_of_the_file() {
    check(200, (scenes::setting(), scenes::setting()), |((table, key, value), (_, _, other))| {
        let set = |value: &str| format!("{table}.{key}={value}");
        let scene_with = |value: &str| {
            format!("[{table}]\n{key} = {value}\n[[cloud]]\nfrom = 'boxes'\nfile = 'b.dat'\n")
        };
        let hash = |text: &str, overrides: &[String]| {
            load(text, overrides).map(|loaded| loaded.hash().to_owned()).map_err(|e| match e {
                Error::Scene { what, .. } => what,
                other => other.to_string(),
            })
        };
        let file = hash(&scene_with(&value), &[]);
        let bare = "[[cloud]]\nfrom = 'boxes'\nfile = 'b.dat'\n";
        prop_assert_eq!(&hash(bare, &[set(&value)]), &file);
        // Overrides replace the file's value and earlier overrides.
        prop_assert_eq!(&hash(&scene_with(&other), &[set(&value)]), &file);
        prop_assert_eq!(&hash(&scene_with(&other), &[set("1"), set(&other), set(&value)]), &file);
        Ok(())
    });
}

#[test]
fn odd_overrides_load_or_are_named_in_the_error() {
    let scene = "[[cloud]]\nfrom = 'boxes'\nfile = 'b.dat'\n";
    check(600, vec(scenes::odd_setting(), 1..3), |overrides| {
        let Err(error) = load(scene, &overrides) else { return Ok(()) };
        let Error::Scene { at, .. } = &error else {
            return Err(TestCaseError::fail(error.to_string()));
        };
        // Otherwise the error is in the scene, which may lack a key, or in a file that it names.
        // Harmful characters of an argument are escaped where it is named.
        let is_at = |text: &String| at.source == format!("--set {}", one_line(text));
        let is_named = overrides.iter().any(is_at);
        prop_assert!(is_named || !at.source.starts_with("--set"), "{error}");
        Ok(())
    });
}

/// A number that a box file accepts: 0 or between the smallest and the largest, of either sign.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        Just(-0.0),
        -1e15..=1e15,
        any::<f64>().prop_filter("in bounds", |v| v.abs() <= 1e15)
    ]
}

fn extent() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        1e-30..=1e15,
        (-30.0..=15.0).prop_map(|e| 10f64.powf(e).clamp(1e-30, 1e15))
    ]
}

fn cloud_box() -> impl Strategy<Value = CloudBox> {
    let extents = [extent(), extent(), extent()].prop_map(DVec3::from_array);
    let centers = [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array);
    (any::<u32>(), extents, centers, coordinate()).prop_map(
        |(n_particles, extent, center, radius)| CloudBox {
            n_particles,
            extent,
            center,
            radius_max: radius.abs(),
        },
    )
}

#[test]
fn written_boxes_are_read_back_bit_for_bit() {
    check(500, vec(cloud_box(), 0..20), |boxes| {
        let text = box_file::format(&boxes);
        let again = box_file::parse(&text, Path::new("b.dat"))
            .map_err(|e| TestCaseError::fail(e.to_string()))?;
        let bits = |b: &CloudBox| {
            let numbers = [b.extent.to_array(), b.center.to_array(), [b.radius_max; 3]];
            (b.n_particles, numbers.map(|v| v.map(f64::to_bits)))
        };
        prop_assert!(boxes.iter().map(bits).eq(again.iter().map(bits)), "{}", text);
        // Separators do not matter.
        let parted = text.replace(", ", " \t").replace('\n', "\r\n\r\n");
        prop_assert_eq!(
            box_file::parse(&parted, Path::new("b.dat")).map_err(|e| e.to_string()),
            Ok(again)
        );
        Ok(())
    });
}

#[test]
fn arbitrary_texts_are_read_or_refused() {
    // Words of number files, in any order.
    let words = prop::sample::select(
        &[
            "0", "1", "-1", "3", ",", "\n", "\r", " ", "\"", "nan", "1e400", "x", "y", "z",
            "sigma", "kappa", "é", "1e-320",
        ][..],
    );
    check(2000, vec(words, 0..60), |words| {
        let text = words.concat();
        // The readers contain the assertions.
        let _ = readers::boxes(text.as_bytes());
        let _ = readers::particle_list(text.as_bytes());
        let _ = readers::particle_list(format!("x,y,z,sigma,kappa\n{text}").as_bytes());
        let _ = readers::boxes(format!("3\n1\n3, 1, 1, 1, {text}").as_bytes());
        Ok(())
    });
}

/// Bytes of a file changed at random places, cut, or doubled: 2000 of PLY files of every format,
/// and 2000 of lists in CSV.
#[test]
fn changed_files_of_particles_are_read_or_refused() {
    let folder =
        |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/found").join(name);
    let whole = |name: &str| -> Vec<Vec<u8>> {
        let mut paths: Vec<_> = std::fs::read_dir(folder(name))
            .expect("the inputs")
            .map(|entry| entry.expect("an input").path())
            .filter(|path| {
                path.file_name().is_some_and(|n| n.to_string_lossy().starts_with("whole"))
            })
            .collect();
        paths.sort();
        paths.iter().map(|path| std::fs::read(path).expect("bytes")).collect()
    };
    type Reader = fn(&[u8]) -> Result<(), String>;
    let readers: [(&str, Reader); 2] =
        [("ply", readers::ply), ("particle_list", readers::particle_list)];
    for (name, read) in readers {
        let files = whole(name);
        assert!(files.len() >= 3, "{name}");
        let change = (any::<prop::sample::Index>(), any::<u8>(), 0..4_u8);
        let n = files.len();
        check(2000, (0..n, vec(change, 1..8)), |(i, changes)| {
            let mut bytes = files[i].clone();
            for (at, byte, how) in changes {
                let at = at.index(bytes.len() + 1);
                match how {
                    0 => bytes.truncate(at),
                    1 => bytes.insert(at, byte),
                    2 => bytes.extend_from_within(..at),
                    _ => bytes.iter_mut().skip(at).take(1).for_each(|b| *b = byte),
                }
            }
            // The readers contain the assertions.
            let _ = read(&bytes);
            Ok(())
        });
    }
}
