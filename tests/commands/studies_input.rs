//! Input that `nimbus error` and `nimbus ledger` refuse, and their messages; clouds drawn plain;
//! references that are kept.

use std::fs;

use crate::tiny::{OUT, SHORT, Tiny, study};
use serde_json::{Value, json};

#[test]
fn faulty_arguments_are_refused_before_any_work() {
    let tiny = Tiny::new();
    let knobs: [(&[&str], &str); 18] = [
        (
            &["draw.cutoff"],
            "--knob draw.cutoff: no `=`; expected KEY=VALUE,VALUE,… such as draw.cutoff=2,3,4",
        ),
        (
            &["draw.cutoff="],
            "--knob draw.cutoff=: an empty value; expected KEY=VALUE,VALUE,… such as \
             draw.cutoff=2,3,4",
        ),
        (&["draw.cutoff=2,,3"], "--knob draw.cutoff=2,,3: an empty value; expected"),
        (&["=2"], "--knob =2: no key; expected"),
        (&["draw.cutoff=2,2"], "--knob draw.cutoff=2,2: 2 twice; expected"),
        (
            &["draw.cutoff=2", "draw.cutoff=4"],
            "--knob draw.cutoff: the key twice; name all its values in one",
        ),
        (
            &["draw.cutof=2"],
            "--knob draw.cutof=2: unknown key `draw.cutof`; did you mean `cutoff`?",
        ),
        (
            &["draw.cutoff=2,99"],
            "--knob draw.cutoff=99: `draw.cutoff`: expected a number from 0.5 to 8 or \"auto\", found \
             integer 99",
        ),
        (&["draw.path=pen"], "--knob draw.path=pen: `draw.path`: unknown value `pen`; known here:"),
        (
            &["cloud.3.seed=1"],
            "--knob cloud.3.seed: is no knob: this key changes what the picture shows, and not how \
             the picture is computed; a cloud's knobs are `particles` and `gust_waves`",
        ),
        (
            &["cloud.3.gust_waves=1"],
            "--knob cloud.3.gust_waves=1: `cloud.3` does not exist: `cloud` has 1 item",
        ),
        (
            &["surface.0.center=[0,0,0]"],
            "--knob surface.0.center: is no knob: this key changes what the picture shows, and not",
        ),
        (
            &["air.humidity=0.5"],
            "--knob air.humidity: is no knob: a knob changes how the picture is computed, and this \
             key changes what the picture shows, or nothing that is compared; `nimbus error SCENE` \
             without --knob varies all knobs of the scene",
        ),
        (
            &["size=8x8"],
            "--knob size: pictures of several sizes cannot be compared with one reference",
        ),
        (
            &["film.width=24,32"],
            "--knob film.width=32: pictures of several sizes cannot be compared with one reference",
        ),
        (
            &["film={ width = 8 }"],
            "--knob film={ width = 8 }: pictures of several sizes cannot be compared",
        ),
        (
            &["time.step_s=1"],
            "--knob time.step_s: changes no picture, or which picture it is; expected a \
             key of film,",
        ),
        (
            &["camera={ position = [0, 0, 5] }"],
            "--knob camera: changes no picture, or which picture it is; expected",
        ),
    ];
    for (keys, expected) in knobs {
        let knobs: Vec<&str> = keys.iter().flat_map(|key| ["--knob", key]).collect();
        let message = tiny.refused(&[&SHORT[..], &OUT, &knobs].concat());
        assert!(message.starts_with(expected), "{keys:?}: {message}");
    }
    let textured = "cloud.0.texture=\"0\"";
    let others: [(&[&str], &str); 7] = [
        (
            &["error", "scene.toml", "--pixels=0"],
            "invalid value '0' for '--pixels <N>': expected a number of pixels above 0, or \
             all, found \"0\"",
        ),
        (
            &["error", "scene.toml", "--against=nonsense"],
            "invalid value 'nonsense' for '--against <WHAT>': expected thin, slices, volume, \
             model, reflections=K with K from 1 to 64, or transport, found \"nonsense\"",
        ),
        (
            &["error", "scene.toml", "--against=reflections=2", "--set", "lighting.mode=\"none\""],
            "reflections=2: nothing reflects where lighting.mode is \"none\"; expected thin, \
             volume or model",
        ),
        (
            &["error", "scene.toml", "--set", textured],
            "cloud 0 is textured, and the volume reference has plain blobs only; expected \
             --set \
             'cloud.0.texture=\"none\"', or --plain for all clouds, or --against thin",
        ),
        (
            &["ledger", "scene.toml", "--set", textured],
            "cloud 0 is textured, and the volume reference has plain blobs only; expected \
             --set \
             'cloud.0.texture=\"none\"', or --plain for all clouds",
        ),
        (
            &["ledger", "scene.toml", "--frame=4294967295", "--set", "time.step_s=1e9"],
            "time 4.294967295e18 s: expected a finite number from -1e15 to 1e15",
        ),
        (&["error", "none.toml"], "none.toml: no such file"),
    ];
    for (args, expected) in others {
        let message = tiny.refused(&[args, &OUT].concat());
        assert!(message.starts_with(expected), "{args:?}: {message}");
    }
    assert!(
        !tiny.path("out").exists() && tiny.kept().is_empty(),
        "nothing is written, and no reference computed"
    );
}

