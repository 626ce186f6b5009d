//! Every scene on SwiftShader, a Vulkan driver of another code base than lavapipe: no validation
//! message, and lavapipe's picture but for rounding.

use std::path::Path;
use std::process::Command;

use crate::program;
use crate::swiftshader;
use nimbus::io::image;

/// Greatest difference of two drivers' pictures, of colours up to about 1. Blending into a 16-bit
/// target rounds each layer by 2⁻¹², and the drivers may round apart in each; thick clouds have
/// some tens of layers that count.
const MOST: f64 = 32.0 / 4096.0;
/// Pixels that may differ by more: the centre of a pixel lies on the edge of a surface, and a
/// driver may take either side of it.
const MOST_EDGES: usize = 8;

fn render(scene: &Path, to: &Path, on_other: bool) -> Vec<[f64; 4]> {
    let [scene, out] = [scene, to].map(|path| path.display().to_string());
    let args = ["render", &scene, "--size", "64x48", "--validation", "--force", "-o", &out];
    let mut command: Command = program::nimbus(&args);
    if on_other {
        swiftshader::choose(&mut command);
    }
    let output = command.output().expect("it runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{scene}, on another driver: {on_other}: {text}");
    image::read(to).expect("a picture").rgba
}

#[test]
fn every_scene_is_the_same_picture_on_another_driver() {
    let folder = tempfile::tempdir().expect("a folder");
    for scene in &program::scenes() {
        let own = render(scene, &folder.path().join("a.exr"), false);
        let other = render(scene, &folder.path().join("b.exr"), true);
        assert_eq!(own.len(), other.len());
        let apart = |(a, b): (&[f64; 4], &[f64; 4])| {
            a.iter().zip(b).map(|(a, b)| (a - b).abs() / a.abs().max(1.0)).fold(0.0, f64::max)
        };
        let all: Vec<f64> = own.iter().zip(&other).map(apart).collect();
        let n_apart = all.iter().filter(|d| **d > MOST || d.is_nan()).count();
        let most = all.iter().copied().filter(|d| *d <= MOST).fold(0.0, f64::max);
        println!("{}: {most:.1e}, {n_apart} pixels beyond", scene.display());
        // Far ground has triangles smaller than pixels, and fields of other colours beside them.
        let text = std::fs::read_to_string(scene).expect("a scene");
        let most = if text.contains("[[ground]]") { 6 * MOST_EDGES } else { MOST_EDGES };
        assert!(n_apart <= most, "{}: {n_apart} pixels differ", scene.display());
    }
}
