//! References of the model itself on scenes whose pictures are known: one blob and one floor by
//! hand, and a furnace. Light by the density grid converges to the closed form as cells shrink.

use std::f64::consts::{FRAC_1_PI, PI};
use std::fs;

use nimbus::io::scene_file::load;
use nimbus::model::scene::Scene;
use nimbus::reference::picture::{
    Emitters, FrameReference, Pixels, Reference, ReferenceKind, pixel_shares,
};

fn scene(text: &str, points: &str) -> Scene {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("points.csv"), points).unwrap();
    fs::write(dir.path().join("scene.toml"), text).unwrap();
    load(&dir.path().join("scene.toml"), &[], None).unwrap().scene
}

fn reference(scene: &Scene, against: &str) -> Reference {
    let pixels = Pixels::all(scene.film.width, scene.film.height);
    against.parse::<ReferenceKind>().unwrap().render(scene, 0.0, &pixels, &|_, _| ()).unwrap()
}

/// One pixel that looks along -z at the origin.
const FILM: &str = "film = { width = 1, height = 1 }\ncamera = { position = [0, 0, 10], target = \
    [0, 0, 0], fov_y_deg = 1 }\n";
const ONE: &str = "x,y,z,sigma,kappa\n0,0,0,0.5,1.2\n";

#[test]
fn a_blob_by_hand() {
    // The density has no direction at the blob's centre, so its facet faces up from 1.5 sigma above
    // it. Light from straight above passes the part above: half a line less the part up to 1.5
    // sigma, tau = sqrt(2 pi) kappa sigma (1 - Phi(1.5)), of which 1 - g counts. E = 2, K_d = 0.8:
    // L = 0.8/pi 2 e^(-(1 - g) tau).
    let light = "[lighting]\nmode = \"first\"\nforward = 0.25\n[[light]]\nkind \
        = \"directional\"\ndirection = [0, -1, 0]\nirradiance = [2, 2, 2]\n";
    let text = format!(
        "{FILM}{light}[[material]]\nname = \"m\"\nkd = [0.8, 0.8, 0.8]\n[[cloud]]\nfrom \
         = \"particles\"\nfile = \"points.csv\"\n"
    );
    let whole = (2.0 * PI).sqrt() * 1.2 * 0.5;
    // 1 - Phi(1.5) = 0.06680720126885807.
    let radiance = 0.8 * FRAC_1_PI * 2.0 * (-0.75 * whole * 0.066_807_201_268_858_07f64).exp();
    // The eye's ray passes the centre: the whole tau.
    let alpha = 1.0 - (-whole).exp();
    for against in ["model", "reflections=1", "reflections=3"] {
        let found = reference(&scene(&text, ONE), against);
        let [r, _, _, a] = found.rgba[0];
        assert!(
            (a - alpha).abs() < 1e-6 && (r - radiance * alpha).abs() < 1e-6,
            "{against}: {found:?}"
        );
        assert!(found.own_error < 3e-6);
    }
}

#[test]
fn a_floor_by_hand_at_the_pixel_and_not_at_its_facets() {
    // A wall of one facet that faces the eye, a lamp a quarter of its width beside the middle and
    // one before it. At the pixel d = (1, 0, 1), |d|^2 = 2, cos = 1/sqrt 2, so L = K_d/pi I/2/sqrt
    // 2. Between facets it is the light of the facet's middle.
    let text = |eye: f64| {
        format!(
            "film = {{ width = 1, height = 1 }}\ncamera = {{ position = [{eye}, 0, 10], target = \
             [{eye}, 0, 0], fov_y_deg = 1 }}\n\
             [lighting]\nmode = \"first\"\n[[light]]\nkind = \"point\"\nposition = [0, 0, \
             1]\nintensity = [4, 4, 4]\n\
             [[material]]\nname = \"m\"\nkd = [0.5, 0.5, 0.5]\n\
             [[surface]]\ncenter = [0, 0, 0]\nu = [2, 0, 0]\nv = [0, 2, 0]\nmaterial \
             = \"m\"\nsubdivide = [1, 1]\n"
        )
    };
    let at = |eye: f64, against: &str| reference(&scene(&text(eye), ONE), against).rgba[0];
    let [near, aside] = [0.5 * FRAC_1_PI * 4.0, 0.5 * FRAC_1_PI * 4.0 / 2.0 / 2f64.sqrt()];
    assert!(
        (at(0.0, "model")[0] - near).abs() < 1e-9 && (at(1.0, "model")[0] - aside).abs() < 1e-9
    );
    assert!((at(1.0, "volume")[0] - near).abs() < 1e-9 && at(1.0, "volume")[3] == 1.0);
}

