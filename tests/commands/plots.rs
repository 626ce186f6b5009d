//! Charts: positions of data, read back from the SVG, agree with the axes' ticks; degenerate input
//! is drawn.

mod passes;
mod sweeps;

use crate::results;
use crate::studies;
use crate::studies::{configuration, row, study, usual_ledger, usual_study};
use crate::svg;
use crate::svg::{Axes, PX, draw, elements, log_axes, number, parse, points, tooltips, value};
use nimbus::measure::figure::Figure;
use nimbus::report::charts::{Chart, error, frames, ledger};
use nimbus::studies::error::front::Front;
use nimbus::studies::error::records::Study;
use nimbus::studies::ledger::records::Ledger;
use nimbus::timing::frame_rows::FrameRow;

#[test]
fn error_chart_draws_points_at_their_time_and_error() {
    let study = usual_study();
    let svg = draw(&error::chart(&study));
    let doc = parse(&svg);
    let (axes, tooltips) = (log_axes(&doc), tooltips(&doc));
    assert_eq!(tooltips.len(), study.configurations.len());
    for c in &study.configurations {
        let (time, error) =
            (c.gpu_ms.expect("a time").value, c.error.expect("an error").rmse.value);
        let (x, y) = axes.log(time, error);
        let ((px, py), _) = tooltips
            .iter()
            .find(|(_, says)| says.starts_with(&format!("{}\n", c.name)))
            .expect("its mark");
        assert!((px - x).abs() <= PX && (py - y).abs() <= PX, "{}: {px} {py} for {x} {y}", c.name);
    }
    // The frame time is at another position.
    let (x, _) = axes.log(study.configurations[1].frame_ms.expect("a time").value, 0.06);
    assert!((tooltips[0].0.0 - x).abs() > PX);
}

#[test]
fn error_chart_draws_intervals_with_caps_within_the_axes() {
    let mut one = configuration(&[], 10.0, 0.01, Front::On);
    one.gpu_ms = Some(Figure { value: 10.0, low: Some(8.0), high: Some(12.5) });
    let mut error = one.error.expect("an error");
    error.rmse = Figure { value: 0.01, low: Some(0.007), high: Some(0.02) };
    one.error = Some(error);
    let svg = draw(&error::chart(&study(vec![
        one,
        configuration(&[("a", "b")], 30.0, 0.001, Front::On),
    ])));
    let doc = parse(&svg);
    let axes = log_axes(&doc);
    let lines: Vec<Vec<(f64, f64)>> = elements(&doc, "polyline").map(points).collect();
    let has = |a: (f64, f64), b: (f64, f64)| {
        let near =
            |p: (f64, f64), q: (f64, f64)| (p.0 - q.0).abs() <= PX && (p.1 - q.1).abs() <= PX;
        lines.iter().any(|l| l.len() == 2 && near(l[0], a) && near(l[1], b))
    };
    assert!(has(axes.log(8.0, 0.01), axes.log(12.5, 0.01)), "{lines:?}");
    assert!(has(axes.log(10.0, 0.007), axes.log(10.0, 0.02)), "{lines:?}");
    assert!(!has(axes.log(9.0, 0.01), axes.log(12.5, 0.01)));
    // An interval beyond the axis ends at its end, without a cap: three caps instead of four.
    let caps = |svg: &str| {
        let doc = parse(svg);
        let lines = elements(&doc, "polyline").filter(|n| n.attribute("stroke") == Some("#005FA3"));
        lines
            .map(points)
            .filter(|l| l.len() == 2 && (l[0].0 - l[1].0).hypot(l[0].1 - l[1].1) == 6.0)
            .count()
    };
    let mut endless = configuration(&[], 10.0, 0.01, Front::On);
    let n = caps(&draw(&error::chart(&study(vec![endless.clone()]))));
    endless.gpu_ms = Some(Figure { value: 10.0, low: Some(8.0), high: Some(f64::INFINITY) });
    assert_eq!((n, caps(&draw(&error::chart(&study(vec![endless]))))), (4, 3));
}

