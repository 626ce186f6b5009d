//! Parts of one bench, each with its first case, timed one by one and maybe on several nodes: as
//! the bench that they are parts of.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::io::text_file::{TABLE_LIMIT, read_result};
use crate::timing::companions::{names_in, picture_file};
use crate::timing::machine::Clocks;
use crate::timing::recorded::read_results;
use crate::timing::records::{Block, Case, FRAMES_FILE, FrameRow, Mode, Run};
use crate::timing::rows::read_rows;

/// A picture of a part, and what it is called in the whole.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Moved {
    pub i_part: usize,
    pub from: String,
    pub to: String,
}

/// What `run.json` says of a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartRecord {
    /// Its cases, by their place in `cases`: `end` is not one. The first case of all was timed with
    /// them.
    pub first: usize,
    pub end: usize,
    pub node: String,
    /// Its beginning, UTC, ISO 8601.
    pub date: String,
    pub clocks: Clocks,
    /// The first case of all as it was timed here, loop by loop: what tells how far nodes differ.
    pub base: Vec<BaseTime>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BaseTime {
    /// "serial" or "parallel".
    pub threading: String,
    pub skip: bool,
    /// Median frame time, ms; null where nothing finite was measured.
    pub p50_ms: Option<f64>,
}

impl BaseTime {
    /// The loop in words.
    pub fn name(&self) -> String {
        loop_name(&self.threading, self.skip)
    }
}

/// A part as it was read.
#[derive(Debug, Clone)]
pub struct Part {
    /// What it is called where it differs from the others.
    pub name: String,
    pub node: String,
    /// Its cases, from 0 over the whole.
    pub range: Range<usize>,
    pub run: Run,
    pub pass_names: Vec<String>,
    pub rows: Vec<FrameRow>,
    /// Names of the pictures that lie beside them.
    pub pictures: Vec<String>,
}

/// All parts together.
#[derive(Debug, Clone)]
pub struct Joined {
    pub run: Run,
    pub pass_names: Vec<String>,
    pub rows: Vec<FrameRow>,
    pub pictures: Vec<Moved>,
}

/// Which cases a part times, in its order: the first of all, then its own.
pub fn numbers(range: &Range<usize>) -> Vec<usize> {
    (range.start > 0).then_some(0).into_iter().chain(range.clone()).collect()
}

impl Part {
    /// Reads what `nimbus bench --part` left in `folder`.
    pub fn read(folder: &Path, name: String, node: String, range: Range<usize>) -> Result<Part> {
        let run = read_results(folder)?.run;
        let path = folder.join(FRAMES_FILE);
        let (pass_names, rows) = read_rows(&read_result(&path, TABLE_LIMIT)?, &path)?;
        let (n, wanted) = (run.cases.len(), numbers(&range).len());
        if n != wanted {
            let what = format!(
                "{n} cases; cases {}..{} are {wanted} with the first",
                range.start, range.end
            );
            return Err(Error::io(folder, what));
        }
        if let Some(row) = rows.iter().find(|row| !is_of_its_block(row, &run)) {
            return Err(Error::io(
                &path,
                format!("a row is not of block {} as run.json names it", row.block),
            ));
        }
        Ok(Part { name, node, range, run, pass_names, rows, pictures: names_in(folder) })
    }

    fn record(&self) -> PartRecord {
        let of = |m: &Mode| BaseTime {
            threading: m.threading.clone(),
            skip: m.skip,
            p50_ms: m.frame_ms.map(|measured| measured.of.p50),
        };
        PartRecord {
            first: self.range.start,
            end: self.range.end,
            node: self.node.clone(),
            date: self.run.date.clone(),
            clocks: self.run.clocks,
            base: self
                .run
                .cases
                .first()
                .map_or_else(Vec::new, |case| case.modes.iter().map(of).collect()),
        }
    }
}

fn is_of_its_block(row: &FrameRow, run: &Run) -> bool {
    run.block_order.get(row.block).is_some_and(|block| {
        let is_case = |case: &Case| {
            (
                case.phase.as_deref().unwrap_or_default(),
                crate::timing::cases::sweep_text(&case.sweep),
            ) == (&row.phase[..], row.sweep.clone())
        };
        (&block.threading, block.skip) == (&row.threading, row.skip)
            && run.cases.get(block.case).is_some_and(is_case)
    })
}

/// What differs between parts that has to be the same: times of two devices, drivers or builds are
/// no bench's. That shaders and arguments are the same is known by whoever had the parts made.
pub fn differences(parts: &[Part]) -> Vec<String> {
    let Some(first) = parts.first() else { return vec!["there is no part".to_owned()] };
    let mut all = BTreeSet::new();
    for part in &parts[1..] {
        let said =
            identity(first).into_iter().zip(identity(part)).filter(|(ours, theirs)| ours != theirs);
        all.extend(said.map(|((what, ours), (_, theirs))| {
            format!("{what}: {ours} of {}, {theirs} of {}", first.name, part.name)
        }));
    }
    let mut next = 0;
    for Part { name, range, .. } in parts {
        if range.start != next {
            all.insert(format!("cases: {name} begins with case {}, expected {next}", range.start));
        }
        next = range.end;
    }
    all.into_iter().collect()
}

