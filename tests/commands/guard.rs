//! Faults in whole frames: guard bands find reads and writes beyond the end of a buffer, and
//! validation finds missing barriers. Work in parts draws the same bytes.

use std::fs;
use std::path::{Path, PathBuf};

use crate::program;
use nimbus::frame::{DeviceChoice, Stage};
use nimbus::gpu::Barriers;
use nimbus::io::scene_file;

/// A fault of a shader, and a scene that shows it.
struct Fault {
    file: &'static str,
    right: &'static str,
    wrong: &'static str,
    scene: &'static str,
    settings: &'static [&'static str],
}

const TILES: &[&str] = &["draw.path=\"tiles\""];
const NOT_CULLED: &[&str] = &["draw.cull=\"off\""];
const CHUNKED: &[&str] = &["draw.path=\"sprites\"", "draw.chunks=4"];

const fn fault(
    file: &'static str,
    right: &'static str,
    wrong: &'static str,
    scene: &'static str,
    settings: &'static [&'static str],
) -> Fault {
    Fault { file, right, wrong, scene, settings }
}

/// Faults that write beyond the end, and the pass and buffer that are named.
const WRITES: &[(Fault, &str, &str)] = &[
    (
        fault("generate.comp", "status[i] =", "status[i + 1u] =", "clusters-20", &[]),
        "generate",
        "generate.status",
    ),
    (
        fault(
            "live.comp",
            "STORE_BALL(d.i_first + slot,",
            "STORE_BALL(d.i_first + slot + push.n_particles,",
            "puff",
            &[],
        ),
        "live",
        "generate.particles",
    ),
    (
        fault("place.comp", "STORE_PLACED(i,", "STORE_PLACED(i + 1u,", "hello", &[]),
        "place",
        "place.placed",
    ),
    (
        fault(
            "facets_surfaces.comp",
            "facets[j] =",
            "facets[j + push.n_facets] =",
            "rectangles",
            &[],
        ),
        "facets",
        "facets.facets",
    ),
    (
        fault("transmit.comp", "transmittance[k] =", "transmittance[k + 1u] =", "hello", &[]),
        "transmit",
        "transmit.transmittance",
    ),
    (
        fault("first.comp", "lit[j].direct =", "lit[j + 1u].direct =", "hello", &[]),
        "first",
        "first.lit",
    ),
    (
        fault("second_sources.comp", "sources[i] =", "sources[i + push.n_facets] =", "hello", &[]),
        "second",
        "second.sources",
    ),
    (
        fault("second_gather.comp", "lit[j].indirect", "lit[j + 64u].indirect", "rectangles", &[]),
        "second",
        "first.lit",
    ),
    (
        fault("contract.comp", "lit[j].direct =", "lit[j + 1u].direct =", "materials", &[]),
        "contract",
        "first.lit",
    ),
    (
        fault(
            "cull_test.comp",
            "masks[tile * WORDS + w] =",
            "masks[(tile + n_tiles) * WORDS + w] =",
            "hello",
            &[],
        ),
        "cull",
        "cull.masks",
    ),
    (
        fault(
            "sort_key.comp",
            "entries[i + group.shift] =",
            "entries[i + group.shift + 1u] =",
            "hello",
            NOT_CULLED,
        ),
        "sort",
        "sort.entries",
    ),
    (
        fault("texture_pack.comp", "pool[i] =", "pool[i + 1u] =", "hello", &[]),
        "texture",
        "texture.pool",
    ),
    (
        fault("chunks_order.comp", "nearest[i /", "nearest[1u + i /", "hello", CHUNKED),
        "sprites",
        "chunks.nearest",
    ),
    (
        fault(
            "tiles_splat.comp",
            "reach[r] = first |",
            "reach[r + 64u * gl_NumWorkGroups.x] = first |",
            "hello",
            TILES,
        ),
        "tiles",
        "tiles.reaches",
    ),
    (
        fault(
            "tiles_ranges.comp",
            "ranges[n_before++] =",
            "ranges[n_before++ + 256u] =",
            "hello",
            TILES,
        ),
        "tiles",
        "tiles.ranges",
    ),
];

/// Faults that read beyond the end. The picture shows them, and no pass is named.
const READS: &[Fault] = &[
    fault(
        "first.comp",
        "ARRIVING(k) transmittance[k]",
        "ARRIVING(k) transmittance[(k) + push.n_facets * push.n_lights]",
        "hello",
        &[],
    ),
    fault("transmit.comp", "facets[j];", "facets[j + push.n_facets];", "hello", &[]),
    fault(
        "contract.comp",
        "float direct = FLOAT(t1, int(l * push.n_rows + rows[0]))",
        "float direct = FLOAT(t1, int((l + push.n_lights) * push.n_rows + rows[0]))",
        "materials",
        &[],
    ),
];