#[test]
fn error_chart_draws_the_front_as_steps() {
    let study = usual_study();
    let chart = draw(&error::chart(&study));
    let doc = parse(&chart);
    let axes = log_axes(&doc);
    let front = [(4.0, 0.06), (7.5, 0.02), (13.0, 0.0031), (26.0, 1.9e-4)];
    let mut expected = vec![];
    for pair in front.windows(2) {
        // To the right up to the next time, then down.
        expected.extend([pair[0], (pair[1].0, pair[0].1), pair[1]]);
    }
    let line = elements(&doc, "polyline")
        .map(points)
        .find(|l| l.len() == expected.len())
        .expect("the front's line");
    for ((px, py), (ms, rmse)) in line.iter().zip(expected) {
        let (x, y) = axes.log(ms, rmse);
        assert!((px - x).abs() <= PX && (py - y).abs() <= PX, "{line:?}");
    }
    // The order of the configurations does not matter.
    let mut reversed = study.clone();
    reversed.configurations[1..].reverse();
    let other = draw(&error::chart(&reversed));
    let other = parse(&other);
    assert!(elements(&other, "polyline").map(points).any(|l| l == line));
}

#[test]
fn error_chart_labels_do_not_overlap() {
    let mut study = usual_study();
    // 30 more points on the front, close together.
    for i in 0..30 {
        let i = f64::from(i);
        study.configurations.push(configuration(
            &[("n", &i.to_string())],
            14.0 + 0.3 * i,
            0.003 - 8e-5 * i,
            Front::On,
        ));
    }
    let chart = error::chart(&study);
    let svg = draw(&chart);
    let doc = parse(&svg);
    let labels: Vec<(f64, f64, usize)> = elements(&doc, "text")
        .filter(|n| {
            n.attribute("text-anchor") == Some("start")
                && n.attribute("dy") == Some("0.5ex")
                && svg::text(*n).parse::<u32>().is_ok()
        })
        .map(|n| (number(n, "x"), number(n, "y"), svg::text(n).len()))
        .collect();
    assert!(labels.len() >= 10 && labels.len() < 34, "{}", labels.len());
    for (i, a) in labels.iter().enumerate() {
        for b in &labels[..i] {
            let apart = (a.1 - b.1).abs() >= 8.0
                || a.0 + 6.0 * a.2 as f64 <= b.0
                || b.0 + 6.0 * b.2 as f64 <= a.0;
            assert!(apart, "{a:?} {b:?}");
        }
    }
    // The notes list the first of them and count the others.
    assert!(svg.contains("and 20 more on the front"));
}

#[test]
fn error_chart_draws_degenerate_studies() {
    let whole = |study: &Study| {
        let chart = error::chart(study);
        let svg = draw(&chart);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        let n = tooltips(&parse(&svg)).len();
        let text = chart.text(80, 20, false).expect("a chart");
        assert!(text.lines().count() >= 20 && !text.contains('\u{1b}'), "{text}");
        (n, svg, text)
    };
    let (n, svg, text) = whole(&study(vec![]));
    assert!(
        n == 0
            && svg.contains("nothing was both timed and compared")
            && text.contains("nothing was both timed")
    );
    // One point; two equal points.
    let one = configuration(&[], 10.0, 0.01, Front::On);
    assert_eq!(whole(&study(vec![one.clone()])).0, 1);
    assert_eq!(whole(&study(vec![one.clone(), one.clone()])).0, 2);
    // The error 0 has a position with the tick 0.
    let mut exact = configuration(&[("a", "0")], 20.0, 0.0, Front::On);
    if let Some(error) = &mut exact.error {
        error.rmse = Figure { value: 0.0, low: None, high: None };
    }
    let (n, svg, _) = whole(&study(vec![one.clone(), exact.clone()]));
    let doc = parse(&svg);
    let zero = elements(&doc, "text").find(|t| svg::text(*t) == "0").expect("a tick that says 0");
    assert!(
        n == 2 && tooltips(&doc).iter().any(|((_, y), _)| (y - number(zero, "y")).abs() <= PX),
        "{svg}"
    );
    assert_eq!(whole(&study(vec![exact])).0, 1);
    // NaN, missing values, infinite intervals, negative ends.
    let mut odd = [0, 1, 2, 3, 4]
        .map(|i| configuration(&[("odd", &i.to_string())], 5.0 + f64::from(i), 0.02, Front::Off));
    odd[0].gpu_ms = Some(Figure { value: f64::NAN, low: None, high: None });
    odd[1].gpu_ms = None;
    odd[2].error = None;
    odd[3].gpu_ms = Some(Figure { value: 6.0, low: Some(-1.0), high: Some(f64::INFINITY) });
    odd[4].gpu_ms = Some(Figure { value: 7.0, low: Some(f64::NAN), high: Some(1e300) });
    let (n, svg, _) = whole(&study([vec![one], odd.to_vec()].concat()));
    assert!(
        n == 3 && svg.contains("3 configurations have no time or no error and are not drawn"),
        "{svg}"
    );
}