#[test]
fn in_a_furnace_every_reflection_is_the_albedo_of_the_one_before() {
    // Six inner walls of K_d = 0.6 under a sky whose constant share comes from everywhere, E = 1.
    // L1 = 0.6/pi at every point, so each further reflection is 0.6 of the previous one.
    let mut text = "film = { width = 2, height = 1 }\ncamera = { position = [0.2, 0.1, 0.5], \
        target = [0, -0.3, -1], fov_y_deg = 40 }\n\
        [lighting]\nmode = \"two-reflection\"\n[[light]]\nkind = \"sky\"\nirradiance = [1, 1, \
        1]\nconstant = 1.0\n\
        [[material]]\nname = \"m\"\nkd = [0.6, 0.6, 0.6]\n"
        .to_owned();
    let axes = ["[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]"];
    for (i, center) in ["-1", "1"].iter().flat_map(|c| [(0, *c), (1, *c), (2, *c)]) {
        let (mut place, [mut u, mut v]) = (["0"; 3], [axes[(i + 1) % 3], axes[(i + 2) % 3]]);
        place[i] = center;
        // u × v points inward.
        if center == "1" {
            (u, v) = (v, u);
        }
        text += &format!(
            "[[surface]]\ncenter = [{}]\nu = {u}\nv = {v}\nmaterial = \"m\"\nsubdivide = [2, 2]\n",
            place.join(", ")
        );
    }
    let scene = scene(&text, ONE);
    let first = 0.6 * FRAC_1_PI;
    for (against, sum) in [
        ("reflections=1", 1.0),
        ("model", 1.6),
        ("reflections=2", 1.6),
        ("reflections=4", 1.0 + 0.6 + 0.36 + 0.216),
    ] {
        let found = reference(&scene, against);
        for pixel in &found.rgba {
            // Every path finds the same light, so that only rounding is left.
            assert!(
                (pixel[0] / (first * sum) - 1.0).abs() < 1e-3 && pixel[3] == 1.0,
                "{against}: {found:?}"
            );
            assert!(
                (pixel[0] - first * sum).abs() <= 4.0 * found.own_error + 1e-9,
                "{against}: {found:?}"
            );
        }
    }
}

#[test]
fn light_through_a_finer_grid_comes_nearer_to_the_closed_form() {
    let points = "x,y,z,sigma,kappa\n0,0,0,0.6,1.5\n0.9,0.5,0.2,0.5,2\n\
                  -0.8,0.3,-0.4,0.55,1\n0.2,-0.8,0.3,0.4,3\n";
    let rmse = |grid: u32| {
        let light = format!(
            "[lighting]\nmode = \"first\"\nforward = 0.0\nstep = 0.5\ngrid = {grid}\n\
             [[light]]\nkind = \"directional\"\ndirection = [-0.5, -1, -0.3]\n\
             irradiance = [3, 3, 3]\n"
        );
        let film = FILM
            .replace("width = 1, height = 1", "width = 24, height = 18")
            .replace("fov_y_deg = 1 ", "fov_y_deg = 24 ");
        let text = format!("{film}{light}[[cloud]]\nfrom = \"particles\"\nfile = \"points.csv\"\n");
        let scene = scene(&text, points);
        let (grid, model) = (reference(&scene, "volume"), reference(&scene, "model"));
        let squares = grid
            .rgba
            .iter()
            .flatten()
            .zip(model.rgba.iter().flatten())
            .map(|(a, b)| (a - b) * (a - b));
        (squares.sum::<f64>() / (4 * 24 * 18) as f64).sqrt()
    };
    // The deposit averages over cells and the march interpolates between them. The error falls with
    // the square of a cell's width, down to the deposit's cut at 3 sigma (0.27 % of a blob's mass).
    let found = [8, 16, 32].map(rmse);
    assert!(found[0] > 2.5 * found[1] && found[1] > 2.0 * found[2] && found[2] > 0.0, "{found:?}");
    assert!(found[2] < 5e-3, "{found:?}");
}

#[test]
fn a_picture_is_the_sum_of_its_facets_shares() {
    for (file, n_pixels) in [("hello", 300), ("study-light", 300), ("static", 300), ("puff", 60)] {
        let path = format!("scenes/{file}.toml");
        let scene = load(path.as_ref(), &["lighting.grid=16".to_owned()], None).unwrap().scene;
        let scene = &ReferenceKind::Thin.without_approximations(&scene);
        let pixels = Pixels::sample(scene.film.width, scene.film.height, n_pixels);
        let drawn = ReferenceKind::Thin.render(scene, 0.0, &pixels, &|_, _| ()).unwrap().rgba;
        let frame = FrameReference::new(scene, 0.0).unwrap();
        let radiance = Emitters::radiance(scene, &frame);
        let shares = pixel_shares(scene, &frame, &Emitters::new(scene, &frame), &pixels);
        for (k, (drawn, shares)) in drawn.iter().zip(&shares).enumerate() {
            let summed = shares.color(&radiance);
            let off = (0..4).map(|i| (drawn[i] - summed[i]).abs()).fold(0.0, f64::max);
            // Some hundred layers of f64.
            assert!(off < 1e-12, "{file}, pixel {k}: {drawn:?} {summed:?}");
        }
        assert!(shares.iter().any(|s| s.of.len() > 3), "{file}");
    }
}
