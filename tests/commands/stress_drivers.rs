//! The stress suite on a second driver, and on lavapipe with other widths of vectors, which are
//! other sizes of subgroups.

use std::process::Command;

use crate::program;
use crate::swiftshader;
use serde_json::Value;

/// Runs cases of the suite on a device whose name has `device`, and asserts that all of them pass.
fn stress(families: &[&str], device: &str, choose: impl FnOnce(&mut Command)) {
    let mut command = program::nimbus(&[&["stress", "-q", "--json", "--guard"], families].concat());
    choose(&mut command);
    let output = command.output().expect("it runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "on {device}: {errors}");
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let name = json["device"]["name"].as_str().expect("a name");
    assert!(name.contains(device), "ran on {name}");
    let cases = json["cases"].as_array().expect("cases");
    let of = |verdict: &str| cases.iter().filter(|c| c["verdict"] == verdict).count();
    let (n, n_passed) = (cases.len(), of("passed"));
    assert!(n > 0 && n_passed == n, "{n_passed} of {n} pass on {name}");
}

/// Chooses lavapipe with vectors of `bits`. Mesa's cache of compiled shaders does not know of the
/// width.
fn width<'a>(bits: &'a str, cache: &'a tempfile::TempDir) -> impl FnOnce(&mut Command) + 'a {
    move |command| {
        command.args(["--device", "llvmpipe"]).env("LP_NATIVE_VECTOR_WIDTH", bits);
        command.env("MESA_SHADER_CACHE_DIR", cache.path());
    }
}

/// Families whose shaders use subgroups. Light through clouds and scattered light use none, and the
/// others draw by the same shaders.
#[test]
fn families_pass_with_subgroups_of_four() {
    let cache = tempfile::tempdir().expect("a folder");
    let families = [
        "functions/",
        "generation/",
        "live/",
        "count/",
        "moisture/",
        "brdf/",
        "transport/",
        "sorting/",
        "compositing/",
        "lod/",
        "determinism/",
    ];
    stress(&families, "128 bits", width("128", &cache));
}

/// Mesa 22.3.6 crashes in every graphics pipeline at this width, so that only families without
/// pictures run.
#[test]
fn computed_families_pass_with_subgroups_of_sixteen() {
    let cache = tempfile::tempdir().expect("a folder");
    let families = ["functions/", "generation/", "live/", "moisture/", "sorting/"];
    stress(&families, "512 bits", width("512", &cache));
}

/// The other families take a quarter of an hour there.
#[test]
fn families_pass_on_another_driver() {
    let families = [
        "functions/",
        "count/",
        "moisture/",
        "brdf/",
        "sorting/",
        "compositing/",
        "lod/",
        "harmonics/",
    ];
    stress(&families, "SwiftShader", swiftshader::choose);
}