/// Draws a small picture of a scene with a faulty shader. Returns exit code and messages.
fn render(folder: &Path, fault: &Fault, options: &[&str], to: &Path) -> (Option<i32>, String) {
    let Fault { file, right, wrong, scene, settings } = fault;
    let source = fs::read_to_string(Path::new("shaders").join(file)).expect("a shader");
    assert!(source.contains(right), "{file} has no {right:?}");
    fs::write(folder.join(file), source.replace(right, wrong)).expect("a shader");
    let mut command = program::nimbus(&["render", &format!("scenes/{scene}.toml")]);
    command.args(["--size", "64x48", "--quiet", "--force", "--shaders"]).arg(folder);
    command.args(settings.iter().flat_map(|set| ["--set", set])).args(options).arg("-o").arg(to);
    let output = command.output().expect("nimbus runs");
    fs::remove_file(folder.join(file)).expect("removed");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn folders() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let dir = tempfile::tempdir().expect("a folder");
    let (shaders, picture) = (dir.path().join("shaders"), dir.path().join("p.exr"));
    fs::create_dir(&shaders).expect("a folder");
    (dir, shaders, picture)
}

#[test]
fn every_write_beyond_the_end_is_found_and_named() {
    let (_dir, shaders, picture) = folders();
    for (fault, pass, buffer) in WRITES {
        let Fault { file, right, .. } = fault;
        let named = format!("pass {pass} wrote beyond the end of {buffer} (");
        let (code, message) = render(&shaders, fault, &["--guard"], &picture);
        assert!(code == Some(1) && message.contains(&named), "{file}, {right}: {code:?} {message}");
        assert!(!picture.exists(), "{file}: a picture was written");
    }
}

#[test]
fn every_read_beyond_the_end_changes_the_guarded_picture() {
    let (_dir, shaders, picture) = folders();
    let bytes = |fault: &Fault, options: &[&str]| {
        let (code, message) = render(&shaders, fault, options, &picture);
        assert_eq!(code, Some(0), "{}: {message}", fault.file);
        fs::read(&picture).expect("a picture")
    };
    for fault in READS {
        assert!(bytes(fault, &["--guard"]) != bytes(fault, &[]), "{}", fault.file);
    }
    let first = &READS[0];
    let none = Fault { wrong: first.right, ..*first };
    assert!(bytes(&none, &["--guard"]) == bytes(&none, &[]));
}

/// Returns the messages of validation about one frame of a scene.
fn messages(scene: &str, barriers: Barriers) -> String {
    let path = PathBuf::from(format!("scenes/{scene}.toml"));
    let set = ["film.width=64", "film.height=48"].map(str::to_owned);
    let scene = scene_file::load(&path, &set, None).expect("a scene").scene;
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let mut stage = Stage::new(scene, &choice, true).expect("a device");
    stage.renderer.set_barriers(barriers);
    let packet = stage.game.step(0).expect("a step");
    stage.renderer.step(packet).expect("a frame");
    stage.close().err().map_or(String::new(), |e| e.to_string())
}

#[test]
fn every_missing_barrier_is_found() {
    // The layers of Vulkan 1.3.239 and 1.4.309 both see these. The newer one does not see those of
    // contract and cull.
    const CASES: [&str; 8] =
        ["place", "grid", "facets", "transmit", "first", "second", "sort", "tiles"];
    for scene in ["hello", "materials"] {
        assert_eq!(messages(scene, Barriers::Placed), "", "{scene}");
    }
    for pass in CASES {
        let found = messages("hello", Barriers::OmittedIn(pass));
        assert!(found.contains("HAZARD"), "{pass}: {found:?}");
    }
}

#[test]
fn short_parts_draw_the_same_bytes_in_every_scene() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("p.exr");
    let picture = |scene: &str, options: &[&str]| {
        let mut command = program::nimbus(&["render", scene, "--size", "96x72", "--force"]);
        let output = command.args(options).arg("-o").arg(&path).output().expect("nimbus runs");
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{scene}: {message}");
        fs::read(&path).expect("a picture")
    };
    for scene in program::scenes() {
        let scene = scene.to_str().expect("UTF-8");
        let whole = picture(scene, &[]);
        // So short a limit also splits passes that take less than the usual 20 ms.
        let parts = picture(scene, &["--max-submit-ms", "0.5"]);
        assert!(parts == whole, "{scene}: parts of 0.5 ms");
    }
}
