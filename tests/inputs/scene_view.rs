//! A view saved as a scene: loaded again it is the scene that was seen, wherever it was saved to,
//! and reads as it was written.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec2;
use nimbus::io::scene_file::{LoadedScene, load, load_and_list, parse};
use nimbus::io::scene_view::{save, text_of};
use nimbus::model::cloud::CloudSource;
use nimbus::model::scene::Scene;
use nimbus::viewer::scene_window::ViewState;

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    assert!(paths.len() > 15);
    paths
}

/// A scene as a user has changed it in the window.
fn overrides_of_view(loaded: &LoadedScene) -> Vec<String> {
    let scene = Arc::new(loaded.scene.clone());
    let mut state = ViewState::new(scene.clone(), true).unwrap();
    ["t", "b", "o", "p", "r"].iter().for_each(|key| drop(state.press(key)));
    state.drag(DVec2::new(31.0, -17.0), true);
    state.approach(1.5);
    state.size = [611, 407];
    state.overrides(&scene)
}

/// With particles that are moved where they are at one time: two files that are open are never the
/// same.
fn at_rest(scene: &Scene, time_s: f64) -> Scene {
    let mut scene = scene.clone();
    for cloud in &mut scene.clouds {
        if let CloudSource::Animated(moving) = &cloud.source {
            cloud.source =
                CloudSource::Particles(moving.animation.at(time_s).unwrap().to_vec().into());
        }
    }
    scene
}

/// Scenes alike, phases' too; and all that was resolved, but for where the files are and for what
/// phases say, which has to give way.
fn assert_same(a: &LoadedScene, b: &LoadedScene, what: &str) {
    for time_s in [0.0, 7.3] {
        assert!(at_rest(&a.scene, time_s) == at_rest(&b.scene, time_s), "{what}");
    }
    assert_eq!(a.phases.len(), b.phases.len());
    for (a, b) in a.phases.iter().zip(&b.phases) {
        let same = at_rest(&a.scene, 0.0) == at_rest(&b.scene, 0.0);
        let as_run = (&a.name, a.n_frames, a.sets_mode) == (&b.name, b.n_frames, b.sets_mode);
        assert!(same && as_run, "{what}, phase {}", a.name);
    }
    let keys = |loaded: &LoadedScene| {
        let mut resolved = loaded.resolved.clone();
        resolved.as_object_mut().unwrap().remove("phase");
        for cloud in resolved["cloud"].as_array_mut().unwrap() {
            cloud.as_object_mut().unwrap().remove("file");
        }
        resolved
    };
    assert_eq!(keys(a), keys(b), "{what}");
}

#[test]
fn every_scene_reads_back_as_it_was_seen_from_any_folder() {
    let elsewhere = tempfile::tempdir().unwrap();
    for path in scenes() {
        let set = overrides_of_view(&load(&path, &[], None).unwrap());
        let expected = load(&path, &set, Some(7)).unwrap();
        let beside = path.with_file_name("view-1.toml");
        let text = text_of(&path, &beside, &set, Some(7)).unwrap();
        assert_same(
            &parse(text, &beside, &[], None).unwrap(),
            &expected,
            &path.display().to_string(),
        );
        let name = path.file_name().unwrap();
        let to = elsewhere.path().join(name);
        save(&path, &to, &set, Some(7)).unwrap();
        assert_same(&load(&to, &[], None).unwrap(), &expected, &to.display().to_string());
        // Named from where it is, and not by a whole path.
        assert!(!fs::read_to_string(&to).unwrap().contains("file = \"/"));
        // The files are the same ones.
        let files = |path: &Path| -> Vec<PathBuf> {
            let named = load_and_list(path, &[], None).1;
            named[1..].iter().map(|file| file.canonicalize().unwrap()).collect()
        };
        assert_eq!(files(&elsewhere.path().join(name)), files(&path));
    }
}

