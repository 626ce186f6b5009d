//! `nimbus export --mitsuba`, and the layers of `nimbus render --reference transport`.

use std::path::Path;

use crate::program::{path, run};

/// One ball and one ellipsoid over a floor.
const SCENE: &str = "[film]\nwidth = 24\nheight = 18\n\
    [camera]\nposition = [0.0, 0.5, 6.0]\ntarget = [0.0, 0.0, 0.0]\n\
    [lighting]\nmode = 'first'\n\
    [[light]]\nkind = 'directional'\ndirection = [0.0, -1.0, 0.0]\nirradiance = [1.0, 1.0, 1.0]\n\
    [[light]]\nkind = 'sky'\nirradiance = [0.5, 0.6, 0.7]\nconstant = 0.2\n\
    [[material]]\nname = 'white'\nkd = [0.9, 0.8, 0.7]\nphase = 0.5\n\
    [[surface]]\ncenter = [0.0, -1.0, 0.0]\nu = [0.0, 0.0, 2.0]\nv = [2.0, 0.0, 0.0]\n\
    [[cloud]]\nfrom = 'particles'\nfile = 'list.csv'\n";
const LIST: &str = "x,y,z,sigma,sigma_y,kappa,r,g,b\n\
    0.3,0.1,-0.2,0.5,0.5,1.5,1,1,1\n-0.4,0.2,0.3,0.4,0.1,2.0,0.5,1,1\n0.0,0.0,0.0,0.01,0.01,5.0,1,1,1\n";

