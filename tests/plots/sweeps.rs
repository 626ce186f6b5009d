//! Charts of sweeps: ticks as typed, lines, panels, and notes on what they lack.

use nimbus::report::charts::Chart;
use nimbus::report::charts::sweep::{SweepChart, SweptFigure, charts};
use nimbus::studies::figure::Figure;
use nimbus::timing::names::Setting;
use proptest::prelude::*;

use crate::generated;
use crate::svg::{draw, elements, parse, text};

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