#[test]
fn what_was_not_set_stays_as_it_was_written() {
    for path in scenes() {
        let text = fs::read_to_string(&path).unwrap();
        let to = path.with_file_name("view-1.toml");
        assert_eq!(text_of(&path, &to, &[], None).unwrap(), text, "{}", path.display());
        // All lines but those that were set, in order.
        let set = overrides_of_view(&load(&path, &[], None).unwrap());
        let saved = text_of(&path, &to, &set, None).unwrap();
        let mut lines = saved.lines();
        let lost: Vec<&str> = text
            .lines()
            .filter(|line| !lines.clone().any(|l| l == *line) || !lines.any(|l| l == *line))
            .collect();
        let keys = [
            "width",
            "height",
            "position",
            "target",
            "path",
            "mode",
            "bases",
            "theta",
            "resolution",
            "{",
            "]",
        ];
        let is_set = |line: &&str| {
            keys.iter().any(|key| line.trim_start().starts_with(key)) || line.contains("set.film")
        };
        assert!(lost.iter().all(is_set), "{}: {lost:#?}", path.display());
        // Not a word of a comment is lost, but within a value that is another now.
        let comments = |text: &str| {
            text.lines()
                .filter_map(|l| l.split_once('#').map(|(_, c)| c.to_owned()))
                .collect::<Vec<_>>()
        };
        if !text.contains("path = [") {
            assert_eq!(comments(&saved), comments(&text), "{}", path.display());
        }
    }
}

/// A scene of two clouds in a folder "a", and a folder "b" beside it.
fn two_folders(text: &str) -> (tempfile::TempDir, PathBuf, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
    fs::create_dir(&a).unwrap();
    fs::create_dir(&b).unwrap();
    fs::write(a.join("one.csv"), "x,y,z,sigma,kappa\n0,0,0,1,1\n").unwrap();
    fs::write(dir.path().join("two.csv"), "x,y,z,sigma,kappa\n1,0,0,1,1\n").unwrap();
    fs::write(a.join("scene.toml"), text).unwrap();
    (dir, a.join("scene.toml"), b.join("view.toml"))
}

fn strings(texts: &[&str]) -> Vec<String> {
    texts.iter().map(|t| (*t).to_owned()).collect()
}

const CLOUDS: &str = "[[cloud]]\nfrom = 'particles'\nfile = 'one.csv' # the first\n[[cloud]]\nfrom \
    = 'particles'\nfile = '../two.csv'\n";

#[test]
fn phases_do_not_take_back_what_is_seen() {
    let phases = "[[phase]]\nname = 'a'\nframes = 2\nset.film = { width = 40, height = 30 \
        }\nset.threads.mode = 'serial'\n\
        [[phase]]\nname = 'b'\nframes = 3\nset.\"cloud.*.seed\" = 5\nset.\"cloud.0.file\" = \
        '../two.csv'\n\
        [[phase]]\nname = 'c'\nframes = 1\nset.camera.path = [{ time_s = 0, position = [0, 0, 9], \
        target = [0, 0, 0] }]\n\
        [[phase]]\nname = 'd'\nframes = 1\nset.\"film.width\" = 50\nset.lighting.bases = \
        4\nset.\"cloud.1.seed\" = 3\n";
    let camera = "[camera]\npath = [{ time_s = 1, position = [0, 0, 8], target = [0, 0, 0] }]\n";
    let (_dir, from, to) = two_folders(&format!("{camera}{CLOUDS}{phases}"));
    for set in [
        &["film.width=99", "threads.mode=parallel"][..],
        &["film={ width = 77 }", "lighting.bases=2"],
        &["cloud.0.seed=9", "camera.path.0.position=[0, 0, 12]"],
        &[
            "cloud.*.seed=11",
            "camera.path=[{ time_s = 0, position = [1, 0, 8], target = [0, 0, 0] }]",
        ],
        &["cloud.*.file=one.csv"],
        &[
            "title = \"what is = seen\"",
            "draw.path=sprites",
            "light.0.irradiance=[1, 1, 1]",
            "material.0.kd=[0.5, 0.5, 0.5]",
        ],
    ] {
        let set = strings(set);
        save(&from, &to, &set, None).unwrap();
        assert_same(
            &load(&to, &[], None).unwrap(),
            &load(&from, &set, None).unwrap(),
            &format!("{set:?}"),
        );
        fs::remove_file(&to).unwrap();
    }
    // Without what gives way to it a phase would be another.
    let plain = load(&from, &[], None).unwrap();
    assert_eq!(plain.phases[0].scene.film.width, 40);
}

