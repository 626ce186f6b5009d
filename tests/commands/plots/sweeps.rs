//! Charts of sweeps: ticks as typed, lines, panels, and notes on what they lack.

use nimbus::measure::figure::Figure;
use nimbus::measure::stats::Summary;
use nimbus::report::charts::Chart;
use nimbus::report::charts::sweep::{
    SweepChart, SweptFigure, charts, charts_of_run, charts_of_study,
};
use nimbus::studies::error::front::Front;
use nimbus::timing::names::Setting;
use nimbus::timing::records::{Case, Measured, Mode, Run};
use proptest::prelude::*;
use serde_json::json;

use super::passes::pass;
use crate::studies::{configuration, study};
use crate::svg::{draw, elements, parse, text, tooltips};
use crate::{generated, results};

/// Returns the figure at a point, with an interval.
fn swept(point: &[(&str, &str)], value: f64) -> SweptFigure {
    let setting = |(key, value): &(&str, &str)| Setting {
        key: (*key).to_owned(),
        value: (*value).to_owned(),
    };
    SweptFigure {
        point: point.iter().map(setting).collect(),
        series: String::new(),
        figure: Figure { value, low: Some(0.9 * value), high: Some(1.1 * value) },
    }
}

fn texts(chart: &SweepChart) -> Vec<String> {
    let svg = draw(chart);
    elements(&parse(&svg), "text").map(text).collect()
}

/// A user finds the values in the chart that the user typed.
#[test]
fn ticks_are_the_swept_values_as_typed() {
    // The greatest value is less than eight times the least, so the axis is linear.
    let values = (10u32..30, prop::collection::vec(0usize..5, 2..5), prop::bool::ANY);
    generated::check(64, values, |(first, forms, is_size)| {
        let typed: Vec<String> = forms
            .iter()
            .enumerate()
            .map(|(i, form)| {
                let v = first + 20 * i as u32;
                match (is_size, form) {
                    (true, _) => format!("{v}x{v}"),
                    (_, 0) => format!("{v}"),
                    (_, 1) => format!("{v}.0"),
                    (_, 2) => format!("{v}.2500"),
                    (_, 3) => format!("{v}e0"),
                    _ => format!("+{v}"),
                }
            })
            .collect();
        let key = if is_size { "size" } else { "draw.cutoff" };
        let figures: Vec<_> = typed.iter().map(|v| swept(&[(key, v)], 1.0)).collect();
        let all = charts("Time", "ms", &figures);
        prop_assert_eq!(all.len(), 1);
        let shown = texts(&all[0]);
        // Sizes are placed by their pixels, so the least may be close to each other.
        for v in typed.iter().filter(|_| !is_size) {
            prop_assert!(shown.contains(v), "{} in {:?}", v, shown);
        }
        let n = shown.iter().filter(|t| t.contains('x') && typed.contains(*t)).count();
        prop_assert!(!is_size || n == typed.len() || n == 0, "{:?}", shown);
        Ok(())
    });
}

/// No chart and no interval is left out without a word.
#[test]
fn charts_that_are_left_out_are_counted() {
    generated::check(64, (9usize..30, prop::bool::ANY), |(n_panels, has_interval)| {
        let mut figures = Vec::new();
        for panel in 0..n_panels {
            for (x, line) in [("1", "a"), ("2", "a"), ("1", "b"), ("2", "b"), ("3", "a")] {
                let panel = format!("name {panel}");
                figures.push(swept(&[("x.x", x), ("line", line), ("panel", &panel)], 1.0));
            }
        }
        if !has_interval {
            figures[0].figure.low = None;
        }
        let all = charts("Time", "ms", &figures);
        let notes: Vec<String> = all.iter().flat_map(Chart::notes).collect();
        let expected = match n_panels - all.len() {
            0 => None,
            1 => Some("1 more chart is not drawn".to_owned()),
            n => Some(format!("{n} more charts are not drawn")),
        };
        prop_assert_eq!(all.len(), n_panels.min(12));
        let left_out = notes.iter().find(|note| note.contains("not drawn"));
        prop_assert_eq!(left_out.is_some(), expected.is_some());
        if let (Some(note), Some(expected)) = (left_out, expected) {
            prop_assert!(note.starts_with(&expected), "{}", note);
            prop_assert!(texts(&all[11]).contains(note), "{}", note);
        }
        let n_without = notes.iter().filter(|note| note.contains("confidence interval")).count();
        prop_assert_eq!(n_without, usize::from(!has_interval));
        Ok(())
    });
}

#[test]
fn crowded_ticks_are_round_numbers() {
    let typed: Vec<String> = (0..40).map(|i| format!("{}.000", 100 + i)).collect();
    let figures: Vec<_> = typed.iter().map(|v| swept(&[("draw.cutoff", v)], 1.0)).collect();
    let all = charts("Time", "ms", &figures);
    let shown = texts(&all[0]);
    assert!(
        shown.contains(&"120".to_owned()) && !shown.contains(&"120.000".to_owned()),
        "{shown:?}"
    );
}

