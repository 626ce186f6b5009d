//! `draw.resolution`: whole frames drawn in a smaller size against the f64 picture at full size;
//! over surfaces; the same bytes in every mode; and "auto", which takes one and says which.

#[path = "harness/program.rs"]
mod program;

use program::{differ, path, run};

/// Renders to `name` in `dir` and gives what was said on stderr.
fn render(dir: &tempfile::TempDir, name: &str, args: &[&str]) -> String {
    let out = path(dir, name);
    let output = run(&[&["render", "--force", "-o", &out], args].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{args:?}: {said}");
    said
}

/// 300 thin Gaussians, seen by 160 × 120 pixels with a sigma of about 3.6 of them.
fn gaussians(dir: &tempfile::TempDir) -> String {
    let mut list = String::from("x,y,z,radius,kappa,r,g,b\n");
    let mut state = 3u64;
    let mut uniform = |low: f64, high: f64| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (state >> 11) as f64 / (1u64 << 53) as f64
    };
    for _ in 0..300 {
        let (x, y, z) = (uniform(-5.0, 5.0), uniform(-4.0, 4.0), uniform(-0.5, 0.5));
        let [r, g, b] = [uniform(0.2, 1.0), uniform(0.2, 1.0), uniform(0.2, 1.0)];
        list += &format!("{x},{y},{z},0.9,0.133,{r},{g},{b}\n");
    }
    std::fs::write(dir.path().join("list.csv"), list).expect("written");
    let scene = "[film]\nwidth = 160\nheight = 120\nformat = \"rgba32f\"\nbackground = [0.0, 0.0, \
        0.0]\n\
                 [camera]\nposition = [0.0, 0.0, 12.0]\n[lighting]\nmode \
                 = \"none\"\n[[material]]\nname = \"white\"\n\
                 [[cloud]]\nfrom = \"particles\"\nfile = \"list.csv\"\nmaterial = \"white\"\n";
    std::fs::write(dir.path().join("scene.toml"), scene).expect("written");
    path(dir, "scene.toml")
}

#[test]
fn a_smaller_picture_stays_near_the_truth_at_full_size() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let scene = gaussians(&dir);
    render(&dir, "thin.exr", &[&scene, "--reference", "thin"]);
    for draw in ["draw.path=\"sprites\"", "draw.path=\"tiles\""] {
        // A quarter of a step of 8 bits; and one step, with sigmas of less than a small pixel. An
        // edge changes 1 + Λ² = 2.93 times its step, 0.1 e^{−4.5} = 1.1e-3, and here some ten of
        // them cross a pixel's taps at most.
        for (resolution, rmse_most, max_most) in [
            ("draw.resolution=0.5", 1.0 / 1020.0, 0.01),
            ("draw.resolution=0.25", 1.0 / 255.0, 0.05),
        ] {
            render(&dir, "drawn.exr", &[&scene, "--set", draw, "--set", resolution]);
            let (rmse, max) = differ(&dir, "thin.exr", "drawn.exr");
            println!("{draw}, {resolution}: RMSE {rmse:.2e}, greatest {max:.2e}");
            assert!(
                rmse <= rmse_most && max <= max_most,
                "{draw}, {resolution}: RMSE {rmse:e}, greatest {max:e}"
            );
            // It is another picture than the one at full size.
            assert!(rmse > 1e-5, "{draw}, {resolution}: RMSE {rmse:e}");
        }
    }
}

#[test]
fn surfaces_stay_sharp_and_hide() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let scene = ["scenes/ground.toml", "--size", "160x120", "--set", "film.format=\"rgba32f\""];
    let none = "cloud.0.texture=\"none\"";
    for draw in ["draw.path=\"sprites\"", "draw.path=\"tiles\""] {
        let of = |name: &str, resolution: &str| {
            render(
                &dir,
                name,
                &[&scene[..], &["--set", none, "--set", draw, "--set", resolution]].concat(),
            );
        };
        of("full.exr", "draw.resolution=1");
        of("half.exr", "draw.resolution=0.5");
        let (rmse, max) = differ(&dir, "full.exr", "half.exr");
        println!("{draw}: RMSE {rmse:.2e}, greatest {max:.2e}");
        // Edges of surfaces that were mixed with what lies beside them would be off by their
        // contrast.
        assert!(rmse <= 6e-3, "{draw}: RMSE {rmse:e}, greatest {max:e}");
        assert!(rmse > 0.0);
    }
}

#[test]
fn auto_takes_what_the_error_allows_and_says_so() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let scene = gaussians(&dir);
    let auto = |name: &str, error: &str| {
        render(
            &dir,
            name,
            &[&scene, "--set", "draw.resolution=\"auto\"", "--set", &format!("draw.error={error}")],
        )
    };
    let said = auto("exact.exr", "0");
    let of_all = ["took 1.0", "1.0 takes", "0.5 takes", "0.25 takes", "RMSE"];
    assert!(of_all.iter().all(|text| said.contains(text)), "{said}");
    render(&dir, "full.exr", &[&scene]);
    let bytes = |name: &str| std::fs::read(dir.path().join(name)).expect("a picture");
    assert!(bytes("exact.exr") == bytes("full.exr"));
    // Whichever was the fastest is drawn, with the path that it was drawn by.
    let both = [
        "--set",
        "draw.path=\"auto\"",
        "--set",
        "draw.resolution=\"auto\"",
        "--set",
        "draw.error=0.9",
    ];
    let said = render(&dir, "auto.exr", &[&[scene.as_str()], &both[..]].concat());
    let named = |key: &str| -> String {
        let text = said
            .split(&format!("draw.{key} = \"auto\" took "))
            .nth(1)
            .unwrap_or_else(|| panic!("{said}"));
        text.split([':', ' ']).next().expect("a value").to_owned()
    };
    let (path_set, size_set) = (
        format!("draw.path={}", named("path")),
        format!("draw.resolution={}", named("resolution")),
    );
    render(&dir, "named.exr", &[&scene, "--set", &path_set, "--set", &size_set]);
    assert!(bytes("auto.exr") == bytes("named.exr"), "{path_set} {size_set}");
}

#[test]
fn values_that_are_none_are_refused() {
    for (set, message) in [
        ("draw.resolution=0.75", "expected 1.0, 0.5, 0.25 or \"auto\", found float 0.75"),
        ("draw.resolution=\"half\"", "expected 1.0, 0.5, 0.25 or \"auto\""),
        ("draw.error=-1", "`draw.error`: expected a number from 0 to below 1"),
    ] {
        let output = run(&["render", "scenes/hello.toml", "--set", set, "-o", "/nowhere/x.exr"]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains(message), "{set}: {said}");
    }
}
