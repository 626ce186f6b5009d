//! Characters that a terminal would obey never reach it, wherever they come from.

use nimbus::io::plain_text::is_harmful;
use proptest::prelude::*;
use serde_json::Value;

use crate::generated;
use crate::program::{path, run};

/// Text with escape sequences, bells, returns, C1 codes and marks of direction.
fn hostile() -> impl Strategy<Value = String> {
    let piece = prop::sample::select(vec![
        "\u{1b}[31m",
        "\u{1b}]0;title\u{7}",
        "\u{9b}2J",
        "\u{7}",
        "\r",
        "\u{8}",
        "\u{202e}",
        "\u{2066}",
        "\u{200f}",
        "\u{85}",
        "\u{7f}",
        "a",
        "ä",
        "/",
        " ",
        "\u{1b}c",
        "\u{feff}",
    ]);
    prop::collection::vec(piece, 1..8).prop_map(|pieces| pieces.concat())
}

/// Returns everything that a run of nimbus prints, and its exit code.
fn printed(args: &[&str]) -> (Option<i32>, String, String) {
    let output = run(args);
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn assert_plain(args: &[&str]) -> (Option<i32>, String) {
    let (code, stdout, stderr) = printed(args);
    for text in [&stdout, &stderr] {
        let harmful = text.chars().find(|c| *c != '\n' && is_harmful(*c));
        assert_eq!(harmful, None, "{args:?}: {text:?}");
    }
    (code, stdout)
}

#[test]
fn arguments_scenes_and_results_are_printed_plain() {
    generated::check(8, hostile(), |evil| {
        let dir = tempfile::tempdir().expect("a folder");
        let out = path(&dir, "a.png");
        // Names of files, settings and devices.
        let scene = format!("scenes/{evil}.toml");
        assert_plain(&["render", &scene, "-o", &out]);
        assert_plain(&["render", "scenes/hello.toml", "-o", &out, "--device", &evil]);
        assert_plain(&["render", "scenes/hello.toml", "-o", &out, "--set", &evil]);
        let key = format!("film.{evil}=1");
        assert_plain(&["render", "scenes/hello.toml", "-o", &out, "--set", &key]);
        assert_plain(&["weather", &evil]);
        assert_plain(&["stress", &evil]);
        assert_plain(&["report", &evil, "-o", &path(&dir, "a.html")]);
        // A scene whose names are hostile, and results of it.
        let text = std::fs::read_to_string("scenes/hello.toml").expect("the scene");
        let csv = std::fs::read("scenes/hello.csv").expect("the list");
        std::fs::write(dir.path().join("hello.csv"), csv).expect("a file");
        let title = Value::String(evil.clone()).to_string().replace('\u{7f}', "\\u007f");
        let text = text.replace("title = \"Hello, cloud\"", &format!("title = {title}"));
        let scene = path(&dir, "s.toml");
        std::fs::write(&scene, text).expect("a scene");
        let results = path(&dir, "r");
        let (code, json) = assert_plain(&[
            "bench",
            &scene,
            "--size",
            "16x12",
            "--frames",
            "2",
            "--warmup",
            "0",
            "--repeat",
            "1",
            "--set",
            "cloud.0.texture=\"none\"",
            "--out",
            &results,
            "--json",
        ]);
        prop_assert_eq!(code, Some(0));
        let run: Value = serde_json::from_str(&json).expect("JSON");
        prop_assert_eq!(&run["scene"]["title"], &evil);
        // The results as somebody else may have written them.
        let file = dir.path().join("r/run.json");
        let mut run = run;
        run["device"]["name"] = evil.clone().into();
        run["cpu"]["model"] = evil.clone().into();
        run["date"] = evil.clone().into();
        std::fs::write(&file, serde_json::to_string(&run).expect("JSON")).expect("a file");
        assert_plain(&["compare", &results, &results]);
        let (_, json) = assert_plain(&["compare", &results, &results, "--json"]);
        if !json.is_empty() {
            serde_json::from_str::<Value>(&json).expect("JSON");
        }
        let page = path(&dir, "a.html");
        assert_plain(&["report", &results, "-o", &page]);
        if let Ok(html) = std::fs::read_to_string(&page) {
            prop_assert!(!html.chars().any(|c| c != '\n' && c != '\t' && is_harmful(c)));
        }
        Ok(())
    });
}
