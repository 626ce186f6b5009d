//! `nimbus error` and `nimbus ledger` as a user types them: what stands in the results' folder, and
//! what a study goes on from.

mod resumed;

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::tiny::{
    HEIGHT, N_PIXELS, OUT, SHORT, Table, Tiny, WIDTH, assert_valid, names, size, study,
};
use serde_json::{Value, json};

const TWO_KNOBS: [&str; 6] =
    ["--set", "draw.sort_bits=32", "--knob", "draw.cutoff=2,3", "--knob", "draw.sort_bits=16,32"];

/// The rounding of two ways to the same figure, by divisions and logarithms.
const ROUNDING: f64 = 1e-12;

fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * b.abs()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}

/// A picture's pixels.
fn pixels(tiny: &Tiny, name: &str) -> Vec<u8> {
    image::open(tiny.path(name)).expect(name).into_rgba8().into_raw()
}

#[test]
fn the_files_of_a_study_agree() {
    let tiny = Tiny::new();
    let budgets =
        ["--budget-ms=1e-9", "--budget-ms=1e9", "--budget-error=1e-9", "--budget-error=9"];
    let printed = tiny.good(&[&SHORT[..], &TWO_KNOBS, &OUT, &budgets, &["--json"]].concat());
    let json = tiny.json("out/study.json");
    assert_eq!(serde_json::from_str::<Value>(&printed).expect("JSON"), json);
    assert_valid(&json, "study.schema.json");
    assert_eq!(
        (&json["interrupted"], &json["rounds"], &json["frames"]),
        (&json!(false), &json!(2), &json!(1))
    );
    assert_eq!((&json["metric"], &json["time"]), (&json!("rmse"), &json!("frame")));
    assert_eq!(
        (&json["scene_file"], &json["reference"]["n_pixels"]),
        (&json!("scene.toml"), &json!(N_PIXELS))
    );
    // The scene's own values are the scene. The combinations depend on which values are faster on
    // this machine.
    assert_eq!(names(&json)[..3], ["as it stands", "draw.cutoff=2", "draw.sort_bits=16"]);
    assert!(
        names(&json)[3..]
            .iter()
            .all(|name| name.contains("draw.cutoff=2") && name.contains("draw.sort_bits=16"))
    );
    let base = &study(&json)[0];
    assert_eq!(base["by_base"], json!({ "value": 1.0, "low": 1.0, "high": 1.0 }));
    assert_eq!(base["settings"], json!([]));
    assert_eq!(base["hash"], json["scene_hash"]);
    assert!(study(&json).iter().any(|c| c["front"] == "on"), "someone is on the front");
    // The reference knows no sort; what is cut of a blob is an error.
    let rmse = |i: usize| study(&json)[i]["error"]["rmse"]["value"].as_f64().expect("an error");
    assert!(
        rmse(0) > 0.0 && rmse(1) > rmse(0) && rmse(2) == rmse(0),
        "{} {} {}",
        rmse(0),
        rmse(1),
        rmse(2)
    );
    check_times(&tiny, &json);
    check_pictures(&tiny, &json);
    check_best(&json);
    check_rows(&tiny, &json);
    // The other two ways to print it, of the same study: nothing is left to run.
    let times = tiny.text("out/times.csv");
    let again = [&SHORT[..], &TWO_KNOBS, &OUT, &budgets, &["--resume"]].concat();
    assert_eq!(tiny.good(&[&again[..], &["--csv"]].concat()), tiny.text("out/configurations.csv"));
    let printed = tiny.good(&again);
    let lines = [
        "within 0.000000001 ms: none of them",
        "within 1000000000 ms, the most exact: ",
        "9 of rmse, the fastest: ",
    ];
    assert!(lines.iter().all(|line| printed.contains(line)), "{printed}");
    assert_eq!(tiny.text("out/times.csv"), times);
}

/// The figures of times follow from times.csv: those of the unchanged scene are medians, those
/// of others medians of ratios to the turns of the scene just before and just after.
fn check_times(tiny: &Tiny, json: &Value) {
    let table = Table::of(&tiny.text("out/times.csv"));
    let turns: Vec<(usize, f64)> = table
        .rows
        .iter()
        .map(|row| {
            let at = |column: &str| table.number(row, column).expect(column);
            (at("configuration") as usize, at("frame_ms"))
        })
        .collect();
    let of = |i: usize| turns.iter().enumerate().filter(move |(_, turn)| turn.0 == i);
    let base = median(of(0).map(|(_, turn)| turn.1).collect());
    for (i, c) in study(json).iter().enumerate() {
        assert_eq!(c["n_turns"].as_u64(), Some(of(i).count() as u64));
        assert!(of(i).count() >= 2, "{i}");
        let ms = c["frame_ms"]["value"].as_f64().expect("a time");
        if i == 0 {
            assert!(is_near(ms, base), "{ms} {base}");
            continue;
        }
        let ratio = |(k, turn): (usize, &(usize, f64))| {
            let scenes = |(i, _): &&(usize, f64)| *i == 0;
            let before = turns[..k].iter().rev().find(scenes).expect("one before").1;
            let after = turns[k..].iter().find(scenes).expect("one after").1;
            turn.1 / (before * after).sqrt()
        };
        let by_base = median(of(i).map(ratio).collect());
        let said = c["by_base"]["value"].as_f64().expect("a ratio");
        assert!(
            is_near(said, by_base) && is_near(ms, by_base * base),
            "{i}: {said} {by_base} {ms}"
        );
    }
}

