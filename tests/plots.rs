//! Charts: what is drawn lies where its axes say, and input of no shape breaks them. Positions are
//! read back from the SVG and compared with the ticks' own.

#[path = "harness/results.rs"]
mod results;
#[path = "harness/studies.rs"]
mod studies;

use nimbus::report::charts::{Plot, frames, ledger, passes, tradeoff};
use nimbus::studies::error::records::{Front, Study};
use nimbus::studies::ledger::records::Ledger;
use nimbus::studies::provenance::Figure;
use nimbus::timing::frame_rows::FrameRow;
use nimbus::timing::records::{Pass, Run};
use roxmltree::{Document, Node};
use studies::{configuration, row, study, usual_ledger, usual_study};

/// Half a pixel of rounding of the point, and half of a tick.
const PX: f64 = 1.01;

fn number(node: Node, name: &str) -> f64 {
    node.attribute(name)
        .and_then(|v| v.parse().ok())
        .unwrap_or_else(|| panic!("{name} of {node:?}"))
}

fn text(node: Node) -> String {
    node.text().unwrap_or_default().trim().to_owned()
}

fn named<'a>(doc: &'a Document, tag: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    doc.descendants().filter(move |n| n.has_tag_name(tag))
}

/// A chart's axes as its ticks tell them: decimal logarithm, or value, to px.
struct Axes {
    x: [(f64, f64); 2],
    y: [(f64, f64); 2],
}

/// The value of a tick's text, "2×10⁻⁴" among others.
fn value(text: &str) -> Option<f64> {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let (mantissa, power) = match text.split_once("10").filter(|(m, rest)| {
        (m.is_empty() || m.ends_with('×')) && rest.starts_with(|c| c == '⁻' || DIGITS.contains(&c))
    }) {
        Some((mantissa, power)) => (mantissa.trim_end_matches('×'), power),
        None => return text.parse().ok(),
    };
    let digit = |c: char| {
        DIGITS.iter().position(|d| *d == c).map(|i| char::from(b'0' + i as u8)).unwrap_or('-')
    };
    let power: i32 = power.chars().map(digit).collect::<String>().parse().ok()?;
    let mantissa = if mantissa.is_empty() { 1.0 } else { mantissa.parse::<f64>().ok()? };
    Some(mantissa * 10f64.powi(power))
}

impl Axes {
    /// From the outermost ticks; `scale` is the axes' own.
    fn of(doc: &Document, scale: [fn(f64) -> f64; 2]) -> Axes {
        let ticks = |is_x: bool| -> Vec<(f64, f64)> {
            // x ticks hang below their place (0.76em), y ticks stand to the left of theirs.
            let is_tick = |n: &Node| match is_x {
                true => {
                    n.attribute("text-anchor") == Some("middle")
                        && n.attribute("dy") == Some("0.76em")
                        && n.attribute("transform").is_none()
                }
                false => n.attribute("text-anchor") == Some("end"),
            };
            let at = |n: Node| Some((value(&text(n))?, number(n, if is_x { "x" } else { "y" })));
            named(doc, "text").filter(is_tick).filter_map(at).collect()
        };
        let ends = |ticks: Vec<(f64, f64)>, scale: fn(f64) -> f64| {
            let ticks: Vec<(f64, f64)> = ticks
                .into_iter()
                .map(|(v, px)| (scale(v), px))
                .filter(|(v, _)| v.is_finite())
                .collect();
            assert!(ticks.len() >= 2, "{ticks:?}");
            [ticks[0], ticks[ticks.len() - 1]]
        };
        Axes { x: ends(ticks(true), scale[0]), y: ends(ticks(false), scale[1]) }
    }

    fn px(of: [(f64, f64); 2], v: f64) -> f64 {
        of[0].1 + (v - of[0].0) / (of[1].0 - of[0].0) * (of[1].1 - of[0].1)
    }

    fn log(&self, x: f64, y: f64) -> (f64, f64) {
        (Self::px(self.x, x.log10()), Self::px(self.y, y.log10()))
    }
}

fn log_axes(doc: &Document) -> Axes {
    Axes::of(doc, [f64::log10, f64::log10])
}

fn svg(plot: &impl Plot) -> String {
    plot.svg(plot.size()).expect("a chart")
}

fn parsed(svg: &str) -> Document<'_> {
    Document::parse(svg).unwrap_or_else(|e| panic!("{e}\n{svg}"))
}

