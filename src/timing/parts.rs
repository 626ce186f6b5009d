//! Joins the parts of a bench that several processes timed, each with the first case of all.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use super::attachments::{PictureCopy, picture_file};
use super::difference::{Facts, fact_differences, short};
use super::frame_rows::{FRAMES_FILE, FrameRow, FrameTable, parse_frames};
use super::intervals::spread;
use super::json;
use super::names::sweep_text;
use super::records::{BaseTime, Block, Case, Mode, PartRecord, Run};
use super::results;
use super::state::{STATE_FILE, StateRow, parse_rows};
use crate::error::{Error, Result};
use crate::io::text_file::{TABLE_LIMIT, read_result};

/// A part as it was read.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name of the part in messages.
    pub name: String,
    /// Node that timed it.
    pub node: String,
    /// Its cases, by their numbers in the whole bench.
    pub range: Range<usize>,
    /// Its `run.json`.
    pub run: Run,
    /// Its `frames.csv`.
    pub table: FrameTable,
    /// Its `state.csv`; empty if there is none.
    pub state: Vec<StateRow>,
    /// Names of its pictures and charts.
    pub pictures: Vec<String>,
}

/// All parts as one bench.
#[derive(Debug, Clone)]
pub struct Joined {
    /// The joined record.
    pub run: Run,
    /// The joined rows.
    pub table: FrameTable,
    /// The readings of the parts' blocks. Times count from the start of each part.
    pub state: Vec<StateRow>,
    /// The pictures to copy.
    pub pictures: Vec<PictureCopy>,
}

/// Returns the numbers of the cases that a part times, in order: the first case of all, then its
/// own.
pub fn numbers(range: &Range<usize>) -> Vec<usize> {
    (range.start > 0).then_some(0).into_iter().chain(range.clone()).collect()
}

impl Part {
    /// Reads what `nimbus bench --part` wrote to `folder`.
    ///
    /// # Errors
    /// Fails if the results cannot be read, or are not those of the cases of `range`.
    pub fn read(folder: &Path, name: String, node: String, range: Range<usize>) -> Result<Part> {
        let run: Run = json::read(folder)?;
        let path = folder.join(FRAMES_FILE);
        let table = parse_frames(&read_result(&path, TABLE_LIMIT)?, &path)?;
        let run = results::join(run, &table, &path)?.run;
        let (n, n_expected) = (run.cases.len(), numbers(&range).len());
        if n != n_expected {
            let Range { start, end } = range;
            let what = format!("{n} cases; cases {start}..{end} are {n_expected} with the first");
            return Err(Error::io(folder, what));
        }
        if let Some(row) = table.rows.iter().find(|row| !is_of_its_block(row, &run)) {
            let what = format!("a row is not of block {} as run.json names it", row.block);
            return Err(Error::io(&path, what));
        }
        let pictures = (0..run.cases.len()).map(picture_file);
        let pictures = pictures.filter(|name| folder.join(name).exists()).collect();
        let path = folder.join(STATE_FILE);
        let state = match path.exists() {
            true => parse_rows(&read_result(&path, TABLE_LIMIT)?, &path)?,
            false => vec![],
        };
        Ok(Part { name, node, range, run, table, state, pictures })
    }

    fn record(&self) -> PartRecord {
        let base = |m: &Mode| BaseTime {
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
            base: self.run.cases.iter().take(1).flat_map(|c| &c.modes).map(base).collect(),
            state: self.run.state.clone(),
        }
    }

    /// Returns the facts that all parts of a bench must share: times of two devices, drivers or
    /// builds do not make one bench. The shaders and arguments are the caller's to compare.
    fn facts(&self) -> Facts {
        let Run { nimbus, revision, scene_hash, device, cpu, environment, command, cases, .. } =
            &self.run;
        let of_base =
            |text: &dyn Fn(&Case) -> String| cases.first().map_or_else(|| "none".to_owned(), text);
        let each_mode = |text: &dyn Fn(&Mode) -> String| {
            of_base(&|c| c.modes.iter().map(text).collect::<Vec<_>>().join("; "))
        };
        let has = |option: &str| command.iter().any(|word| word == option).to_string();
        let of_modes = |of: fn(&Mode) -> usize| {
            let all: BTreeSet<usize> = cases.iter().flat_map(|c| &c.modes).map(of).collect();
            all.iter().map(usize::to_string).collect::<Vec<_>>().join(" and ")
        };
        let loops = |m: &Mode| {
            format!("{}, particles by the {}, {} frames", m.name(), m.simulate, m.frames)
        };
        let last_frame = |m: &Mode| m.image_hash.as_deref().map_or("unknown".to_owned(), short);
        vec![
            ("version", nimbus.clone()),
            ("build", revision.clone()),
            ("scene", scene_hash.clone()),
            ("device", device.class()),
            ("processor", cpu.class()),
            ("environment", format!("{environment:?}")),
            ("validation", has("--validation")),
            ("guard bands", has("--guard")),
            ("limit of a submission", value_of(command, "--max-submit-ms")),
            ("times of passes", self.run.clocks.pass_times.name().to_owned()),
            ("cold caches", format!("{:?}", self.run.cold_bytes)),
            ("passes", self.table.pass_names.join(", ")),
            ("first case", of_base(&Case::name)),
            ("scene of the first case", of_base(&|c| c.scene_hash.clone())),
            ("particles of the first case", of_base(&|c| c.particles.to_string())),
            ("size of the first case", of_base(&|c| format!("{}x{}", c.width, c.height))),
            ("loops of the first case", each_mode(&loops)),
            ("last frames of the first case", each_mode(&last_frame)),
            ("blocks of a loop", of_modes(|m| m.blocks)),
            ("warm-up frames of a block", of_modes(|m| m.warm_up)),
        ]
    }
}

