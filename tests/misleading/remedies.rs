//! Messages that name the cause and the way out: keys at a wrong place, files of another kind,
//! names that are nearly right, and folders that are not there.

use std::fs;
use std::path::Path;

use nimbus::io::scene_file;
use tempfile::TempDir;

use crate::program::{path, run};
use crate::signals::interrupt;

const SUN: &str =
    "[[light]]\nkind = 'directional'\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\n";
const BOXES: &str = "3\n1\n3, 1, 1, 1, 0, 0, 0, 1\n";

fn folder(files: &[(&str, &str)]) -> TempDir {
    let dir = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        fs::write(dir.path().join(name), text).expect("a file");
    }
    dir
}

/// Returns the message about the scene `name` of a folder, without the folder's path.
fn message(dir: &TempDir, name: &str, set: &[&str]) -> String {
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
    let error = scene_file::load(&dir.path().join(name), &set, None).expect_err(name);
    error.to_string().replace(&format!("{}/", dir.path().display()), "")
}

#[test]
fn a_suggested_path_is_one_that_the_scene_has() {
    let dir = folder(&[("s.toml", SUN), ("none.toml", "title = 'none'"), ("b.dat", BOXES)]);
    for (set, says) in [
        ("light.grid=32", "found `grid`; `grid` is a key of [lighting] (`lighting.grid`)"),
        ("light.direction=[0,-1,0]", "write `light.0.direction`"),
        ("light.sun.direction=[0,-1,0]", "write `light.0.direction`"),
        ("light.sun.direction.x=1", "write `light.0.direction.0`"),
        ("light.sun.position=[0,1,0]", "`position` is a key of [[light]] kind = \"point\" and of"),
        ("light.nonsense=3", "found `nonsense`"),
    ] {
        let found = message(&dir, "s.toml", &[set]);
        assert!(found.contains(says), "{set}: {found}");
        let Some(written) = found.split("write `").nth(1).and_then(|rest| rest.split('`').next())
        else {
            continue;
        };
        let value = set.split_once('=').expect("a value").1;
        let again = vec![format!("{written}={value}")];
        let again = scene_file::load(&dir.path().join("s.toml"), &again, None);
        assert!(again.is_ok(), "{set}: {written}: {again:?}");
    }
    // The second of the default lights is the sky.
    let found = message(&dir, "none.toml", &["light.constant=2"]);
    assert!(found.ends_with("write `light.1.constant`"), "{found}");
    assert_eq!(
        message(&dir, "none.toml", &["light.2.kind=sky"]),
        "--set light.2.kind=sky: `light.2` does not exist: `light` has 2 items, numbered from 0, \
         which are the defaults of a scene without [[light]]"
    );
}

#[test]
fn a_key_of_another_kind_is_named_with_what_has_set_the_kind() {
    let dir = folder(&[
        ("s.toml", SUN),
        ("point.toml", "[[light]]\nkind = 'point'\nposition = [0, 2, 0]\nirradiance = [1, 1, 1]\n"),
        ("b.dat", BOXES),
        ("boxes.toml", "[[cloud]]\nfrom = 'particles'\nfile = 'b.dat'\nform = 'centred'\n"),
    ]);
    assert_eq!(
        message(&dir, "s.toml", &["light.0.kind=point"]),
        "s.toml:3:1: unknown key `light.0.direction`: a light with kind = \"point\" (set by --set \
         light.0.kind=point) has no such key; `direction` is a key of [[light]] kind = \
         \"directional\" and of [[light]] kind = \"spot\"; known here: `kind`, `position`, \
         `intensity`, `radius`; set all keys together: --set 'light.0={kind=\"point\", …}'"
    );
    let whole = "light.0={kind=\"point\", position=[0, 2, 0], intensity=[1, 1, 1]}";
    let loaded = scene_file::load(&dir.path().join("s.toml"), &[whole.to_owned()], None);
    assert!(loaded.is_ok(), "the remedy works: {loaded:?}");
    assert_eq!(
        message(&dir, "point.toml", &[]),
        "point.toml:4:1: unknown key `light.0.irradiance`: a light with kind = \"point\" has no \
         such key; `intensity` sets the strength of a point or a spot; known here: `kind`, \
         `position`, `intensity`, `radius`"
    );
    let found = message(&dir, "boxes.toml", &[]);
    let says =
        "unknown key `cloud.0.form`: a cloud with from = \"particles\" has no such key; `form`";
    assert!(found.contains(says), "{found}");
}