fn check_pictures(tiny: &Tiny, json: &Value) {
    assert_eq!(size(&tiny.path("out/reference.png")), (WIDTH, HEIGHT));
    for c in study(json) {
        for key in ["picture", "error_map"] {
            let file = tiny.path("out").join(c[key].as_str().expect(key));
            assert_eq!(size(&file), (WIDTH, HEIGHT), "{key}");
        }
    }
    // They are what `render` draws.
    for (i, more) in [(0, "draw.cutoff=3"), (1, "draw.cutoff=2")] {
        tiny.good(&["render", "scene.toml", "-q", "--force", "-o", "drawn.png", "--set", more]);
        let file = format!("out/picture-{i}.png");
        assert!(
            pixels(tiny, &file) == pixels(tiny, "drawn.png"),
            "{file} is not what is drawn with {more}"
        );
    }
    assert!(
        pixels(tiny, "out/picture-0.png") != pixels(tiny, "out/picture-1.png"),
        "two pictures that differ"
    );
}

/// Each budget's choice is the best of all configurations within it.
fn check_best(json: &Value) {
    let figure = |c: &Value, keys: [&str; 2]| c[keys[0]][keys[1]].as_f64();
    let ms = |c: &Value| figure(c, ["frame_ms", "value"]).expect("a time");
    let rmse = |c: &Value| c["error"]["rmse"]["value"].as_f64().expect("an error");
    let best: Vec<(&Value, &Value)> = json["best"]
        .as_array()
        .expect("budgets")
        .iter()
        .map(|b| (&b["budget"], &b["configuration"]))
        .collect();
    assert_eq!(best.len(), 4);
    let all = study(json);
    // Of equally exact ones the faster.
    let least = all.iter().map(rmse).fold(f64::INFINITY, f64::min);
    let exact = all.iter().filter(|c| rmse(c) == least).map(ms).fold(f64::INFINITY, f64::min);
    let fastest = all.iter().map(ms).fold(f64::INFINITY, f64::min);
    let at = |time: f64| json!(all.iter().position(|c| ms(c) == time));
    assert_eq!(best[0], (&json!("ms"), &Value::Null));
    assert_eq!(best[1], (&json!("ms"), &at(exact)));
    assert_eq!(best[2], (&json!("error"), &Value::Null));
    assert_eq!(best[3], (&json!("error"), &at(fastest)));
}

/// configurations.csv says what study.json says.
fn check_rows(tiny: &Tiny, json: &Value) {
    let table = Table::of(&tiny.text("out/configurations.csv"));
    assert_eq!(table.rows.len(), study(json).len());
    for (row, c) in table.rows.iter().zip(study(json)) {
        assert_eq!(table.text(row, "name"), c["name"]);
        assert_eq!(table.text(row, "front"), c["front"]);
        for (column, figure) in [
            ("gpu_ms", &c["gpu_ms"]),
            ("frame_ms", &c["frame_ms"]),
            ("by_base", &c["by_base"]),
            ("rmse", &c["error"]["rmse"]),
        ] {
            for (ending, key) in [("", "value"), ("_low", "low"), ("_high", "high")] {
                let column = format!("{column}{ending}");
                assert_eq!(table.number(row, &column), figure[key].as_f64(), "{column}");
            }
        }
        assert_eq!(table.number(row, "max"), c["error"]["max"].as_f64());
        assert_eq!(table.number(row, "relmse"), c["error"]["relmse"].as_f64());
        assert_eq!(
            table.number(row, "turns").map(|n| json!(n as u64)).as_ref(),
            Some(&c["n_turns"])
        );
    }
}

/// The error of a study is the one that `compare` finds between the picture and the reference, each
/// drawn alone.
#[test]
fn the_error_of_a_study_is_that_of_compare() {
    let tiny = Tiny::new();
    let unlit = ["--set", "lighting.mode=\"none\""];
    tiny.good(
        &[&SHORT[..], &OUT, &unlit, &["--against=volume", "--knob", "draw.cutoff=2"]].concat(),
    );
    tiny.good(
        &[&["render", "scene.toml", "-q", "-o", "volume.exr", "--reference=volume"], &unlit[..]]
            .concat(),
    );
    let json = tiny.json("out/study.json");
    assert_valid(&json, "study.schema.json");
    for (c, cutoff) in study(&json).iter().zip(["3", "2"]) {
        let set = format!("draw.cutoff={cutoff}");
        tiny.good(
            &[
                &["render", "scene.toml", "-q", "--force", "-o", "drawn.exr", "--set", &set],
                &unlit[..],
            ]
            .concat(),
        );
        let found: Value =
            serde_json::from_str(&tiny.good(&["compare", "volume.exr", "drawn.exr", "--json"]))
                .expect("JSON");
        for (ours, theirs) in [(&c["error"]["rmse"]["value"], "rmse"), (&c["error"]["max"], "max")]
        {
            let (ours, theirs) =
                (ours.as_f64().expect("ours"), found["metrics"][theirs].as_f64().expect("theirs"));
            // The reference as f32 in a file: half of 2⁻²³ of values of at most 1.
            assert!(ours > 1e-3 && (ours - theirs).abs() <= 6e-8, "{set}: {ours} {theirs}");
        }
    }
}