#[test]
fn plain_removes_textures() {
    let textured = Tiny::with("texture = \"0\"\n");
    let same = [
        "error",
        "--json",
        "-q",
        "--rounds=1",
        "--frames=1",
        "--knob",
        "draw.cutoff=2",
        "scene.toml",
    ];
    let error = |tiny: &Tiny, more: &[&str]| {
        let json: Value =
            serde_json::from_str(&tiny.good(&[&same[..], more].concat())).expect("JSON");
        (study(&json)[0]["error"].clone(), json["reference"]["hash"].clone())
    };
    let plain = error(&textured, &["--plain"]);
    // It is the scene that never had any; and not the one with.
    assert_eq!(plain, error(&Tiny::new(), &[]));
    assert_ne!(error(&textured, &["--against=thin"]).0, error(&Tiny::new(), &["--against=thin"]).0);
}

#[test]
fn a_reference_is_cached_and_a_damaged_one_computed_again() {
    let tiny = Tiny::new();
    let run = |more: &[&str]| -> (Value, Value) {
        let args = [&SHORT[..], &["--json", "--grid", "--knob", "draw.cutoff=2"], more].concat();
        let mut json: Value = serde_json::from_str(&tiny.good(&args)).expect("JSON");
        let errors = study(&json).iter().map(|c| c["error"].clone()).collect();
        (json["reference"].take(), errors)
    };
    let (first, errors) = run(&[]);
    assert_eq!((&first["from_cache"], tiny.kept().len()), (&json!(false), 1));
    let (second, same) = run(&[]);
    assert_eq!(
        (&second["from_cache"], &second["hash"], &same),
        (&json!(true), &first["hash"], &errors)
    );
    // A kept reference has its own key; only keys that affect it change the key.
    assert_eq!(
        (&second["own_error"], &second["seconds"]),
        (&first["own_error"], &first["seconds"])
    );
    assert_eq!(run(&["--set", "draw.sort_bits=16"]).0["from_cache"], json!(true));
    let (other, _) = run(&["--set", "cloud.0.position=[0.5,0,0]"]);
    assert!(
        other["from_cache"] == false && other["hash"] != first["hash"] && tiny.kept().len() == 2
    );
    // Cut off.
    let name = format!("{}.f64", first["hash"].as_str().expect("a hash"));
    let file = tiny.path("cache/references").join(name);
    let whole = fs::read(&file).expect("what is kept");
    fs::write(&file, &whole[..whole.len() - 8]).expect("a shorter file");
    let (third, same) = run(&[]);
    assert_eq!(
        (&third["from_cache"], &third["hash"], &same),
        (&json!(false), &first["hash"], &errors)
    );
    // Whole again.
    assert_eq!(run(&[]).0["from_cache"], json!(true));
}
