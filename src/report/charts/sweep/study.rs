//! The time and the error of a study against its knobs.

use super::{SweepChart, SweptFigure, charts, numbers};
use crate::measure::figure::Figure;
use crate::report::charts::error::{error_of, metric_name, time_of};
use crate::studies::error::records::{Configuration, Study};
use crate::timing::names::Setting;

/// Returns the charts of a study: its time and its error against each knob. The unchanged scene is
/// the point at its own values.
pub fn charts_of_study(study: &Study) -> Vec<SweepChart> {
    let mut shapes: Vec<Vec<&str>> = Vec::new();
    for c in &study.configurations {
        let shape = keys_of(c);
        if !shape.is_empty() && !shapes.contains(&shape) {
            shapes.push(shape);
        }
    }
    let time = format!("{} time of a frame, ms", study.time.name());
    let mut all = Vec::new();
    for shape in shapes {
        let chosen = study.configurations.iter().filter(|c| keys_of(c) == shape);
        let base = study.configurations.first().zip(base_point(study, &shape));
        let points: Vec<(&Configuration, Vec<Setting>)> =
            base.into_iter().chain(chosen.map(|c| (c, c.settings.clone()))).collect();
        let of = |figure: fn(&Study, &Configuration) -> Option<Figure>| -> Vec<SweptFigure> {
            let swept = |(c, point): &(&Configuration, Vec<Setting>)| {
                let (point, series) = (point.clone(), String::new());
                Some(SweptFigure { point, series, figure: figure(study, c)? })
            };
            points.iter().filter_map(swept).collect()
        };
        all.extend(charts("Time", &time, &of(time_of)));
        all.extend(charts("Error", metric_name(study.metric), &of(error_of)));
    }
    all
}

/// Returns the keys that a configuration sets.
fn keys_of(configuration: &Configuration) -> Vec<&str> {
    configuration.settings.iter().map(|s| s.key.as_str()).collect()
}

/// Returns the point of the unchanged scene among the configurations that set these keys. `None`
/// if it has no place there: of several keys, each value must be one that the study tries, and a
/// word such as "auto" has no place among numbers.
fn base_point(study: &Study, shape: &[&str]) -> Option<Vec<Setting>> {
    let own_settings = study.base_settings();
    let setting = |key: &&str| {
        let own = own_settings.iter().find(|s| s.key == *key)?;
        let of_shape = study.configurations.iter().filter(|c| keys_of(c) == shape);
        let tried: Vec<String> = of_shape
            .flat_map(|c| &c.settings)
            .filter(|s| s.key == *key)
            .map(|s| s.value.clone())
            .collect();
        // A value that is tried, too, is shown as it was typed.
        let typed = tried.iter().find(|value| is_same(value, &own.value));
        if typed.is_none() && shape.len() > 1 {
            return None;
        }
        let value = typed.unwrap_or(&own.value).clone();
        let fits = |values: &[String]| numbers(key, values).is_some();
        let mut distinct = tried;
        distinct.sort_unstable();
        distinct.dedup();
        let is_lost = fits(&distinct) && !fits(std::slice::from_ref(&value));
        (!is_lost).then(|| Setting { key: own.key.clone(), value })
    };
    shape.iter().map(setting).collect()
}

/// Returns whether two values as `--set` takes them are the same: 4 and 4.0, tiles and "tiles".
fn is_same(a: &str, b: &str) -> bool {
    let bare = |text: &str| text.replace(['"', '\'', ' '], "");
    match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => a == b,
        _ => bare(a) == bare(b),
    }
}
