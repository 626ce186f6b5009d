//! The table that `nimbus error` prints.

use super::output::{header, interval, or_dash, scientific, table};
use crate::measure::figure::Figure;
use crate::studies::error::front::Front;
use crate::studies::error::records::{Best, Budget, Configuration, Study};
use crate::studies::provenance::ReferenceRecord;

/// Returns the whole text: the conditions, the configurations by time, and the best for each
/// budget.
pub fn report(study: &Study) -> String {
    let made = &study.made;
    let mut out = format!(
        "{}\n{} ({}), {}\n",
        made.scene_file, made.device.name, made.device.driver, made.cpu.model
    );
    out += &reference_line(&study.reference);
    out += &format!(
        "{} configurations in {} rounds of {} frames{}\n\n",
        study.configurations.len(),
        study.rounds,
        study.frames,
        if study.interrupted { "; INTERRUPTED: what was finished" } else { "" }
    );
    out += &table(&rows(study));
    out +=
        "\n* on the front  ~ near it: others are better, but none is faster beyond the intervals";
    if study.configurations.iter().any(is_unresolved) {
        out += "  ! the reference's own error is more than a tenth of it";
    }
    out.push('\n');
    out += &study.base_line().map_or(String::new(), |line| line + "\n");
    out += &missing_lines(study);
    for best in &study.best {
        out += &best_line(study, best);
    }
    out
}

/// Returns a line for each kind of figure that the table shows as "-", with the reason.
fn missing_lines(study: &Study) -> String {
    let mut out = String::new();
    let run = || study.configurations.iter().filter(|c| c.failure.is_none());
    if run().any(|c| c.ms(study.time).is_none() || c.error.is_none()) {
        out += "- : the study ended before this was timed or drawn; --resume goes on\n";
    } else if run().any(|c| c.by_base.is_none_or(|f| f.low.is_none())) {
        let n = study.rounds;
        out += &format!("95 %: - : an interval needs 2 rounds or more, found {n}; see --rounds\n");
    }
    let is_still = |c: &Configuration| c.gpu_ms.is_some_and(|t| t.value == 0.0);
    if study.as_played && run().any(is_still) {
        out += "NOTHING MOVES: with --as-played, frames that draw nothing were timed; leave it \
            out, or set wind, gusts or a [[camera.path]]\n";
    }
    out
}

fn reference_line(r: &ReferenceRecord) -> String {
    let n_all = u64::from(r.width) * u64::from(r.height);
    let of = if r.n_pixels as u64 == n_all {
        format!("all {n_all}")
    } else {
        format!("{} of {n_all}", r.n_pixels)
    };
    let own = r.own_error.map_or("unbounded".to_owned(), |e| format!("{e:.1e}"));
    let source = if r.from_cache { "from the cache" } else { "computed now" };
    format!(
        "against {} at {of} pixels of frame {}: RMS {:.3}, own error about {own} ({}); {:.1} s, \
         {source}\n",
        r.against, r.frame, r.magnitude, r.accuracy, r.seconds
    )
}

fn is_unresolved(c: &Configuration) -> bool {
    c.error.is_some_and(|e| !e.is_resolved)
}

fn rows(study: &Study) -> Vec<Vec<String>> {
    let time = format!("{} ms", study.time.name());
    let (by_base, of) = ("by base", "95 %");
    let mut rows =
        header(["", "configuration", &time, of, by_base, of, "RMSE", of, "max", "relMSE"]);
    // Only against random paths.
    let cloud = |c: &Configuration| c.error.and_then(|e| e.cloud);
    let has_cloud = study.configurations.iter().any(|c| cloud(c).is_some());
    if has_cloud {
        rows.iter_mut().for_each(|row| row.extend(["of cloud".to_owned(), of.to_owned()]));
    }
    let mut sorted: Vec<&Configuration> = study.configurations.iter().collect();
    let key = |c: &Configuration| c.ms(study.time).map_or(f64::INFINITY, |t| t.value);
    sorted.sort_by(|a, b| key(a).total_cmp(&key(b)));
    for c in sorted {
        let mark = match c.front {
            Front::On => "*",
            Front::Near => "~",
            Front::Off | Front::Unknown => "",
        };
        if let Some(failure) = &c.failure {
            rows.push(vec![mark.into(), format!("{}: {failure}", study.label(c))]);
            continue;
        }
        let [time, time_interval] = cells(c.ms(study.time), ms);
        let [ratio, ratio_interval] = cells(c.by_base, |v| format!("{v:.3}"));
        let [rmse, rmse_interval] = cells(c.error.map(|e| e.rmse), scientific);
        let rmse = if is_unresolved(c) { format!("!{rmse}") } else { rmse };
        let [max, relmse] =
            [c.error.map(|e| e.max), c.error.map(|e| e.relmse)].map(|v| or_dash(v, scientific));
        let (mark, name) = (mark.to_owned(), study.label(c));
        rows.push(vec![
            mark,
            name,
            time,
            time_interval,
            ratio,
            ratio_interval,
            rmse,
            rmse_interval,
            max,
            relmse,
        ]);
        if has_cloud {
            let own = rows.len() - 1;
            rows[own].extend(cells(cloud(c), |v| format!("{v:.3}")));
        }
    }
    rows
}

/// Returns the value of a figure and its interval.
fn cells(figure: Option<Figure>, text: impl Fn(f64) -> String) -> [String; 2] {
    [or_dash(figure.map(|f| f.value), &text), interval(figure, &text)]
}

fn ms(value: f64) -> String {
    if value < 10.0 { format!("{value:.2}") } else { format!("{value:.1}") }
}

fn best_line(study: &Study, best: &Best) -> String {
    let metric = study.metric.name();
    let (within, what) = match best.budget {
        Budget::Ms => (format!("{} ms", best.value), "the most exact"),
        Budget::Error => (format!("{} of {metric}", best.value), "the fastest"),
    };
    let Some(c) = best.configuration.and_then(|i| study.configurations.get(i)) else {
        return format!("within {within}: none of them\n");
    };
    let [time, time_interval] = cells(c.ms(study.time), ms);
    let [error, error_interval] = cells(c.error.and_then(|e| study.metric.of(&e)), scientific);
    format!(
        "within {within}, {what}: {}, {time} ms ({time_interval}), {metric} {error} \
         ({error_interval})\n",
        study.label(c)
    )
}