#[test]
fn charts_escape_text_of_files() {
    let evil = "</text><script>alert(1)</script>&\"'\u{1b}[31m\u{7}";
    let chart = error::chart(&study(vec![configuration(&[(evil, "1")], 10.0, 0.01, Front::On)]));
    let svg = draw(&chart);
    let doc = parse(&svg);
    assert!(elements(&doc, "script").next().is_none());
    assert!(tooltips(&doc)[0].1.contains("<script>alert(1)</script>"), "{svg}");
    assert!(!chart.text(80, 20, false).expect("a chart").contains(['\u{1b}', '\u{7}']));
    let mut run = passes::timed_run();
    run.cases[0].modes[0].passes[0].name = evil.to_owned();
    run.cases[0].phase = Some(evil.to_owned());
    let chart = passes::chart(&run);
    assert!(!chart.text(80, chart.rows(), false).expect("a chart").contains(['\u{1b}', '\u{7}']));
    parse(&draw(&chart));
}

fn frame_rows(n: u32) -> Vec<FrameRow> {
    let ms = |i: u32| if i == n / 2 { 50.0 } else { 10.0 + f64::from(i % 5) };
    let of = |threading: &'static str, block: u32, by: f64| {
        move |i: u32| FrameRow {
            frame_ms: by * ms(i),
            block,
            warm_up: false,
            ..results::row(threading, i)
        }
    };
    let warm_up = FrameRow { warm_up: true, frame_ms: 900.0, ..results::row("serial", 0) };
    [warm_up]
        .into_iter()
        .chain((0..n).map(of("serial", 0, 1.0)))
        .chain((0..n).map(of("parallel", 1, 0.5)))
        .collect()
}

#[test]
fn frame_chart_draws_every_time_or_counts_it() {
    let linear: [fn(f64) -> f64; 2] = [|v| v, |v| v];
    for (n, greatest) in [(40, 50.0), (5000, 50.0)] {
        let charts = frames::charts_of_rows(&frame_rows(n));
        assert_eq!(charts.len(), 1);
        let svg = draw(&charts[0]);
        let doc = parse(&svg);
        let axes = Axes::of(&doc, linear);
        let top =
            elements(&doc, "polygon").flat_map(points).map(|p| p.1).fold(f64::INFINITY, f64::min);
        let y = |ms: f64| Axes::px(axes.y, ms);
        if n == 40 {
            // The axis is not cut at one of forty frames; the warm-up is not drawn.
            assert!((top - y(greatest)).abs() <= PX, "{top} for {}", y(greatest));
            let line = elements(&doc, "polyline")
                .map(points)
                .find(|l| l.len() == 40)
                .expect("the serial line");
            for (i, (px, py)) in line.iter().enumerate().filter(|(i, _)| *i != 20) {
                let (x, y) = (Axes::px(axes.x, i as f64), y(10.0 + (i % 5) as f64));
                assert!(
                    (px - x).abs() <= PX && (py - y).abs() <= PX,
                    "frame {i}: {px} {py} for {x} {y}"
                );
            }
        } else {
            assert!(svg.contains("2 of 10000 frames took longer than"), "cut");
            assert!(svg.contains("up to 50 ms") && svg.len() < 60_000, "{}", svg.len());
        }
    }
    // A sweep has a chart for every point; a chart shows all phases.
    let mut rows = frame_rows(10);
    for row in &mut rows {
        (row.sweep, row.phase) =
            (format!("k={}", row.block), if row.frame < 5 { "calm" } else { "storm" }.to_owned());
    }
    let charts = frames::charts_of_rows(&rows);
    assert_eq!(
        charts.iter().map(Chart::title).collect::<Vec<_>>(),
        ["Frame time, k=0", "Frame time, k=1"]
    );
    let svg = draw(&charts[1]);
    assert!(svg.contains("calm") && svg.contains("storm"));
    // No rows, a single row, NaN.
    assert!(frames::charts_of_rows(&[]).is_empty());
    let odd = FrameRow { frame_ms: f64::NAN, ..results::row("serial", 3) };
    for rows in [
        vec![odd.clone()],
        vec![results::row("serial", u32::MAX)],
        vec![odd, results::row("serial", 3)],
    ] {
        let chart = &frames::charts_of_rows(&rows)[0];
        assert!(!draw(chart).contains("NaN"));
        chart.text(60, 10, true).expect("a chart");
    }
}

