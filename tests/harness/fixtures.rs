//! A folder with an input of every kind, small enough that a command on it takes a fraction of a
//! second, and the program run in that folder.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// A lit scene with a cloud and a rectangle.
pub const SCENE: &str = "\
[film]
width = 32
height = 24
[time]
frames = 3
[lighting]
mode = \"two-reflection\"
grid = 8
bases = 2
[[cloud]]
from = \"particles\"
file = \"p.csv\"
texture = \"none\"
wind = [0.1, 0.0, 0.0]
[[surface]]
center = [0.0, -1.0, 0.0]
u = [0.0, 0.0, 2.0]
v = [2.0, 0.0, 0.0]
subdivide = [2, 2]
";
/// Eight particles.
pub const PARTICLES: &str = "\
x, y, z, radius, kappa\n0, 0, 0, 0.5, 2\n0.3, 0, 0, 0.5, 2\n0, 0.3, 0, 0.5, 2\n0, 0, 0.3, 0.5, 2
-0.3, 0, 0, 0.5, 2\n0, -0.3, 0, 0.5, 2\n0, 0, -0.3, 0.5, 2\n0.2, 0.2, 0, 0.5, 2\n";

/// The exit codes that the documentation names, but for 101, which is a fault of nimbus.
pub const DOCUMENTED: [i32; 7] = [0, 1, 2, 3, 70, 75, 130];

/// A folder of inputs.
pub struct Fixtures {
    pub dir: TempDir,
    /// The cache of references of these tests alone. It is outside `dir`, whose files are counted.
    cache: TempDir,
}

impl Fixtures {
    /// Makes a scene, a picture, results of a bench, a plan, a weather file, a pipe and a folder.
    pub fn new() -> Fixtures {
        let folder = || tempfile::tempdir().expect("a folder");
        let fixtures = Fixtures { dir: folder(), cache: folder() };
        // A first run compiles shaders and checks the device's stages, which takes most of its
        // time. All tests share the caches of both, which keep them by content.
        for name in ["spirv", "stages"] {
            let shared = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
            fs::create_dir_all(&shared).expect("room");
            std::os::unix::fs::symlink(shared, fixtures.cache.path().join(name)).expect("room");
        }
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let at = |name: &str| fixtures.dir.path().join(name);
        fs::write(at("s.toml"), SCENE).expect("room");
        fs::write(at("p.csv"), PARTICLES).expect("room");
        fs::write(at("b.dat"), "8\n1\n8, 1, 1, 1, 0, 0, 0, 2\n").expect("room");
        let weather = root.join("scenes/weather/supercell.nc");
        fs::copy(weather, at("w.nc")).expect("room");
        fs::create_dir_all(at("dir")).expect("room");
        fs::create_dir_all(at("shaders")).expect("room");
        fs::copy(root.join("shaders/first.comp"), at("shaders/first.comp")).expect("room");
        fs::write(at("empty"), "").expect("room");
        fs::write(at("binary"), [0u8, 255, 1, 254, 10, 0]).expect("room");
        let made = Command::new("mkfifo").arg(at("pipe")).status().expect("mkfifo");
        assert!(made.success());
        fixtures
    }

    /// Also draws a picture, times a bench and plans a farm.
    pub fn with_results() -> Fixtures {
        let fixtures = Fixtures::new();
        for line in [
            "render s.toml -o a.png -q",
            "render s.toml -o a.exr -q",
            "bench s.toml --out run --frames 2 --warmup 0 -q",
            "error s.toml --out study --knob draw.cutoff=2 --rounds 1 --frames 1 -q",
            "farm plan s.toml -o farm -q",
            "farm local --plan farm -q",
        ] {
            let output = fixtures.run(line.split(' '));
            assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        }
        fixtures
    }

    /// Returns the program in this folder, without display and with its own cache.
    pub fn command<A: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = A>) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("nimbus"));
        command.env("NIMBUS_PROGRESS_S", "0");
        command.args(args).current_dir(self.dir.path()).stdin(Stdio::null());
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        command.env("NIMBUS_CACHE_DIR", self.cache.path());
        command
    }

    /// Runs the program in this folder.
    pub fn run<A: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = A>) -> Output {
        self.command(args).output().expect("it runs")
    }
}

/// Fails unless a run ended with a documented exit code, and without a panic.
pub fn check_end(what: &str, output: &Output) {
    let (code, errors) = (output.status.code(), String::from_utf8_lossy(&output.stderr));
    assert!(code.is_some_and(|code| DOCUMENTED.contains(&code)), "{what}: {code:?}: {errors}");
    assert!(!errors.contains("panicked"), "{what}: {errors}");
}