#[test]
fn a_file_of_another_kind_is_recognised() {
    let dir = folder(&[
        ("b.dat", BOXES),
        ("boxes.txt", BOXES),
        ("p.csv", "x,y,z,sigma,kappa\n0,0,0,1,1\n"),
        ("p.png", "\u{89}PNG\0"),
        ("wrong.toml", "title = = 3"),
        ("as-list.toml", "[[cloud]]\nfrom = 'particles'\nfile = 'b.dat'\n"),
    ]);
    for (name, says) in [
        ("b.dat", "this looks like a box file, which a [[cloud]] with from = \"boxes\" names"),
        ("boxes.txt", "this looks like a box file, which a [[cloud]] with from = \"boxes\" names"),
        ("p.csv", "this looks like a particle list, which a [[cloud]] with from = \"particles\""),
        ("p.png", "not a text file: it holds a zero byte; a scene is TOML, and this looks like a"),
        ("as-list.toml", "found numbers; a box file needs from = \"boxes\""),
    ] {
        let found = message(&dir, name, &[]);
        assert!(found.contains(says), "{name}: {found}");
    }
    assert!(!message(&dir, "wrong.toml", &[]).contains("looks like"));
    assert_eq!(message(&dir, "none.dat", &[]), "none.dat: no such file");
}

#[test]
fn an_empty_cloud_is_named_with_its_file() {
    let dir = folder(&[
        ("p.csv", "x,y,z,sigma,kappa\n"),
        ("b.dat", "0\n1\n0, 1, 1, 1, 0, 0, 0, 1\n"),
        (
            "s.toml",
            "[[cloud]]\nfrom = 'particles'\nfile = 'p.csv'\n[[cloud]]\nfrom = 'boxes'\nfile = \
             'b.dat'\n",
        ),
    ]);
    let loaded = scene_file::load(&dir.path().join("s.toml"), &[], None).expect("a scene");
    let warnings = loaded.warnings.join("\n").replace(&format!("{}/", dir.path().display()), "");
    assert_eq!(
        warnings,
        "cloud 0: p.csv: it has a header and no particles, so the cloud is empty\n\
         cloud 1: b.dat: its boxes have no particles, so the cloud is empty"
    );
}

#[test]
fn names_that_are_nearly_right_are_found() {
    let lost = "[[cloud]]\nfrom = 'boxes'\nfile = 'boxs.dat'\n";
    let dir = folder(&[("hello.toml", lost), ("boxes.dat", BOXES), ("sun.csv", "")]);
    assert_eq!(
        message(&dir, "helo.toml", &[]),
        "helo.toml: no such file; did you mean `hello.toml`?"
    );
    assert!(message(&dir, "hello.toml", &[]).ends_with("no such file; did you mean `boxes.dat`?"));
    let found = message(&dir, "hello.toml", &["cloud.0.file=sub/far.dat"]);
    assert!(
        found.ends_with("sub/far.dat: no such file; names are relative to the scene's folder"),
        "{found}"
    );
    let output = run(&["stress", "functions/divisoin"]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("did you mean `functions/division`?"), "{stderr}");
}

/// No folder above the one that a command writes is made: a mistyped path is refused.
#[test]
fn a_folder_that_is_not_there_is_refused_with_what_to_do() {
    let dir = folder(&[("b.dat", BOXES)]);
    let at = path(&dir, "nowhere/deep");
    let hello = "scenes/hello.toml";
    for args in [
        &["render", hello, "-o", &format!("{at}/p.png")][..],
        &["bench", hello, "--out", &format!("{at}/run")],
        &["bench", hello, "scenes/static.toml", "--out", &format!("{at}/runs")],
        &["error", hello, "--out", &format!("{at}/study")],
        &["ledger", hello, "--out", &format!("{at}/ledger")],
    ] {
        let output = run(args);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {stderr}");
        let says =
            format!("the folder {at} does not exist; make it first, or choose another place");
        assert!(stderr.contains(&says), "{args:?}: {stderr}");
        assert!(!Path::new(&path(&dir, "nowhere")).exists(), "{args:?}");
    }
}

#[test]
fn a_bench_that_is_interrupted_before_its_first_frame_says_that_nothing_was_written() {
    let dir = folder(&[]);
    let out = path(&dir, "run");
    let says = |stderr: &str| {
        stderr.contains("before the first frame: nothing was written")
            || stderr.contains("no frame was finished, nothing is kept")
    };
    // The signal may come before the arguments are checked.
    let said = (1..10).any(|i| {
        let mut command = crate::program::nimbus(&["bench", "scenes/hello.toml", "--out", &out]);
        let (output, _) = interrupt(&mut command, |used_s| used_s >= 0.01 * f64::from(i));
        let stderr = String::from_utf8_lossy(&output.stderr);
        println!("{:?}: {stderr}", output.status.code());
        output.status.code() == Some(130) && says(&stderr) && !Path::new(&out).exists()
    });
    assert!(said, "no run says that nothing was written");
}
