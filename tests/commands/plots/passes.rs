//! The chart of passes: its bars have the passes' times, and a pass has one colour on a page.

use nimbus::report::charts::passes::{self, PassChart, PassColors};
use nimbus::report::charts::{Chart, LegendEntry};
use nimbus::timing::records::{Pass, Run};

use crate::results;
use crate::svg::{self, Axes, PX, draw, elements, number, parse, value};

/// Returns the chart of a run that is alone on its page.
pub fn chart(run: &Run) -> PassChart {
    passes::chart(run, &PassColors::of([run].into_iter())).expect("a chart")
}

pub fn pass(name: &str, p50_ms: Option<f64>, n_run: usize, n_skipped: usize) -> Pass {
    let (name, share, reason, reasons) = (name.to_owned(), None, None, vec![]);
    Pass { name, p50_ms, share, n_run, n_skipped, reason, reasons, ..Pass::default() }
}

pub fn timed_run() -> Run {
    let mut run =
        results::run(vec![results::mode("serial", 10, 0), results::mode("parallel", 10, 0)]);
    let all = |by: f64| {
        vec![
            pass("grid", Some(2.0 * by), 5, 5),
            pass("tiles", Some(4.0 * by), 10, 0),
            pass("never", None, 0, 10),
        ]
    };
    run.cases[0].modes[0].passes = all(1.0);
    run.cases[0].modes[1].passes = all(0.5);
    run
}

#[test]
fn pass_chart_bars_have_the_passes_times() {
    let chart = chart(&timed_run());
    let svg = draw(&chart);
    let doc = parse(&svg);
    let ticks: Vec<(f64, f64)> = elements(&doc, "text")
        .filter(|n| n.attribute("text-anchor") == Some("middle"))
        .filter_map(|n| Some((value(&svg::text(n))?, number(n, "x"))))
        .collect();
    let px = |ms: f64| Axes::px([ticks[0], ticks[ticks.len() - 1]], ms);
    // The grid runs in every other frame: 1 ms of an average frame, then 4 ms of tiles; half of
    // both in the second bar.
    let bars: Vec<(f64, f64)> = elements(&doc, "rect")
        .filter(|n| {
            n.attribute("opacity") == Some("1")
                && number(*n, "height") > 12.0
                && number(*n, "width") < 800.0
        })
        .map(|n| (number(n, "x"), number(n, "x") + number(n, "width")))
        .collect();
    let expected = [(0.0, 1.0), (1.0, 5.0), (0.0, 0.5), (0.5, 2.5)];
    assert_eq!(bars.len(), expected.len(), "{svg}");
    for ((from, to), (a, b)) in bars.iter().zip(expected) {
        assert!((from - px(a)).abs() <= PX && (to - px(b)).abs() <= PX, "{from} {to} for {a} {b}");
    }
    let text = chart.text(60, chart.rows(), false).expect("a chart");
    assert!(
        text.contains("g grid  t tiles") && text.contains("ttttt") && !text.contains("never"),
        "{text}"
    );
    // No pass was timed.
    let bare = results::run(vec![results::mode("serial", 1, 0)]);
    assert_eq!(passes::chart(&bare, &PassColors::of([&bare].into_iter())), None);
}

/// Two runs of one page, of which each has passes that the other has not.
#[test]
fn a_pass_has_one_colour_in_all_charts_of_a_page() {
    let run = |passes: &[(&str, f64)]| {
        let mut run = results::run(vec![results::mode("serial", 10, 0)]);
        let all = passes.iter().map(|(name, ms)| pass(name, Some(*ms), 10, 0));
        run.cases[0].modes[0].passes = all.collect();
        run
    };
    let long = run(&[("grid", 900.0), ("tiles", 100.0), ("sort", 50.0)]);
    let short = run(&[("place", 0.01), ("tiles", 0.03), ("sprites", 0.04), ("sort", 0.02)]);
    let colors = PassColors::of([&long, &short].into_iter());
    let legends = [&long, &short].map(|run| passes::chart(run, &colors).expect("a chart").legend());
    let names = |legend: &[LegendEntry]| legend.iter().map(|e| e.name.clone()).collect::<Vec<_>>();
    // A legend has the passes of its own chart alone, though the colours are those of the page.
    assert_eq!(names(&legends[0]), ["grid", "tiles", "sort"]);
    let mut of_short = names(&legends[1]);
    of_short.sort();
    assert_eq!(of_short, ["place", "sort", "sprites", "tiles"]);
    let mut seen: Vec<(&str, (u8, u8, u8), char)> = Vec::new();
    for LegendEntry { color, glyph, name, .. } in legends.iter().flatten() {
        let entry = (name.as_str(), (color.0, color.1, color.2), *glyph);
        match seen.iter().find(|(other, ..)| other == name) {
            Some(other) => assert_eq!(*other, entry),
            None => seen.push(entry),
        }
    }
    // Five passes have five colours and letters.
    for (i, a) in seen.iter().enumerate() {
        assert!(seen[..i].iter().all(|b| a.1 != b.1 && a.2 != b.2), "{seen:?}");
    }
    assert_eq!(seen.len(), 5);
    // A cheap run does not lose its passes to an expensive one: shares decide.
    let crowded: Vec<(String, f64)> = (0..20).map(|i| (format!("p{i}"), 100.0)).collect();
    let crowded: Vec<(&str, f64)> = crowded.iter().map(|(n, ms)| (n.as_str(), *ms)).collect();
    let crowded = run(&crowded);
    let colors = PassColors::of([&crowded, &short].into_iter());
    let legend = passes::chart(&short, &colors).expect("a chart").legend();
    assert!(!names(&legend).contains(&"others".to_owned()), "{legend:?}");
}
