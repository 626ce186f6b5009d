//! What `nimbus error` prints for people.

use super::output;
use crate::studies::error::front::Metric;
use crate::studies::error::records::{Best, Configuration, Front, Study};
use crate::studies::provenance::{Figure, ReferenceRecord};

/// The whole of it.
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
    out += &output::table(&rows(study));
    out += "\n* on the front  ~ what beats it may be no faster: by less than the intervals";
    if study.configurations.iter().any(|c| c.error.is_some_and(|e| !e.is_resolved)) {
        out += "  ! the reference's own error is more than a tenth of it";
    }
    out.push('\n');
    for best in &study.best {
        out += &best_line(study, best);
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
    let source = if r.from_cache { "kept from an earlier run" } else { "computed now" };
    format!(
        "against {} at {of} pixels of frame {}: RMS {:.3}, itself off by about {own} ({}); {:.1} \
         s, {source}\n",
        r.against, r.frame, r.magnitude, r.accuracy, r.seconds
    )
}

fn rows(study: &Study) -> Vec<Vec<String>> {
    let head = [
        "",
        "configuration",
        &format!("{} ms", study.time),
        "95 %",
        "by base",
        "95 %",
        "RMSE",
        "95 %",
        "max",
        "relMSE",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let time = |c: &Configuration| if study.time == "gpu" { c.gpu_ms } else { c.frame_ms };
    let mut sorted: Vec<&Configuration> = study.configurations.iter().collect();
    let key = |c: &Configuration| time(c).map_or(f64::INFINITY, |t| t.value);
    sorted.sort_by(|a, b| key(a).total_cmp(&key(b)));
    for c in sorted {
        let mark = match c.front {
            Front::On => "*",
            Front::Near => "~",
            Front::Off | Front::Unknown => "",
        };
        if let Some(failure) = &c.failure {
            rows.push(vec![mark.into(), format!("{}: {failure}", c.name)]);
            continue;
        }
        let [ms, ms_interval] = figure(time(c), ms);
        let [ratio, ratio_interval] = figure(c.by_base, |v| format!("{v:.3}"));
        let [rmse, rmse_interval] = figure(c.error.map(|e| e.rmse), small);
        let unresolved = c.error.is_some_and(|e| !e.is_resolved);
        let rmse = if unresolved { format!("!{rmse}") } else { rmse };
        let [max, relmse] = [c.error.map(|e| e.max), c.error.map(|e| e.relmse)]
            .map(|v| v.map_or("-".into(), small));
        rows.push(vec![
            mark.into(),
            c.name.clone(),
            ms,
            ms_interval,
            ratio,
            ratio_interval,
            rmse,
            rmse_interval,
            max,
            relmse,
        ]);
    }
    rows
}

/// A value and its interval.
fn figure(figure: Option<Figure>, text: impl Fn(f64) -> String) -> [String; 2] {
    let Some(Figure { value, low, high }) = figure else { return ["-".into(), "-".into()] };
    let interval = low
        .zip(high)
        .map_or("-".to_owned(), |(low, high)| format!("{} to {}", text(low), text(high)));
    [text(value), interval]
}

fn ms(value: f64) -> String {
    if value < 10.0 { format!("{value:.2}") } else { format!("{value:.1}") }
}

fn small(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.2e}") }
}

fn best_line(study: &Study, best: &Best) -> String {
    let (within, what) = match best.budget.as_str() {
        "ms" => (format!("{} ms", best.value), "the most exact"),
        _ => (format!("{} of {}", best.value, study.metric), "the fastest"),
    };
    let Some(c) = best.configuration.and_then(|i| study.configurations.get(i)) else {
        return format!("within {within}: none of them\n");
    };
    let time = if study.time == "gpu" { c.gpu_ms } else { c.frame_ms };
    let metric = Metric::NAMES
        .iter()
        .find(|(name, _)| *name == study.metric)
        .map_or(Metric::Rmse, |(_, m)| *m);
    let [ms, ms_interval] = figure(time, ms);
    let [error, error_interval] = figure(metric.of(c), small);
    format!(
        "within {within}, {what}: {}, {ms} ms ({ms_interval}), {} {error} ({error_interval})\n",
        c.name, study.metric
    )
}
