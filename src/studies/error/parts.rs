//! Joins the parts of a study that several processes made, each with the unchanged scene.

use super::blocks::TimedBlock;
use super::records::{Configuration, Study};
use super::study::StudyResults;
use crate::timing::attachments::PictureCopy;
use crate::timing::difference::{Facts, fact_differences, short};

/// A part as it was read.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name of the part in messages.
    pub name: String,
    /// Its record.
    pub study: Study,
    /// Its configurations and blocks.
    pub results: StudyResults,
}

/// All parts as one study.
#[derive(Debug, Clone)]
pub struct Joined {
    /// The joined record.
    pub study: Study,
    /// The joined results.
    pub results: StudyResults,
    /// The pictures to copy.
    pub pictures: Vec<PictureCopy>,
}

impl Part {
    /// Returns the facts that all parts of a study must share.
    fn facts(&self) -> Facts {
        let Study { made, reference, metric, time, frames, rounds, as_played, .. } = &self.study;
        let base = self.study.configurations.first();
        let base_error = base.and_then(|c| c.error.map(|e| e.rmse.value));
        vec![
            ("build", made.code.clone()),
            ("scene", made.scene_hash.clone()),
            ("device", made.device.class()),
            ("processor", made.cpu.class()),
            ("environment", format!("{:?}", made.environment)),
            ("reference", short(&reference.hash)),
            ("time that decides", time.name().to_owned()),
            ("error that decides", metric.name().to_owned()),
            ("frames of a turn", frames.to_string()),
            ("rounds", rounds.to_string()),
            ("as played", as_played.to_string()),
            ("error of the scene as it stands", format!("{base_error:?}")),
        ]
    }
}

/// Lists the differences between parts that prevent joining them: times of two devices, drivers or
/// builds do not make one study.
pub fn differences(parts: &[Part]) -> Vec<String> {
    let facts: Vec<(&str, Facts)> = parts.iter().map(|p| (&p.name[..], p.facts())).collect();
    fact_differences(&facts).into_iter().collect()
}

/// Joins parts without [`differences`]: their configurations in order, and their blocks in the
/// rounds of their parts, each with the blocks of the unchanged scene around it. None for no
/// part.
pub fn join(parts: &[Part]) -> Option<Joined> {
    let first = parts.first()?;
    let (mut configurations, mut blocks) = (Vec::<Configuration>::new(), Vec::<TimedBlock>::new());
    let mut pictures = Vec::new();
    for (i_part, part) in parts.iter().enumerate() {
        let mut numbers = Vec::new();
        for (i, c) in part.results.configurations.iter().enumerate() {
            // Two settings that result in one scene are one configuration; the later one is left
            // out. The unchanged scene is the first configuration of every part.
            let is_known = configurations.iter().any(|other| other.hash == c.hash);
            let k = configurations.len();
            let is_base = i == 0 && i_part > 0;
            numbers.push(if is_base { Some(0) } else { (!is_known).then_some(k) });
            if is_known {
                continue;
            }
            let mut c = c.clone();
            for (name, to) in [
                (&mut c.picture, format!("picture-{k}.png")),
                (&mut c.error_map, format!("error-{k}.png")),
            ] {
                if let Some(name) = name {
                    let from = std::mem::replace(name, to.clone());
                    pictures.push(PictureCopy { i_part, from, to });
                }
            }
            configurations.push(c);
        }
        blocks.extend(part.results.blocks.iter().filter_map(|block| {
            let i_configuration = (*numbers.get(block.i_configuration)?)?;
            Some(TimedBlock { i_configuration, ..block.clone() })
        }));
    }
    let n_rounds = parts.iter().map(|part| part.results.n_rounds).max().unwrap_or(0);
    let mut results = StudyResults { configurations, blocks, n_rounds };
    results.summarize(first.study.time, first.study.metric);
    let study = Study {
        configurations: results.configurations.clone(),
        rounds: n_rounds,
        interrupted: parts.iter().any(|part| part.study.interrupted),
        best: Vec::new(),
        ..first.study.clone()
    };
    Some(Joined { study, results, pictures })
}