fn scene(dir: &Path, more: &str) -> String {
    std::fs::write(dir.join("list.csv"), LIST).expect("a list");
    let path = dir.join("scene.toml");
    std::fs::write(&path, format!("{SCENE}{more}")).expect("a scene");
    path.display().to_string()
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

fn number(bytes: &[u8], at: usize) -> f64 {
    f64::from(f32::from_bits(word(bytes, at)))
}

/// The grid has the mass of all blobs, the scene file is XML that names the files, and numbers are
/// those of the scene.
#[test]
fn an_export_has_the_mass_of_all_blobs() {
    let dir = tempfile::tempdir().expect("a folder");
    let scene = scene(dir.path(), "");
    let out = path(&dir, "out");
    let output = run(&["export", &scene, "--mitsuba", &out, "--step", "0.1"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let grid = std::fs::read(format!("{out}/extinction.vol")).expect("a grid");
    assert_eq!((&grid[..4], word(&grid, 4), word(&grid, 20)), (&b"VOL\x03"[..], 1, 1));
    let n = [8, 12, 16].map(|at| word(&grid, at) as usize);
    let of = |k: usize| number(&grid, 24 + 4 * k);
    for (axis, cells) in n.iter().enumerate() {
        assert!((of(axis + 3) - of(axis) - 0.1 * *cells as f64).abs() < 1e-5);
    }
    assert_eq!(grid.len(), 48 + 4 * n.iter().product::<usize>());
    let sum: f64 = (0..n.iter().product()).map(|k| number(&grid, 48 + 4 * k)).sum();
    // κ (2π)^{3/2} σ² σ_y.
    let mass = |kappa: f64, sigma: f64, high: f64| {
        kappa * std::f64::consts::TAU.powf(1.5) * sigma * sigma * high
    };
    let all = mass(1.5, 0.5, 0.5) + mass(2.0, 0.4, 0.1) + mass(5.0, 0.01, 0.01);
    assert!((sum * 1e-3 / all - 1.0).abs() < 1e-5, "{sum} {all}");
    // Particles of two colours have two albedos.
    let albedo = std::fs::read(format!("{out}/albedo.vol")).expect("albedos");
    assert_eq!(word(&albedo, 20), 3);
    let values = (0..3 * n.iter().product::<usize>()).map(|k| number(&albedo, 48 + 4 * k));
    let [low, high] = values.fold([1.0f64, 0.0f64], |[low, high], v| [low.min(v), high.max(v)]);
    assert!(low > 0.5 && low < 0.99 && high == 1.0, "{low} {high}");
    let text = std::fs::read_to_string(format!("{out}/scene.xml")).expect("a scene");
    let xml = roxmltree::Document::parse(&text).expect("XML");
    let named = |name: &str| {
        let node = xml.descendants().find(|node| node.attribute("name") == Some(name));
        node.and_then(|node| node.attribute("value")).expect(name)
    };
    assert_eq!((named("g"), named("width"), named("reflectance")), ("0.5", "24", "0.9, 0.8, 0.7"));
    for name in ["filename"]
        .iter()
        .flat_map(|name| xml.descendants().filter(move |node| node.attribute("name") == Some(name)))
    {
        let file = name.attribute("value").expect("a name");
        assert!(Path::new(&out).join(file).exists(), "{file}");
    }
    // An export is not replaced unasked.
    assert_eq!(run(&["export", &scene, "--mitsuba", &out]).status.code(), Some(2));
    assert!(run(&["export", &scene, "--mitsuba", &out, "--force", "-q"]).status.success());
}

/// Each spot throws its own picture.
#[test]
fn spots_throw_pictures() {
    let dir = tempfile::tempdir().expect("a folder");
    let spot = |x: f64, outer: f64| {
        format!(
            "[[light]]\nkind = 'spot'\nposition = [{x}, 3.0, 0.0]\ndirection = [0.0, -1.0, 0.0]\n\
             intensity = [1.0, 2.0, 3.0]\nouter_deg = {outer:?}\n"
        )
    };
    let scene = scene(dir.path(), &(spot(0.5, 30.0) + &spot(-0.5, 40.0)));
    let out = path(&dir, "out");
    assert!(run(&["export", &scene, "--mitsuba", &out, "-q"]).status.success());
    let text = std::fs::read_to_string(format!("{out}/scene.xml")).expect("a scene");
    let xml = roxmltree::Document::parse(&text).expect("XML");
    let spots: Vec<_> =
        xml.descendants().filter(|node| node.attribute("type") == Some("spot")).collect();
    assert_eq!(spots.len(), 2);
    let mut places = Vec::new();
    for (i, (spot, outer)) in spots.iter().zip([30.0, 40.0]).enumerate() {
        let named = |name: &str| {
            let node = spot.descendants().find(|node| node.attribute("name") == Some(name));
            node.and_then(|node| node.attribute("value")).expect("a value")
        };
        let place = spot.descendants().find_map(|node| node.attribute("origin")).expect("a place");
        let x = place.split(", ").next().expect("coordinates");
        places.push(x.parse::<f64>().expect("a number"));
        assert!((named("cutoff_angle").parse::<f64>().expect("an angle") - outer).abs() < 1e-9);
        assert_eq!((named("intensity"), named("filename")), ("1, 2, 3", &*format!("spot-{i}.exr")));
        assert!(Path::new(&out).join(named("filename")).exists());
    }
    // Places are relative to an origin of light.
    assert!((places[0] - places[1] - 1.0).abs() < 1e-9, "{places:?}");
}

#[test]
fn what_mitsuba_has_not_is_refused_and_nothing_written() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = path(&dir, "out");
    for (more, set, expected) in [
        ("", "material.*.ks=[0.1,0.1,0.1]", "lobe"),
        ("", "material.*.phase=\"mie\"", "phase functions"),
        ("", "cloud.0.texture=\"by-box\"", "textured"),
        ("", "lighting.mode=\"none\"", "nothing is lit"),
        (
            "[[light]]\nkind = 'spot'\nposition = [0.0, 3.0, 0.0]\ndirection = [0.0, -1.0, 0.0]\n\
             intensity = [1.0, 1.0, 1.0]\nouter_deg = 85.0\n",
            "film.width=24",
            "spot lights so wide",
        ),
    ] {
        let scene = scene(dir.path(), more);
        let output = run(&["export", &scene, "--mitsuba", &out, "--set", set]);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{set}: {text}");
        assert!(text.contains(expected) && text.contains("expected"), "{set}: {text}");
        assert!(!Path::new(&out).join("scene.xml").exists(), "{set}");
    }
    let scene = scene(dir.path(), "");
    let output = run(&["export", &scene, "--mitsuba", &out, "--step", "0.0001"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && text.contains("--step"), "{text}");
    // An export takes no device.
    let output = run(&["export", &scene, "--mitsuba", &out, "--validation"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(!Path::new(&out).exists());
}

/// Layers have more numbers than a picture: they are refused before anything is allocated where the
/// picture alone would fit.
#[test]
fn layers_that_no_memory_holds_are_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let scene = scene(dir.path(), "");
    let picture = path(&dir, "layers.exr");
    let all = ["render", &scene, "--reference", "transport", "--layers", "-q", "-o", &picture];
    let output = run(&[&all[..], &["--size", "2000x1000", "--samples", "64"]].concat());
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("MiB") && text.contains("expected fewer pixels"), "{text}");
    assert!(!Path::new(&picture).exists());
}

/// The layers add up to the picture, which has the bytes of one without layers.
#[test]
fn layers_of_transport_add_up() {
    let dir = tempfile::tempdir().expect("a folder");
    let scene = scene(dir.path(), "");
    let (plain, layers) = (path(&dir, "plain.exr"), path(&dir, "layers.exr"));
    let of = |more: &[&str]| {
        let all = [&["render", &scene, "--reference", "transport", "--samples", "6", "-q"], more];
        let output = run(&all.concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    of(&["-o", &plain]);
    of(&["-o", &layers, "--layers"]);
    let read = |path: &str| {
        let read = exr::prelude::read_first_flat_layer_from_file(path).expect("an EXR");
        let list = read.layer_data.channel_data.list.into_iter();
        list.map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect::<Vec<f32>>()))
            .collect::<std::collections::BTreeMap<_, _>>()
    };
    let (plain, layers) = (read(&plain), read(&layers));
    assert_eq!(layers.len(), 25);
    for channel in ["R", "G", "B", "A"] {
        assert_eq!(plain[channel], layers[channel], "{channel}");
    }
    let mut n_lit = 0;
    for channel in ["R", "G", "B"] {
        for (k, all) in layers[channel].iter().enumerate() {
            let names = ["once_sun", "once_sky", "twice_sun", "twice_sky", "more_sun", "more_sky"];
            let parts = names.map(|name| layers[&format!("{name}.{channel}")][k]);
            let sum = parts.iter().sum::<f32>();
            assert!((sum - all).abs() <= 1e-6 * all.max(1e-3), "{channel} {k}: {sum} {all}");
            let error = layers[&format!("error.{channel}")][k];
            assert!(error >= 0.0 && error <= 1.001 * all, "{channel} {k}: {error} {all}");
            n_lit += usize::from(parts.iter().all(|part| *part > 0.0) && error > 0.0);
        }
    }
    assert!(n_lit > 20, "{n_lit}");
}
