//! Parts of one study, each with the scene as it stands, made one by one: as the study that they
//! are parts of.

use std::collections::BTreeSet;

use super::front::Metric;
use super::records::{Configuration, Study};
use super::run::Found;
use super::turns::{Time, Turn};
use crate::timing::attachments::PictureCopy;

/// A part as it was read, and what it is called where it differs from the others.
#[derive(Debug, Clone)]
pub struct Part {
    pub name: String,
    pub study: Study,
    pub found: Found,
}

/// What differs between parts that has to be the same: times of two devices, drivers or builds are
/// no study's.
pub fn differences(parts: &[Part]) -> Vec<String> {
    let Some(first) = parts.first() else { return vec!["there is no part".to_owned()] };
    let mut all = BTreeSet::new();
    for part in &parts[1..] {
        let (a, b) = (&first.study, &part.study);
        let (made, other) = (&a.made, &b.made);
        let reference = |study: &Study| study.reference.hash.chars().take(12).collect::<String>();
        let bases = [a, b]
            .map(|study| study.configurations.first().and_then(|c| c.error.map(|e| e.rmse.value)));
        let said = [
            ("build", made.code.clone(), other.code.clone()),
            ("scene", made.scene_hash.clone(), other.scene_hash.clone()),
            ("device", made.device.class(), other.device.class()),
            ("processor", made.cpu.class(), other.cpu.class()),
            ("environment", format!("{:?}", made.environment), format!("{:?}", other.environment)),
            ("reference", reference(a), reference(b)),
            ("time that decides", a.time.clone(), b.time.clone()),
            ("error that decides", a.metric.clone(), b.metric.clone()),
            ("frames of a turn", a.frames.to_string(), b.frames.to_string()),
            ("rounds", a.rounds.to_string(), b.rounds.to_string()),
            ("as played", a.as_played.to_string(), b.as_played.to_string()),
            (
                "error of the scene as it stands",
                format!("{:?}", bases[0]),
                format!("{:?}", bases[1]),
            ),
        ];
        for (what, ours, theirs) in said.into_iter().filter(|(_, ours, theirs)| ours != theirs) {
            all.insert(format!("{what}: {ours} of {}, {theirs} of {}", first.name, part.name));
        }
    }
    all.into_iter().collect()
}

/// All of them as one study, whose configurations are in the parts' order, and what its pictures
/// are called. `parts` do not differ, and there is one. Turns stay in the rounds of their parts,
/// each beside those of the scene as it stands that it was taken with.
pub fn join(parts: &[Part]) -> Option<(Study, Found, Vec<PictureCopy>)> {
    let first = parts.first()?;
    let (mut configurations, mut turns): (Vec<Configuration>, Vec<Turn>) = (Vec::new(), Vec::new());
    let mut moved = Vec::new();
    for (i_part, part) in parts.iter().enumerate() {
        let mut places = Vec::new();
        for (i, c) in part.found.configurations.iter().enumerate() {
            let known = configurations.iter().any(|other| other.hash == c.hash);
            // Two settings that come to the same scene are one configuration. The scene as it
            // stands is every part's first.
            places.push(if i == 0 && i_part > 0 {
                Some(0)
            } else {
                (!known).then_some(configurations.len())
            });
            if known {
                continue;
            }
            let mut c = c.clone();
            let k = configurations.len();
            for (name, to) in [
                (&mut c.picture, format!("picture-{k}.png")),
                (&mut c.error_map, format!("error-{k}.png")),
            ] {
                if let Some(from) = name.replace(to.clone()) {
                    moved.push(PictureCopy { i_part, from, to });
                } else {
                    *name = None;
                }
            }
            configurations.push(c);
        }
        let place = |turn: &Turn| places.get(turn.i_configuration).copied().flatten();
        turns.extend(part.found.turns.iter().filter_map(|turn| {
            place(turn).map(|i_configuration| Turn { i_configuration, ..turn.clone() })
        }));
    }
    let mut study = first.study.clone();
    let n_rounds = parts.iter().map(|part| part.found.n_rounds).max().unwrap_or(0);
    let mut found = Found { configurations, turns, n_rounds };
    let time = Time::NAMES
        .iter()
        .find(|(name, _)| *name == study.time)
        .map_or(Time::Frame, |(_, time)| *time);
    let metric = Metric::NAMES
        .iter()
        .find(|(name, _)| *name == study.metric)
        .map_or(Metric::Rmse, |(_, m)| *m);
    found.sum_up(time, metric);
    (study.configurations, study.rounds) = (found.configurations.clone(), n_rounds);
    study.interrupted = parts.iter().any(|part| part.study.interrupted);
    study.best = Vec::new();
    Some((study, found, moved))
}