/// Middles of what can be pointed at, and what it says.
fn marks(doc: &Document) -> Vec<((f64, f64), String)> {
    let of = |group: Node| {
        let rect = group.children().find(|n| n.has_tag_name("rect")).expect("a place to point at");
        let middle = |at, size| number(rect, at) + number(rect, size) / 2.0;
        (
            (middle("x", "width"), middle("y", "height")),
            group.attribute("aria-label").expect("a name").to_owned(),
        )
    };
    named(doc, "g").filter(|n| n.attribute("class") == Some("mark")).map(of).collect()
}

#[test]
fn every_point_lies_at_its_time_and_error() {
    let study = usual_study();
    let svg = svg(&tradeoff::chart(&study));
    let doc = parsed(&svg);
    let (axes, marks) = (log_axes(&doc), marks(&doc));
    assert_eq!(marks.len(), study.configurations.len());
    for c in &study.configurations {
        let (time, error) =
            (c.gpu_ms.expect("a time").value, c.error.expect("an error").rmse.value);
        let (x, y) = axes.log(time, error);
        let ((px, py), _) = marks
            .iter()
            .find(|(_, says)| says.starts_with(&format!("{}\n", c.name)))
            .expect("its mark");
        assert!((px - x).abs() <= PX && (py - y).abs() <= PX, "{}: {px} {py} for {x} {y}", c.name);
    }
    // The other time and the other error, and the test would see it.
    let (x, _) = axes.log(study.configurations[1].frame_ms.expect("a time").value, 0.06);
    assert!((marks[0].0.0 - x).abs() > PX);
}

#[test]
fn intervals_end_where_they_end() {
    let mut one = configuration(&[], 10.0, 0.01, Front::On);
    one.gpu_ms = Some(Figure { value: 10.0, low: Some(8.0), high: Some(12.5) });
    let mut error = one.error.expect("an error");
    error.rmse = Figure { value: 0.01, low: Some(0.007), high: Some(0.02) };
    one.error = Some(error);
    let svg = svg(&tradeoff::chart(&study(vec![
        one,
        configuration(&[("a", "b")], 30.0, 0.001, Front::On),
    ])));
    let doc = parsed(&svg);
    let axes = log_axes(&doc);
    let lines: Vec<Vec<(f64, f64)>> = named(&doc, "polyline").map(points).collect();
    let has = |a: (f64, f64), b: (f64, f64)| {
        let near =
            |p: (f64, f64), q: (f64, f64)| (p.0 - q.0).abs() <= PX && (p.1 - q.1).abs() <= PX;
        lines.iter().any(|l| l.len() == 2 && near(l[0], a) && near(l[1], b))
    };
    assert!(has(axes.log(8.0, 0.01), axes.log(12.5, 0.01)), "{lines:?}");
    assert!(has(axes.log(10.0, 0.007), axes.log(10.0, 0.02)), "{lines:?}");
    assert!(!has(axes.log(9.0, 0.01), axes.log(12.5, 0.01)));
    // One that goes on beyond the axis runs to its end, and has no foot there: three lines across
    // in place of four.
    let feet = |svg: &str| {
        let doc = parsed(svg);
        let lines = named(&doc, "polyline").filter(|n| n.attribute("stroke") == Some("#005FA3"));
        lines
            .map(points)
            .filter(|l| l.len() == 2 && (l[0].0 - l[1].0).hypot(l[0].1 - l[1].1) == 6.0)
            .count()
    };
    let mut endless = configuration(&[], 10.0, 0.01, Front::On);
    let n = feet(&crate::svg(&tradeoff::chart(&study(vec![endless.clone()]))));
    endless.gpu_ms = Some(Figure { value: 10.0, low: Some(8.0), high: Some(f64::INFINITY) });
    assert_eq!((n, feet(&crate::svg(&tradeoff::chart(&study(vec![endless]))))), (4, 3));
}

fn points(line: Node) -> Vec<(f64, f64)> {
    let pairs = line.attribute("points").expect("points").split_whitespace();
    let pair =
        |p: &str| p.split_once(',').and_then(|(x, y)| Some((x.parse().ok()?, y.parse().ok()?)));
    pairs.map(|p| pair(p).expect("a point")).collect()
}

#[test]
fn the_front_is_a_staircase_from_the_fastest() {
    let study = usual_study();
    let chart = svg(&tradeoff::chart(&study));
    let doc = parsed(&chart);
    let axes = log_axes(&doc);
    let front = [(4.0, 0.06), (7.5, 0.02), (13.0, 0.0031), (26.0, 1.9e-4)];
    let mut expected = vec![];
    for pair in front.windows(2) {
        // As slow as the next and still as far off, then down.
        expected.extend([pair[0], (pair[1].0, pair[0].1), pair[1]]);
    }
    let line = named(&doc, "polyline")
        .map(points)
        .find(|l| l.len() == expected.len())
        .expect("the front's line");
    for ((px, py), (ms, rmse)) in line.iter().zip(expected) {
        let (x, y) = axes.log(ms, rmse);
        assert!((px - x).abs() <= PX && (py - y).abs() <= PX, "{line:?}");
    }
    // The same whatever the order of the configurations.
    let mut reversed = study.clone();
    reversed.configurations[1..].reverse();
    let other = svg(&tradeoff::chart(&reversed));
    let other = parsed(&other);
    assert!(named(&other, "polyline").map(points).any(|l| l == line));
}