/// Returns a sweep of `lighting.grid` in a loop that skips `n_skipped` of its 10 frames, the last
/// `n_empty` of them whole, and in one that skips nothing.
fn swept_run(n_skipped: usize, n_empty: usize) -> Run {
    let summary = |ms: f64| Measured {
        of: Summary::of(&[ms; 10]).expect("a summary"),
        p50_low: Some(ms),
        p50_high: Some(ms),
    };
    let mut run = results::run(vec![]);
    let bare = run.cases.remove(0);
    for (value, ms) in [("16", 2.0), ("32", 4.0), ("64", 8.0)] {
        let mode = |skip: bool, ms: f64| {
            let mut grid = pass("grid", Some(ms), 10, 0);
            if skip && n_skipped > 0 {
                grid = pass("grid", None, 10 - n_skipped, n_skipped);
                grid.saved_ms = Some(ms);
            }
            let (frame_ms, empty_frames) =
                (Some(summary(ms)), Some(if skip { n_empty } else { 0 }));
            let passes = vec![grid, pass("sprites", Some(1.0), 10, 0)];
            Mode { skip, frame_ms, empty_frames, passes, ..results::mode("serial", 10, 0) }
        };
        let sweep = vec![Setting { key: "lighting.grid".to_owned(), value: value.to_owned() }];
        run.cases.push(Case {
            sweep,
            modes: vec![mode(true, 1.0), mode(false, ms)],
            ..bare.clone()
        });
    }
    run
}

/// A loop that skips the pass of a swept key does not show what the key costs.
#[test]
fn a_sweep_of_skipped_passes_has_the_loop_without_skipping() {
    let loops = |run: &Run| {
        let all = charts_of_run(run);
        assert_eq!(all.len(), 1);
        assert_eq!(all[0].title(), "Frame time against lighting.grid");
        all[0].legend().into_iter().map(|entry| entry.name).collect::<Vec<_>>()
    };
    assert_eq!(loops(&swept_run(0, 0)), ["serial"]);
    assert_eq!(loops(&swept_run(9, 0)), ["serial", "serial no-skip"]);
    // One point without skipped work does not break the line.
    let mut mixed = swept_run(9, 0);
    mixed.cases[1] = swept_run(0, 0).cases.remove(1);
    assert_eq!(loops(&mixed), ["serial", "serial no-skip"]);
    assert_eq!(tooltips(&parse(&draw(&charts_of_run(&mixed)[0]))).len(), 6);
    // Where nothing moves, the loop that skips has no time.
    assert_eq!(loops(&swept_run(10, 10)), ["serial no-skip"]);
    // Nothing else was timed.
    let mut alone = swept_run(9, 0);
    alone.cases.iter_mut().for_each(|case| case.modes.truncate(1));
    assert_eq!(loops(&alone), ["serial"]);
}

/// The value of a knob that the scene has already is the unchanged scene.
#[test]
fn the_unchanged_scene_is_a_point_of_the_charts_of_its_knobs() {
    let of = |settings: &[(&str, &str)], ms: f64| configuration(settings, ms, 0.01, Front::Off);
    let found = |study: &nimbus::studies::error::records::Study| -> Vec<Vec<String>> {
        let all = charts_of_study(study);
        let first = |(_, says): ((f64, f64), String)| says.lines().next().unwrap_or("").to_owned();
        all.iter().map(|c| tooltips(&parse(&draw(c))).into_iter().map(first).collect()).collect()
    };
    let grid = "lighting.grid";
    let mut alone =
        study(vec![of(&[], 40.0), of(&[(grid, "16")], 10.0), of(&[(grid, "32")], 20.0)]);
    let three = ["16", "32", "64"].map(|value| format!("{grid}={value}"));
    assert_eq!(found(&alone), [three.clone(), three]);
    assert_eq!(alone.label(&alone.configurations[0]), "as it stands (lighting.grid=64)");
    assert_eq!(alone.label(&alone.configurations[1]), "lighting.grid=16");
    // "auto" among numbers has no place on their axis.
    alone.made.scene = json!({ "lighting": { "grid": "auto" } });
    assert!(found(&alone).iter().all(|points| points.len() == 2), "{:?}", found(&alone));
    // Of several keys, the unchanged scene fills its place among the combinations, as it was typed.
    let cutoff = "draw.cutoff";
    let mut both = study(vec![
        of(&[], 40.0),
        of(&[(grid, "16"), (cutoff, "3.0")], 10.0),
        of(&[(grid, "16"), (cutoff, "4")], 12.0),
        of(&[(grid, "64"), (cutoff, "4")], 50.0),
    ]);
    both.made.scene = json!({ "lighting": { "grid": 64 }, "draw": { "cutoff": 3.0 } });
    assert!(found(&both).iter().all(|points| points.len() == 4), "{:?}", found(&both));
    let label = both.label(&both.configurations[0]);
    assert_eq!(label, "as it stands (lighting.grid=64, draw.cutoff=3)");
    both.made.scene = json!({ "lighting": { "grid": 128 }, "draw": { "cutoff": 3.0 } });
    assert!(found(&both).iter().all(|points| points.len() == 3), "{:?}", found(&both));
    // More keys than fit a name have a line of their own.
    let many = ["a", "b", "c", "d"].map(|key| of(&[(key, "1")], 10.0));
    let mut many = study([&[of(&[], 40.0)], &many[..]].concat());
    many.made.scene = json!({ "a": 2, "b": 2, "c": 2, "d": 2.5 });
    assert_eq!(many.label(&many.configurations[0]), "as it stands");
    assert_eq!(many.base_line().as_deref(), Some("as it stands: a=2, b=2, c=2, d=2.5"));
}