#[test]
fn however_tables_are_written() {
    for text in [
        format!(
            "film.width = 3 # inline\ncamera = {{ position = [0, 0, 8], up = [0, 1, 0] \
            }}\n{CLOUDS}"
        ),
        "cloud = [{ from = 'particles', file = 'one.csv' }, { from = 'particles', file \
         = \"../two.csv\" }]\n"
            .to_owned(),
        format!("{CLOUDS}[[camera.path]]\ntime_s = 0\nposition = [0, 0, 8]\ntarget = [0, 0, 0]\n"),
        format!("\u{feff}[film]\r\nwidth = 5 # five\r\n\r\n{}", CLOUDS.replace('\n', "\r\n")),
    ] {
        let (_dir, from, to) = two_folders(&text);
        let camera = if text.contains("camera.path") {
            "camera.path=[{ time_s = 0, position = [1, 0, 8], target = [0, 0, 0] }]"
        } else {
            "camera.position=[1, 0, 8]"
        };
        let set = strings(&[
            "film.width=40",
            "film.height=30",
            camera,
            "cloud.1.seed=4",
            "draw.path=\"sprites\"",
        ]);
        save(&from, &to, &set, None).unwrap();
        assert_same(&load(&to, &[], None).unwrap(), &load(&from, &set, None).unwrap(), &text);
        let saved = fs::read_to_string(&to).unwrap();
        assert!(
            saved.contains("../a/one.csv") && saved.contains("\"../two.csv\"")
                || saved.contains("'../two.csv'"),
            "{saved}"
        );
        for comment in ["# inline", "# five", "# the first"] {
            assert_eq!(saved.contains(comment), text.contains(comment), "{saved}");
        }
        let n_lines = saved.matches('\n').count();
        assert!(saved.matches("\r\n").count() == if text.contains('\r') { n_lines } else { 0 });
    }
}

#[test]
fn nothing_is_written_over_and_nothing_wrong_is_written() {
    let (dir, from, to) = two_folders(CLOUDS);
    fs::write(&to, "mine").unwrap();
    let error = save(&from, &to, &[], None).unwrap_err().to_string();
    assert!(
        error.ends_with("exists already") && fs::read_to_string(&to).unwrap() == "mine",
        "{error}"
    );
    let other = to.with_file_name("other.toml");
    for (set, what) in [
        ("film.width", "expected key.path=VALUE"),
        ("film.width=[", "no TOML"),
        ("cloud.2.seed=1", "`cloud.2` does not exist: `cloud` has 2 items"),
        ("cloud.0.file.x=1", "is no table"),
    ] {
        let error = save(&from, &other, &strings(&[set]), None).unwrap_err().to_string();
        assert!(error.contains(what), "{set}: {error}");
    }
    let error = save(&from, &dir.path().join("none/view.toml"), &[], None).unwrap_err().to_string();
    assert!(error.contains("its folder"), "{error}");
    // A list in a folder that is no more.
    fs::write(&from, CLOUDS.replace("../two.csv", "gone/two.csv")).unwrap();
    assert!(save(&from, &other, &[], None).is_err());
    assert!(!other.exists() && fs::read_dir(to.parent().unwrap()).unwrap().count() == 1);
}