/// All that has to be the same, in words.
fn identity(part: &Part) -> Vec<(&'static str, String)> {
    let Run { nimbus, revision, scene_hash, device, cpu, environment, command, cases, .. } =
        &part.run;
    let base = cases.first();
    let of_base = |text: &dyn Fn(&Case) -> String| base.map_or_else(|| "none".to_owned(), text);
    let each = |c: &Case, text: &dyn Fn(&Mode) -> String| {
        c.modes.iter().map(text).collect::<Vec<_>>().join("; ")
    };
    let is_asked = |option: &str| command.iter().any(|word| word == option).to_string();
    let loops = |c: &Case| {
        each(c, &|m| {
            format!(
                "{}, particles by the {}, {} frames",
                loop_name(&m.threading, m.skip),
                m.simulate,
                m.frames
            )
        })
    };
    let of_modes = |of: fn(&Mode) -> usize| {
        let all: BTreeSet<usize> = cases.iter().flat_map(|c| &c.modes).map(of).collect();
        all.iter().map(usize::to_string).collect::<Vec<_>>().join(" and ")
    };
    let last_frames = |c: &Case| {
        each(c, &|m| {
            m.image_hash
                .as_deref()
                .map_or_else(|| "unknown".to_owned(), |h| h.chars().take(12).collect())
        })
    };
    vec![
        ("version", nimbus.clone()),
        ("build", revision.clone()),
        ("scene", scene_hash.clone()),
        ("device", device.class()),
        ("processor", cpu.class()),
        ("environment", format!("{environment:?}")),
        ("validation", is_asked("--validation")),
        ("poison", is_asked("--poison")),
        ("passes", part.pass_names.join(", ")),
        ("first case", of_base(&Case::name)),
        ("scene of the first case", of_base(&|c| c.scene_hash.clone())),
        ("particles of the first case", of_base(&|c| c.particles.to_string())),
        ("size of the first case", of_base(&|c| format!("{}x{}", c.width, c.height))),
        ("loops of the first case", of_base(&loops)),
        ("last frames of the first case", of_base(&last_frames)),
        ("blocks of a loop", of_modes(|m| m.blocks)),
        ("warm-up frames of a block", of_modes(|m| m.warm_up)),
    ]
}

fn loop_name(threading: &str, skip: bool) -> String {
    if skip { threading.to_owned() } else { format!("{threading} no-skip") }
}

/// All of them as one bench, with all cases in order and the first as the first part timed it;
/// blocks follow each other part by part. `parts` do not differ; none of no part.
pub fn join(parts: &[Part]) -> Option<Joined> {
    let first = parts.first()?;
    let n_cases: usize = parts.iter().map(|part| part.range.len()).sum();
    let mut run = Run {
        block_order: Vec::new(),
        cases: Vec::new(),
        chosen: Vec::new(),
        parts: parts.iter().map(Part::record).collect(),
        interrupted: parts.iter().any(|part| part.run.interrupted),
        ..first.run.clone()
    };
    let (mut rows, mut pictures) = (Vec::new(), Vec::new());
    for (i_part, part) in parts.iter().enumerate() {
        let numbers = numbers(&part.range);
        // Places of its cases in the whole. The first of all is every part's, and stays as the
        // first one had it.
        let place = |i: usize| numbers.get(i).copied().filter(|_| i > 0 || i_part == 0);
        let mut block_places = Vec::new();
        for block in &part.run.block_order {
            let case = place(block.case);
            block_places.push(case.map(|_| run.block_order.len()));
            run.block_order.extend(case.map(|case| Block { case, ..block.clone() }));
        }
        rows.extend(part.rows.iter().filter_map(|row| {
            block_places
                .get(row.block)
                .copied()
                .flatten()
                .map(|block| FrameRow { block, ..row.clone() })
        }));
        run.chosen.extend(
            chosen(&part.run, n_cases)
                .into_iter()
                .filter(|(i, _)| place(*i).is_some())
                .map(|(_, t)| t),
        );
        for (i, case) in part.run.cases.iter().enumerate() {
            let (Some(k), from) = (place(i), picture_file(i)) else { continue };
            run.cases.push(case.clone());
            if part.pictures.contains(&from) {
                pictures.push(Moved { i_part, from, to: picture_file(k) });
            }
        }
    }
    Some(Joined { run, pass_names: first.pass_names.clone(), rows, pictures })
}

/// What each "auto" came to, with the number of its case: a run of several cases says its name
/// before it.
fn chosen(run: &Run, n_cases: usize) -> Vec<(usize, String)> {
    let names: Vec<String> = run.cases.iter().map(Case::name).collect();
    if let ([name], true) = (&names[..], n_cases > 1) {
        return run.chosen.iter().map(|text| (0, format!("{name}: {text}"))).collect();
    }
    let of = |text: &String| {
        let is_of = |name: &str| text.strip_prefix(name).is_some_and(|rest| rest.starts_with(": "));
        // A name may begin as another one does.
        let of = names
            .iter()
            .enumerate()
            .filter(|(_, name)| is_of(name))
            .max_by_key(|(_, name)| name.len());
        (of.map_or(0, |(i, _)| i), text.clone())
    };
    run.chosen.iter().map(of).collect()
}

/// By how much the nodes differ: the greatest median frame time of the first case by the least over
/// all parts, loop by loop. None of a loop that fewer than two parts have times of.
pub fn base_spread(parts: &[PartRecord]) -> Vec<(String, f64)> {
    let Some(first) = parts.first() else { return Vec::new() };
    let of = |base: &BaseTime| {
        let is_same =
            |other: &&BaseTime| (&other.threading, other.skip) == (&base.threading, base.skip);
        let all = parts
            .iter()
            .filter_map(|part| part.base.iter().find(is_same)?.p50_ms)
            .filter(|ms| *ms > 0.0);
        let (least, greatest, n) =
            all.fold((f64::INFINITY, 0.0_f64, 0), |(l, g, n), ms| (l.min(ms), g.max(ms), n + 1));
        (n > 1).then(|| (base.name(), greatest / least))
    };
    first.base.iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests;
