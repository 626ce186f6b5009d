//! Tests of the limits that a scene is checked against, and of the advice on costly settings.

mod harness;

use harness::Gpu;
use nimbus::frame::limits::{advice, check, n_deposits};
use nimbus::io::scene_file;
use nimbus::model::scene::Scene;
use nimbus::model::sums::Precision;
use nimbus::model::texture::Choice;

fn scene(n_particles: u32, grid: u32, mode: &str) -> Scene {
    let dir = tempfile::tempdir().unwrap();
    let boxes = format!("{n_particles}\n1\n{n_particles}, 1, 1, 1, 0, 0, 0, 2\n");
    std::fs::write(dir.path().join("b.dat"), boxes).unwrap();
    let path = dir.path().join("s.toml");
    std::fs::write(&path, "[[cloud]]\nfrom = \"boxes\"\nfile = \"b.dat\"\nradius_scale = 0.6\n")
        .unwrap();
    let set = [format!("lighting.grid={grid}"), format!("lighting.mode={mode}")];
    scene_file::load(&path, &set, None).unwrap().scene
}

#[test]
fn blobs_much_larger_than_cells_give_advice() {
    assert!(advice(&scene(500, 64, "first")).is_empty());
    assert!(advice(&scene(3_000_000, 64, "first"))[0].contains("lighting.grid = 64"));
    assert!(advice(&scene(3_000_000, 64, "none")).is_empty());
    // The inner cells are half as many a side: 60 and 30.
    assert!(n_deposits(&scene(1000, 64, "first")) > 6.0 * n_deposits(&scene(1000, 34, "first")));
}

#[test]
fn a_device_of_few_texels_refuses_nothing_for_them() {
    let mut limits = *Gpu::new().device.limits();
    let mut scene = scene(500, 64, "first");
    scene.clouds[0].texture.choice = Choice::ByBox;
    assert!(check(&scene, &limits).is_ok());
    // Shaders then read the grid and the pool of textures as storage buffers.
    limits.max_texels = 1000;
    assert!(check(&scene, &limits).is_ok());
    limits.max_storage_buffer_bytes = 1000;
    let refused = check(&scene, &limits).unwrap_err().to_string();
    assert!(refused.contains("this device takes") && refused.contains("maxStorage"), "{refused}");
}

#[test]
fn f64_sums_are_refused_on_a_device_without_doubles() {
    let mut limits = *Gpu::new().device.limits();
    let mut scene = scene(500, 64, "first");
    scene.lighting.sums.precision = Precision::F64;
    limits.has_float64 = true;
    assert!(check(&scene, &limits).is_ok());
    limits.has_float64 = false;
    let refused = check(&scene, &limits).unwrap_err();
    assert_eq!(refused.exit_code(), 2);
    let message = refused.to_string();
    assert!(
        message.contains("lighting.precision = \"f64\"") && message.contains("shaderFloat64"),
        "{message}"
    );
    scene.lighting.sums.precision = Precision::F32;
    assert!(check(&scene, &limits).is_ok());
}

#[test]
fn a_step_too_short_for_the_march_is_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s.toml");
    std::fs::write(&path, "[lighting]\ngrid = 512\nstep = 0.2\n").unwrap();
    let error = scene_file::load(&path, &[], None).unwrap_err().to_string();
    assert!(
        error.contains("s.toml:3:") && error.contains("0.2165") && error.contains("grid = 512"),
        "{error}"
    );
    assert!(scene_file::load(&path, &["lighting.step=0.22".into()], None).is_ok());
}
