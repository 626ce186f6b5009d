//! Files that scenes name: missing files, files that are no text, and contents that are refused.

use std::fs;
use std::path::Path;

use crate::scene_text::{CLOUD, assert_message, folder, message};
use nimbus::io::scene_file::load;

#[test]
fn missing_files_are_refused_at_the_key_that_names_them() {
    let named = |file: &str| format!("[[cloud]]\nfrom = 'boxes'\nfile = '{file}'");
    assert_message(
        &named("gone.dat"),
        "scene.toml:3:8: `cloud.0.file`: gone.dat: no such file; names are relative to the \
         scene's folder",
    );
    assert_message(
        &named(""),
        "scene.toml:3:8: `cloud.0.file`: expected a string that is not empty",
    );
    let (dir, path) = folder(&named("sub"));
    fs::create_dir(dir.path().join("sub")).unwrap();
    assert!(
        load(&path, &[], None)
            .unwrap_err()
            .to_string()
            .ends_with("sub: is a folder, expected a file")
    );
    assert!(
        message(CLOUD, &["cloud.0.file=gone.dat"])
            .starts_with("--set cloud.0.file=gone.dat: `cloud.0.file`: ")
    );
    assert!(
        load(dir.path(), &[], None)
            .unwrap_err()
            .to_string()
            .ends_with(": is a folder, expected a file")
    );
    let gone = load(Path::new("gone.toml"), &[], None).unwrap_err();
    assert_eq!(gone.to_string(), "gone.toml: no such file");
}

#[test]
fn files_that_are_no_text_are_refused() {
    let (dir, path) = folder(CLOUD);
    let boxes = dir.path().join("b.dat");
    let error = || {
        load(&path, &[], None)
            .unwrap_err()
            .to_string()
            .replace(&format!("{}/", dir.path().display()), "")
    };
    fs::File::create(&boxes).unwrap().set_len(1 << 30).unwrap();
    assert_eq!(
        error(),
        "scene.toml:3:8: `cloud.0.file`: b.dat: too large: 1024 MiB (1073741824 bytes), the \
         limit is 64 MiB"
    );
    fs::write(&boxes, "3\n1\n3, \0").unwrap();
    assert_eq!(error(), "b.dat:3:4: not a text file: it holds a zero byte");
    fs::write(&boxes, b"3\n1 \xff").unwrap();
    assert_eq!(error(), "b.dat:2:3: not UTF-8 text");
    fs::write(&boxes, " \n").unwrap();
    assert_eq!(error(), "b.dat:1:1: the file is empty: expected the number of particles");
    fs::write(&path, "").unwrap();
    assert_eq!(
        error(),
        "scene.toml:1:1: the file is empty: expected a scene's tables, such as [camera] \
         and [[cloud]]"
    );
    fs::write(&path, format!("title = '{}'", "x".repeat(4 << 20))).unwrap();
    assert!(error().starts_with("scene.toml: too large: 5 MiB"));
    fs::write(&path, "\u{feff}title = 3").unwrap();
    assert_eq!(
        error(),
        "scene.toml:1:9: `title`: expected a string, found integer 3; write `title = \"3\"`"
    );
}

#[test]
fn an_empty_or_too_heavy_particle_list_is_refused_by_line() {
    let (dir, path) = folder("[[cloud]]\nfrom = 'particles'\nfile = 'p.csv'\n");
    let error = |text: &str| {
        fs::write(dir.path().join("p.csv"), text).unwrap();
        load(&path, &[], None)
            .unwrap_err()
            .to_string()
            .replace(&format!("{}/", dir.path().display()), "")
    };
    assert_eq!(
        error(""),
        "p.csv:1:1: the file is empty: expected a header x,y,z,sigma (or radius),kappa[,r,g,b]"
    );
    assert_eq!(
        error("x,y,z,sigma,kappa\n\n0,0,0,1e12,10\n0,0,0,1,1e4\n"),
        "scene.toml:3:8: `cloud.0.file`: line 3: κ (2π)^{3/2} σ³: expected at most 1e37, \
         found 1.575e38"
    );
    fs::write(dir.path().join("p.csv"), "x,y,z,sigma,kappa\n1e15,-1e15,0,1e-15,1e15\n0,0,0,0,0\n")
        .unwrap();
    assert_eq!(load(&path, &[], None).unwrap().scene.n_particles(), 2);
}

#[test]
fn more_particles_than_can_be_numbered_are_refused() {
    let (dir, path) = folder(&format!("{CLOUD}{CLOUD}"));
    let n = u32::MAX;
    fs::write(dir.path().join("b.dat"), format!("{n}\n1\n{n}, 1, 1, 1, 0, 0, 0, 1\n")).unwrap();
    assert!(load(&path, &[], None).unwrap_err().to_string().ends_with(
        "8589934590 particles and 0 facets of surfaces and ground: at most 4294967295 together"
    ));
}