#[test]
fn numbers_do_not_cover_each_other() {
    let mut study = usual_study();
    // Thirty on the front, close together.
    for i in 0..30 {
        let i = f64::from(i);
        study.configurations.push(configuration(
            &[("n", &i.to_string())],
            14.0 + 0.3 * i,
            0.003 - 8e-5 * i,
            Front::On,
        ));
    }
    let chart = tradeoff::chart(&study);
    let svg = svg(&chart);
    let doc = parsed(&svg);
    let labels: Vec<(f64, f64, usize)> = named(&doc, "text")
        .filter(|n| {
            n.attribute("text-anchor") == Some("start")
                && n.attribute("dy") == Some("0.5ex")
                && text(*n).parse::<u32>().is_ok()
        })
        .map(|n| (number(n, "x"), number(n, "y"), text(n).len()))
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
    // Named below, as far as there is room, and counted.
    assert!(svg.contains("and 20 more on the front"));
}

#[test]
fn degenerate_studies_are_drawn() {
    let whole = |study: &Study| {
        let chart = tradeoff::chart(study);
        let svg = svg(&chart);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        let n = marks(&parsed(&svg)).len();
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
    // One point; the same twice.
    let one = configuration(&[], 10.0, 0.01, Front::On);
    assert_eq!(whole(&study(vec![one.clone()])).0, 1);
    assert_eq!(whole(&study(vec![one.clone(), one.clone()])).0, 2);
    // Without an error there is a place for it below all others, and it says 0.
    let mut exact = configuration(&[("a", "0")], 20.0, 0.0, Front::On);
    if let Some(error) = &mut exact.error {
        error.rmse = Figure { value: 0.0, low: None, high: None };
    }
    let (n, svg, _) = whole(&study(vec![one.clone(), exact.clone()]));
    let doc = parsed(&svg);
    let zero = named(&doc, "text").find(|t| text_of(*t) == "0").expect("a tick that says 0");
    assert!(
        n == 2 && marks(&doc).iter().any(|((_, y), _)| (y - number(zero, "y")).abs() <= PX),
        "{svg}"
    );
    assert_eq!(whole(&study(vec![exact])).0, 1);
    // Neither number nor finite; not there; infinite intervals; ends that no logarithm has.
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

fn text_of(node: Node) -> String {
    text(node)
}

#[test]
fn what_files_say_is_text() {
    let evil = "</text><script>alert(1)</script>&\"'\u{1b}[31m\u{7}";
    let chart = tradeoff::chart(&study(vec![configuration(&[(evil, "1")], 10.0, 0.01, Front::On)]));
    let svg = svg(&chart);
    let doc = parsed(&svg);
    assert!(named(&doc, "script").next().is_none());
    assert!(marks(&doc)[0].1.contains("<script>alert(1)</script>"), "{svg}");
    assert!(!chart.text(80, 20, false).expect("a chart").contains(['\u{1b}', '\u{7}']));
    let mut run = timed_run();
    run.cases[0].modes[0].passes[0].name = evil.to_owned();
    run.cases[0].phase = Some(evil.to_owned());
    let chart = passes::chart(&run).expect("a chart");
    assert!(!chart.text(80, chart.rows(), false).expect("a chart").contains(['\u{1b}', '\u{7}']));
    parsed(&crate::svg(&chart));
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
fn frame_times_lie_on_their_axes_and_nothing_slow_is_lost() {
    let linear: [fn(f64) -> f64; 2] = [|v| v, |v| v];
    for (n, greatest) in [(40, 50.0), (5000, 50.0)] {
        let charts = frames::charts_of_rows(&frame_rows(n));
        assert_eq!(charts.len(), 1);
        let svg = svg(&charts[0]);
        let doc = parsed(&svg);
        let axes = Axes::of(&doc, linear);
        let top =
            named(&doc, "polygon").flat_map(points).map(|p| p.1).fold(f64::INFINITY, f64::min);
        let y = |ms: f64| Axes::px(axes.y, ms);
        if n == 40 {
            // One in forty is not rare enough to be cut; the warm-up is not there.
            assert!((top - y(greatest)).abs() <= PX, "{top} for {}", y(greatest));
            let line = named(&doc, "polyline")
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
    // A sweep has a chart a point; phases follow each other in one.
    let mut rows = frame_rows(10);
    for row in &mut rows {
        (row.sweep, row.phase) =
            (format!("k={}", row.block), if row.frame < 5 { "calm" } else { "storm" }.to_owned());
    }
    let charts = frames::charts_of_rows(&rows);
    assert_eq!(
        charts.iter().map(Plot::title).collect::<Vec<_>>(),
        ["Frame time, k=0", "Frame time, k=1"]
    );
    let svg = svg(&charts[1]);
    assert!(svg.contains("calm") && svg.contains("storm"));
    // None, one, and what is no number.
    assert!(frames::charts_of_rows(&[]).is_empty());
    let odd = FrameRow { frame_ms: f64::NAN, ..results::row("serial", 3) };
    for rows in [
        vec![odd.clone()],
        vec![results::row("serial", u32::MAX)],
        vec![odd, results::row("serial", 3)],
    ] {
        let chart = &frames::charts_of_rows(&rows)[0];
        assert!(!crate::svg(chart).contains("NaN"));
        chart.text(60, 10, true).expect("a chart");
    }
}

fn pass(name: &str, p50_ms: Option<f64>, n_run: usize, n_skipped: usize) -> Pass {
    let (name, share, reason, reasons) = (name.to_owned(), None, None, vec![]);
    Pass { name, p50_ms, share, n_run, n_skipped, reason, reasons, saved_ms: None }
}

fn timed_run() -> Run {
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
fn a_bar_is_as_long_as_its_passes_take() {
    let chart = passes::chart(&timed_run()).expect("a chart");
    let svg = svg(&chart);
    let doc = parsed(&svg);
    let ticks: Vec<(f64, f64)> = named(&doc, "text")
        .filter(|n| n.attribute("text-anchor") == Some("middle"))
        .filter_map(|n| Some((value(&text(n))?, number(n, "x"))))
        .collect();
    let px = |ms: f64| Axes::px([ticks[0], ticks[ticks.len() - 1]], ms);
    // Grid runs in every other frame: 1 ms of an average one, and then 4 of tiles; half of both in
    // the second bar.
    let bars: Vec<(f64, f64)> = named(&doc, "rect")
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
    // Nothing was timed.
    assert_eq!(passes::chart(&results::run(vec![results::mode("serial", 1, 0)])), None);
}

#[test]
fn a_ledger_s_bars_are_its_errors() {
    let found = usual_ledger();
    let svg = svg(&ledger::chart(&found));
    let doc = parsed(&svg);
    let ticks: Vec<(f64, f64)> = named(&doc, "text")
        .filter(|n| n.attribute("text-anchor") == Some("middle"))
        .filter_map(|n| Some((value(&text(n))?.log10(), number(n, "x"))))
        .collect();
    let px = |v: f64| Axes::px([ticks[0], ticks[ticks.len() - 1]], v.log10());
    let ends: Vec<f64> = named(&doc, "rect")
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
    // On an axis of logarithms nothing has no bar, but is said.
    assert!(named(&doc, "text").any(|n| text(n) == "0"));
    let total = named(&doc, "polyline")
        .map(points)
        .find(|l| l.len() == 2 && (l[0].0 - px(found.total.value)).abs() <= PX);
    assert!(total.is_some_and(|l| l[0].0 == l[1].0), "a line at the total");
    // Rows without an error, and none at all.
    let bare = |rows| Ledger {
        total: Figure { value: f64::NAN, low: None, high: None },
        ..studies::ledger(rows)
    };
    for of in [bare(vec![]), bare(vec![row("a", 0.0, true), row("b", f64::INFINITY, false)])] {
        let svg = crate::svg(&ledger::chart(&of));
        assert!(!svg.contains("NaN") && !svg.contains("inf "), "{svg}");
        parsed(&svg);
        let chart = ledger::chart(&of);
        chart.text(60, chart.rows(), false).expect("a chart");
    }
}

#[test]
fn every_size_of_terminal_and_picture_is_drawn() {
    let (study, ledger) = (tradeoff::chart(&usual_study()), ledger::chart(&usual_ledger()));
    for (columns, rows) in [(1, 1), (10, 3), (40, 8), (400, 100)] {
        study.text(columns, rows, true).expect("a chart");
        ledger.text(columns, rows, true).expect("a chart");
    }
    for size in [(1, 1), (80, 60), (3000, 2000)] {
        study.svg(size).expect("a chart");
    }
}