/// Returns the value that a command gives to an option, or "default".
fn value_of(command: &[String], option: &str) -> String {
    let after = command.iter().position(|word| word == option).and_then(|i| command.get(i + 1));
    let joined = || command.iter().find_map(|word| word.strip_prefix(option)?.strip_prefix('='));
    after.map(String::as_str).or_else(joined).unwrap_or("default").to_owned()
}

fn is_of_its_block(row: &FrameRow, run: &Run) -> bool {
    run.block_order.get(row.block as usize).is_some_and(|block| {
        let is_case = |case: &Case| {
            case.phase.as_deref().unwrap_or_default() == row.phase
                && sweep_text(&case.sweep) == row.sweep
        };
        (&block.threading, block.skip) == (&row.threading, row.skip)
            && run.cases.get(block.case).is_some_and(is_case)
    })
}

/// Lists the differences between parts that prevent joining them.
pub fn differences(parts: &[Part]) -> Vec<String> {
    let facts: Vec<(&str, Facts)> = parts.iter().map(|p| (&p.name[..], p.facts())).collect();
    let mut all = fact_differences(&facts);
    let mut next = 0;
    for Part { name, range, .. } in parts {
        if range.start != next {
            all.insert(format!("cases: {name} begins with case {}, expected {next}", range.start));
        }
        next = range.end;
    }
    all.into_iter().collect()
}

/// Joins parts without [`differences`]: all cases in order, the first as the first part timed it,
/// and the blocks of one part after those of another. None for no part.
pub fn join(parts: &[Part]) -> Option<Joined> {
    let first = parts.first()?;
    let n_cases: usize = parts.iter().map(|part| part.range.len()).sum();
    let mut run = Run {
        block_order: Vec::new(),
        cases: Vec::new(),
        chosen: Vec::new(),
        parts: parts.iter().map(Part::record).collect(),
        interrupted: parts.iter().any(|part| part.run.interrupted),
        // Each part has its own.
        state: None,
        ..first.run.clone()
    };
    let (mut rows, mut state, mut pictures) = (Vec::new(), Vec::new(), Vec::new());
    for (i_part, part) in parts.iter().enumerate() {
        let numbers = numbers(&part.range);
        // The number of a case in the whole. Only the first part keeps the first case of all.
        let number = |i: usize| numbers.get(i).copied().filter(|_| i > 0 || i_part == 0);
        let mut block_numbers = Vec::new();
        for block in &part.run.block_order {
            let case = number(block.case);
            block_numbers.push(case.map(|_| run.block_order.len() as u32));
            run.block_order.extend(case.map(|case| Block { case, ..block.clone() }));
        }
        rows.extend(part.table.rows.iter().filter_map(|row| {
            let block = (*block_numbers.get(row.block as usize)?)?;
            Some(FrameRow { block, ..row.clone() })
        }));
        // Readings before the first block are of no block.
        state.extend(part.state.iter().filter_map(|row| {
            let block = (*block_numbers.get(row.block? as usize)?)?;
            Some(StateRow { block: Some(block), ..row.clone() })
        }));
        let chosen = chosen_by_case(&part.run, n_cases).into_iter();
        run.chosen.extend(chosen.filter(|(i, _)| number(*i).is_some()).map(|(_, text)| text));
        for (i, case) in part.run.cases.iter().enumerate() {
            let (Some(k), from) = (number(i), picture_file(i)) else { continue };
            run.cases.push(case.clone());
            if part.pictures.contains(&from) {
                pictures.push(PictureCopy { i_part, from, to: picture_file(k) });
            }
        }
    }
    let table = FrameTable { pass_names: first.table.pass_names.clone(), rows };
    Some(Joined { run, table, state, pictures })
}

/// Returns what "auto" chose, with the number of the case. In a run of several cases each text
/// begins with the name of its case.
fn chosen_by_case(run: &Run, n_cases: usize) -> Vec<(usize, String)> {
    let names: Vec<String> = run.cases.iter().map(Case::name).collect();
    if let ([name], true) = (&names[..], n_cases > 1) {
        return run.chosen.iter().map(|text| (0, format!("{name}: {text}"))).collect();
    }
    let of = |text: &String| {
        let is_of = |name: &str| text.strip_prefix(name).is_some_and(|rest| rest.starts_with(": "));
        // One name can be the beginning of another.
        let named = names.iter().enumerate().filter(|(_, name)| is_of(name));
        (named.max_by_key(|(_, name)| name.len()).map_or(0, |(i, _)| i), text.clone())
    };
    run.chosen.iter().map(of).collect()
}

/// Returns, for every loop, how far the nodes differ: the greatest median frame time of the first
/// case divided by the least. Loops that fewer than two parts timed are left out.
pub fn base_spread(parts: &[PartRecord]) -> Vec<(String, f64)> {
    let Some(first) = parts.first() else { return Vec::new() };
    let of = |base: &BaseTime| {
        let find = |part: &PartRecord| part.base.iter().find(|b| b.name() == base.name())?.p50_ms;
        let all: Vec<f64> = parts.iter().filter_map(find).filter(|ms| *ms > 0.0).collect();
        Some((base.name(), spread(&all)?))
    };
    first.base.iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests;
