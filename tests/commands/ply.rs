//! Particles as PLY files: what `inspect` writes draws the same picture, and what cannot be written
//! or read is refused.

use crate::program::{path, run};

const SCENE: &str = "[film]\nwidth = 48\nheight = 36\n\
    [camera]\nposition = [0.0, 0.5, 6.0]\ntarget = [0.0, 0.0, 0.0]\n\
    [[light]]\nkind = 'directional'\ndirection = [0.0, -1.0, 0.0]\nirradiance = [1.0, 1.0, 1.0]\n\
    [[material]]\nname = 'white'\nkd = [0.9, 0.8, 0.7]\n\
    [[cloud]]\nfrom = 'particles'\nfile = 'FILE'\n";
/// Numbers that f32 has, and places that add up to 0 with those of the lighting origin.
const LIST: &str = "x,y,z,sigma,sigma_y,kappa,r,g,b\n\
    1,0.5,-0.25,0.5,0.5,1.5,1,1,1\n-1,-0.5,0.25,0.5,0.125,2,0.5,1,1\n0,0,0,0.25,0.25,5,1,0.25,1\n";

/// Writes a scene with a file of particles, and returns its path.
fn scene(dir: &tempfile::TempDir, name: &str, file: &str) -> String {
    let path = path(dir, name);
    std::fs::write(&path, SCENE.replace("FILE", file)).expect("room");
    path
}

fn pixels(scene: &str, out: &str) -> Vec<u8> {
    let output = run(&["render", scene, "-o", out, "-q", "--force"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    image::open(out)
        .expect("a picture")
        .into_rgb16()
        .into_raw()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect()
}

#[test]
fn written_particles_draw_the_same_picture() {
    let dir = tempfile::tempdir().expect("a folder");
    std::fs::write(path(&dir, "list.csv"), LIST).expect("room");
    let of_csv = scene(&dir, "csv.toml", "list.csv");
    let expected = pixels(&of_csv, &path(&dir, "csv.png"));
    for more in [&["--reference"][..], &[]] {
        let ply = path(&dir, "list.ply");
        let output =
            run(&[&["inspect", &of_csv, "--particles", "-o", &ply, "--force"], more].concat());
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && text.contains("list.ply: 3 particles"), "{text}");
        let of_ply = scene(&dir, "ply.toml", "list.ply");
        assert_eq!(pixels(&of_ply, &path(&dir, "ply.png")), expected, "{more:?}");
    }
}

#[test]
fn what_cannot_be_written_or_read_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    std::fs::write(path(&dir, "list.csv"), LIST).expect("room");
    let of_csv = scene(&dir, "csv.toml", "list.csv");
    let refusal = |args: &[&str]| {
        let output = run(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        String::from_utf8_lossy(&output.stderr).replace(&format!("{}/", dir.path().display()), "")
    };
    let inspect =
        |name: &str| refusal(&["inspect", &of_csv, "--particles", "-o", &path(&dir, name)]);
    assert_eq!(inspect("a.csv"), "error: -o a.csv: expected a name that ends in .ply\n");
    std::fs::write(path(&dir, "old.ply"), "mine").expect("room");
    assert_eq!(inspect("old.ply"), "error: old.ply: exists; --force replaces it\n");
    assert_eq!(std::fs::read(path(&dir, "old.ply")).expect("the old one"), b"mine");
    let of_ply = scene(&dir, "ply.toml", "old.ply");
    let text = refusal(&["render", &of_ply, "-o", &path(&dir, "a.png")]);
    assert_eq!(text, "error: old.ply:1:1: expected `ply`, the first line of a PLY file\n");
    let lost = scene(&dir, "lost.toml", "lost.ply");
    let text = refusal(&["render", &lost, "-o", &path(&dir, "a.png")]);
    assert!(text.contains("lost.toml:16:8: `cloud.0.file`: lost.ply: no such file"), "{text}");
}
