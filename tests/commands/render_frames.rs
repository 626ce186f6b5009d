//! `nimbus render --frames`: pictures of frames as `render --frame` and the farm draw them, clips
//! through ffmpeg, and what is left after Ctrl-C.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::program::nimbus;

fn render(arguments: &[&str]) -> Output {
    let scene = ["render", "scenes/puff.toml", "--size", "48x36"];
    nimbus(&[&scene, arguments].concat()).output().expect("it runs")
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn path(folder: &Path, name: &str) -> String {
    folder.join(name).to_str().expect("utf-8").to_owned()
}

#[test]
fn frames_are_those_of_single_pictures() {
    let dir = tempfile::tempdir().expect("a folder");
    for (format, extension) in [(&[][..], "png"), (&["--format", "exr"][..], "exr")] {
        let out = path(dir.path(), extension);
        let output = render(&[&["--frames", "3..6", "-o", &out], format].concat());
        assert!(output.status.success(), "{}", told(&output));
        for i in 3..6 {
            let single = path(dir.path(), &format!("single-{i}.{extension}"));
            let output = render(&["--frame", &i.to_string(), "-o", &single]);
            assert!(output.status.success(), "{}", told(&output));
            let frame = Path::new(&out).join(format!("frame-{i:08}.{extension}"));
            assert!(fs::read(frame).expect("a frame") == fs::read(&single).expect("a picture"));
        }
        // The pictures and their list.
        let names: Vec<_> = fs::read_dir(&out).expect("results").collect();
        assert_eq!(names.len(), 4);
        let list = fs::read_to_string(Path::new(&out).join("frames.sha256")).expect("a list");
        assert_eq!(list.lines().count(), 3);
        // They stay, unless they may be replaced.
        let again = render(&[&["--frames", "1", "-o", &out], format].concat());
        assert_eq!(again.status.code(), Some(2));
        let again = render(&[&["--frames", "1", "--force", "-o", &out], format].concat());
        assert!(again.status.success(), "{}", told(&again));
        assert_eq!(fs::read_dir(&out).expect("results").count(), 2);
    }
}

#[test]
fn faulty_arguments_are_told() {
    let dir = tempfile::tempdir().expect("a folder");
    let of = |arguments: &[&str], name: &str| {
        let place = path(dir.path(), name);
        let output = render(&[arguments, &["-o", &place]].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(!Path::new(&place).exists());
        told(&output)
    };
    assert!(of(&["--frames", "0..2"], "a.png").contains("expected -o DIR"));
    assert!(of(&["--frames", "2..2"], "a").contains("--frames"));
    assert!(of(&["--frames", "2", "--format", "exr"], "a.mp4").contains("a clip has none"));
    assert!(of(&["--frames", "2", "--frame", "1"], "a").contains("cannot be used"));
    assert!(of(&["--format", "exr"], "a.exr").contains("--frames"));
}

/// Phases may have pictures of their own sizes: single ones are drawn, and a clip is refused.
#[test]
fn phases_of_other_sizes_have_single_pictures_alone() {
    let dir = tempfile::tempdir().expect("a folder");
    let scene = path(dir.path(), "sizes.toml");
    let phase = |name: &str, width: u32| {
        format!("[[phase]]\nname = '{name}'\nframes = 1\nset.film.width = {width}\n")
    };
    let text = format!(
        "[film]\nwidth = 32\nheight = 24\n[lighting]\nmode = 'none'\n{}{}",
        phase("a", 32),
        phase("b", 40)
    );
    fs::write(&scene, text).expect("a scene");
    let of = |name: &str| {
        let place = path(dir.path(), name);
        (nimbus(&["render", &scene, "--frames", "2", "-o", &place]).output(), place)
    };
    let (output, place) = of("frames");
    let output = output.expect("it runs");
    assert!(output.status.success(), "{}", told(&output));
    let widths = [0, 1].map(|i| {
        let file = Path::new(&place).join(format!("frame-{i:08}.png"));
        image::open(file).expect("a picture").width()
    });
    assert_eq!(widths, [32, 40]);
    let (output, place) = of("clip.mp4");
    let output = output.expect("it runs");
    assert_eq!(output.status.code(), Some(2));
    assert!(told(&output).contains("another size") && !Path::new(&place).exists());
}

/// Writes a program called ffmpeg into a folder, and returns the folder as PATH.
#[cfg(unix)]
fn fake_ffmpeg(folder: &Path, text: &str) -> String {
    use std::os::unix::fs::PermissionsExt;
    let file = folder.join("ffmpeg");
    fs::write(&file, format!("#!/bin/sh\n{text}\n")).expect("a script");
    fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).expect("it may run");
    format!("{}:/usr/bin:/bin", folder.display())
}

#[cfg(unix)]
fn clip(bin: &str, place: &str, frames: &str) -> Command {
    let scene = ["render", "scenes/puff.toml", "--size", "48x36"];
    let mut command = nimbus(&[&scene[..], &["--frames", frames, "-o", place]].concat());
    command.env("PATH", bin);
    command
}

#[cfg(unix)]
#[test]
fn clips_get_the_pictures_of_the_frames() {
    let dir = tempfile::tempdir().expect("a folder");
    let place = path(dir.path(), "clip.mp4");
    // The stand-in writes its input as the clip, and its arguments beside it.
    let keep = format!("echo \"$@\" > {}/arguments\nfor last; do :; done\ncat > $last", {
        dir.path().display()
    });
    let bin = fake_ffmpeg(dir.path(), &keep);
    let output = clip(&bin, &place, "2..4").output().expect("it runs");
    assert!(output.status.success(), "{}", told(&output));
    let found = fs::read(&place).expect("a clip");
    assert_eq!(found.len(), 2 * 48 * 36 * 3);
    let arguments = fs::read_to_string(dir.path().join("arguments")).expect("arguments");
    assert!(arguments.contains("-s 48x36 -r 30 "), "{arguments}");
    for (i, frame) in (2..4).zip(found.chunks(48 * 36 * 3)) {
        let single = path(dir.path(), &format!("{i}.png"));
        let output = render(&["--frame", &i.to_string(), "-o", &single]);
        assert!(output.status.success(), "{}", told(&output));
        let png = image::open(&single).expect("a picture").into_rgb8();
        assert!(png.as_raw() == frame, "frame {i}");
    }
}

#[cfg(unix)]
#[test]
fn a_failing_encoder_leaves_nothing() {
    let dir = tempfile::tempdir().expect("a folder");
    let place = path(dir.path(), "clip.mp4");
    let failing = fake_ffmpeg(dir.path(), "echo 'no such codec' >&2; exit 1");
    let output = clip(&failing, &place, "0..40").output().expect("it runs");
    assert!(!output.status.success());
    assert!(told(&output).contains("no such codec"), "{}", told(&output));
    let missing = clip("/nonexistent", &place, "0..2").output().expect("it runs");
    assert_eq!(missing.status.code(), Some(2));
    assert!(told(&missing).contains("not in PATH"), "{}", told(&missing));
    let left: Vec<_> = fs::read_dir(dir.path()).expect("a folder").flatten().collect();
    assert_eq!(left.len(), 1, "{left:?}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_the_finished_frames() {
    let dir = tempfile::tempdir().expect("a folder");
    let bin = fake_ffmpeg(dir.path(), "for last; do :; done\ncat > $last");
    for name in ["frames", "clip.mp4"] {
        let place = path(dir.path(), name);
        let child =
            clip(&bin, &place, "0..100000").stderr(Stdio::piped()).spawn().expect("it runs");
        let begin = Instant::now();
        let has_begun = || {
            let of = |folder: &Path| {
                let files = fs::read_dir(folder).into_iter().flatten().flatten();
                files.map(|file| file.metadata().map_or(0, |m| m.len())).sum::<u64>()
            };
            let entries = fs::read_dir(dir.path()).into_iter().flatten().flatten();
            entries
                .map(|e| e.path())
                .filter(|p| p.is_dir() && !p.ends_with("done"))
                .map(|p| of(&p))
                .any(|bytes| bytes > 30_000)
        };
        while !has_begun() {
            assert!(begin.elapsed() < Duration::from_secs(300), "{name} never begins");
            std::thread::sleep(Duration::from_millis(5));
        }
        let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(kill.expect("kill").success());
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(130), "{}", told(&output));
        if name == "frames" {
            let n = fs::read_dir(&place).expect("frames").flatten().count();
            assert!(n > 2, "{n}");
            // Whole pictures, all of which are in the list.
            let list = fs::read_to_string(Path::new(&place).join("frames.sha256")).expect("a list");
            for line in list.lines() {
                let file = line.split_whitespace().last().expect("a name");
                assert!(image::open(Path::new(&place).join(file)).is_ok(), "{file}");
            }
            fs::rename(&place, dir.path().join("done")).expect("moved");
        } else {
            let bytes = fs::metadata(&place).expect("a clip").len();
            assert!(bytes > 0 && bytes.is_multiple_of(48 * 36 * 3), "{bytes}");
        }
    }
}