#[test]
fn a_grid_has_all_combinations() {
    let tiny = Tiny::new();
    let json: Value =
        serde_json::from_str(&tiny.good(&[&SHORT[..], &TWO_KNOBS, &["--grid", "--json"]].concat()))
            .expect("JSON");
    let all = [
        "as it stands",
        "draw.cutoff=2, draw.sort_bits=16",
        "draw.cutoff=2, draw.sort_bits=32",
        "draw.cutoff=3, draw.sort_bits=16",
    ];
    assert_eq!(names(&json), all);
    // No folder, no pictures in it.
    assert!(study(&json).iter().all(|c| c["picture"].is_null() && c["error_map"].is_null()));
    assert_valid(&json, "study.schema.json");
}

/// A value that the scene has already is found in the table.
#[test]
fn the_unchanged_scene_is_named_by_its_own_values() {
    let tiny = Tiny::new();
    let knobs = ["--knob", "draw.cutoff=2,3", "--knob", "lighting.grid=8,16"];
    let printed = tiny.good(&[&SHORT[..], &knobs, &["--budget-ms=1e9"]].concat());
    let name = "as it stands (draw.cutoff=3, lighting.grid=8)";
    assert_eq!(printed.matches(name).count(), printed.matches("as it stands").count());
    assert!(printed.contains(name), "{printed}");
}

#[test]
fn a_ledger_sums_up() {
    let more =
        "[[surface]]\ncenter = [0, -3, 0]\nu = [0, 0, 3]\nv = [2.7, 0, 0]\nsubdivide = [2, 2]\n";
    let tiny = Tiny::with(&format!("texture = \"0\"\n{more}"));
    let args = [
        "ledger",
        "scene.toml",
        "-q",
        "--plain",
        "--pixels=40",
        "--rounds=2",
        "--frames=1",
        "--reflections=2",
        "--out=out",
    ];
    let printed = tiny.good(&[&args[..], &["--json"]].concat());
    let json = tiny.json("out/ledger.json");
    assert_eq!(serde_json::from_str::<Value>(&printed).expect("JSON"), json);
    assert_valid(&json, "ledger.schema.json");
    let rows = json["rows"].as_array().expect("rows");
    let names: Vec<&str> = rows.iter().map(|row| row["name"].as_str().expect("a name")).collect();
    let all = [
        "sort bits",
        "cutoff",
        "drawing",
        "thin sprites",
        "first reflection",
        "density grid",
        "facets of surfaces",
        "reflections",
        "model",
    ];
    assert_eq!(names, all);
    let number = |value: &Value| value.as_f64().expect("a number");
    let errors: Vec<f64> = rows.iter().map(|row| number(&row["error"]["value"])).collect();
    let (sum, total) = (number(&json["sum"]), number(&json["total"]["value"]));
    // The same sums in the same order.
    let quadrature = errors.iter().map(|error| error.powi(2)).sum::<f64>().sqrt();
    assert_eq!((sum, number(&json["quadrature"])), (errors.iter().sum(), quadrature));
    assert!(
        total <= sum && total > 0.0 && json["holds"] == true && json["interrupted"] == false,
        "{total} {sum}"
    );
    for row in rows {
        let error = number(&row["error"]["value"]);
        assert!(is_near(number(&row["share"]), error / sum), "{row}");
        assert!(is_near(number(&row["relative"]), error / number(&json["magnitude"])), "{row}");
        assert_eq!(row["is_resolved"], json!(10.0 * number(&row["own_error"]) <= error), "{row}");
        // Both of the device's are timed; the others it does not draw.
        assert_eq!(
            row["time_ratio"].is_object(),
            row["name"] == "cutoff" || row["name"] == "sort bits",
            "{row}"
        );
    }
    assert_eq!((&rows[1]["from"], &rows[1]["to"]), (&json!("3 sigma"), &json!("8 sigma")));
    assert_eq!(tiny.refused(&args), "out: exists; --force replaces it");
    let loud: Vec<&str> = args.iter().copied().filter(|arg| *arg != "-q").collect();
    let output = tiny.run(&[&loud[..], &["--force"]].concat());
    let [printed, said] =
        [output.stdout, output.stderr].map(|b| String::from_utf8(b).expect("UTF-8"));
    assert!(
        all.iter().all(|name| printed.contains(name)) && printed.contains("the rows sum to"),
        "{printed}"
    );
    assert!(
        said.starts_with("the pictures in f64 take about ")
            && said.ends_with("wrote out: 3 files, listed in ledger.sha256\n"),
        "{said}"
    );
}