#[test]
fn ledger_chart_bars_end_at_the_errors() {
    let found = usual_ledger();
    let svg = draw(&ledger::chart(&found));
    let doc = parse(&svg);
    let ticks: Vec<(f64, f64)> = elements(&doc, "text")
        .filter(|n| n.attribute("text-anchor") == Some("middle"))
        .filter_map(|n| Some((value(&svg::text(n))?.log10(), number(n, "x"))))
        .collect();
    let px = |v: f64| Axes::px([ticks[0], ticks[ticks.len() - 1]], v.log10());
    let ends: Vec<f64> = elements(&doc, "rect")
        .filter(|n| {
            ["#005FA3", "#5B6570"].map(Some).contains(&n.attribute("fill"))
                && number(*n, "height") > 12.0
        })
        .map(|n| number(n, "x") + number(n, "width"))
        .collect();
    let drawn: Vec<f64> =
        found.rows.iter().filter(|r| r.error.value > 0.0).map(|r| r.error.value).collect();
    assert_eq!(ends.len(), drawn.len());
    for (end, error) in ends.iter().zip(drawn) {
        assert!((end - px(error)).abs() <= PX, "{end} for {error}");
    }
    // The error 0 has no bar on a logarithmic axis, but a number.
    assert!(elements(&doc, "text").any(|n| svg::text(n) == "0"));
    let total = elements(&doc, "polyline")
        .map(points)
        .find(|l| l.len() == 2 && (l[0].0 - px(found.total.value)).abs() <= PX);
    assert!(total.is_some_and(|l| l[0].0 == l[1].0), "a line at the total");
    // No rows, and rows without a finite, positive error.
    let bare = |rows| Ledger {
        total: Figure { value: f64::NAN, low: None, high: None },
        ..studies::ledger(rows)
    };
    for of in [bare(vec![]), bare(vec![row("a", 0.0, true), row("b", f64::INFINITY, false)])] {
        let svg = draw(&ledger::chart(&of));
        assert!(!svg.contains("NaN") && !svg.contains("inf "), "{svg}");
        parse(&svg);
        let chart = ledger::chart(&of);
        chart.text(60, chart.rows(), false).expect("a chart");
    }
}

#[test]
fn charts_are_drawn_at_every_size() {
    let (study, ledger) = (error::chart(&usual_study()), ledger::chart(&usual_ledger()));
    for (columns, rows) in [(1, 1), (10, 3), (40, 8), (400, 100)] {
        study.text(columns, rows, true).expect("a chart");
        ledger.text(columns, rows, true).expect("a chart");
    }
    for size in [(1, 1), (80, 60), (3000, 2000)] {
        study.svg(size).expect("a chart");
    }
}
