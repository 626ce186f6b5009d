//! The order of a bench's blocks: rounds, in which every case runs once in each of its loops.

use std::ops::Range;

use super::cases::{Case, Loop};
use super::precision::{Precision, n_segments};
use crate::measure::random::SplitMix64;

/// How many rounds a bench has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rounds {
    /// This many of all frames, in the order A B, B A, A B, …, so that a drift over the run (heat,
    /// other processes) affects all alike.
    Fixed(u32),
    /// As many as a precision needs. A block has one segment of a case's frames; cases, loops and
    /// segments are in random order.
    Until(Precision),
}

/// A block that is to run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlannedBlock {
    /// Number of the case.
    pub i_case: usize,
    /// The loop.
    pub of: Loop,
    /// Its timed frames, counted from the case's first.
    pub frames: Range<u32>,
    /// Whether this is the last block of its case in the round.
    pub is_last_in_round: bool,
}

/// Returns the blocks of round `i_round`, of the cases that are `open`.
pub fn round(cases: &[Case], rounds: Rounds, i_round: u32, open: &[bool]) -> Vec<PlannedBlock> {
    let mut order: Vec<(usize, Vec<Loop>)> = cases
        .iter()
        .enumerate()
        .filter(|(i, _)| open.get(*i).copied().unwrap_or(false))
        .map(|(i, case)| (i, case.loops.clone()))
        .collect();
    match rounds {
        Rounds::Fixed(_) if i_round % 2 == 1 => {
            order.reverse();
            order.iter_mut().for_each(|(_, loops)| loops.reverse());
        }
        Rounds::Fixed(_) => {}
        Rounds::Until(Precision { seed, .. }) => {
            let mut random = SplitMix64::of([seed, u64::from(i_round)]);
            random.shuffle(&mut order);
            order.iter_mut().for_each(|(_, loops)| random.shuffle(loops));
        }
    }
    let of_case = |(i_case, loops): (usize, Vec<Loop>)| {
        let frames = frames(&cases[i_case], i_case, rounds, i_round);
        let n = loops.len();
        loops.into_iter().enumerate().map(move |(k, of)| PlannedBlock {
            i_case,
            of,
            frames: frames.clone(),
            is_last_in_round: k + 1 == n,
        })
    };
    order.into_iter().flat_map(of_case).collect()
}

/// Returns the frames of a case in a round. All its loops have the same ones, so that their ratio
/// can be taken round by round.
///
/// A cycle of rounds has all segments, the last one at its end: the case's pictures are those of
/// its last frame.
fn frames(case: &Case, i_case: usize, rounds: Rounds, i_round: u32) -> Range<u32> {
    let Rounds::Until(Precision { seed, .. }) = rounds else { return 0..case.n_frames };
    let n = n_segments(case.n_frames);
    let mut order: Vec<u32> = (0..n).collect();
    let cycle = u64::from(i_round / n);
    SplitMix64::of([seed, i_case as u64, cycle]).shuffle(&mut order[..n as usize - 1]);
    let k = order[(i_round % n) as usize];
    let edge = |k: u32| (u64::from(case.n_frames) * u64::from(k) / u64::from(n)) as u32;
    edge(k)..edge(k + 1)
}

/// Returns the number of frames of the first `n_rounds` rounds, warm-up included.
pub fn n_frames_of(cases: &[Case], rounds: Rounds, n_rounds: u32, n_warm_up: u32) -> u64 {
    let of = |case: &Case| {
        let a_round = match rounds {
            Rounds::Fixed(_) => f64::from(case.n_frames),
            // Whole cycles; a bench ends with one.
            Rounds::Until(_) => f64::from(case.n_frames) / f64::from(n_segments(case.n_frames)),
        };
        let frames = f64::from(n_rounds) * (a_round + f64::from(n_warm_up));
        case.loops.len() as f64 * frames
    };
    cases.iter().map(of).sum::<f64>() as u64
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::model::scene::Threading::{self, Parallel, Serial};
    use crate::timing::cases::{LoopChoice, cases};

    fn choice(modes: &[Threading], saved: bool) -> LoopChoice<'_> {
        LoopChoice { modes, skip: true, saved }
    }

    fn loaded(n: u32) -> Vec<Case> {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
        let loaded = crate::io::scene_file::load(&path, &[], None).unwrap();
        cases(loaded, &[], Some(n), choice(&[Serial, Parallel], n > 5))
    }

    fn all(cases: &[Case], rounds: Rounds, n: u32) -> Vec<PlannedBlock> {
        (0..n).flat_map(|i| round(cases, rounds, i, &vec![true; cases.len()])).collect()
    }

    #[test]
    fn rounds_alternate_their_order() {
        let names = |cases: &[Case], n| -> String {
            let of = |b: PlannedBlock| format!("{}{} ", b.i_case, b.of.name());
            all(cases, Rounds::Fixed(n), n).into_iter().map(of).collect()
        };
        assert_eq!(names(&loaded(5), 3), "0serial 0parallel 0parallel 0serial 0serial 0parallel ");
        let two = [loaded(6), loaded(5)].concat();
        let there = ["0serial", "0parallel", "0serial no-skip", "1serial", "1parallel"];
        let back = there.iter().rev();
        assert_eq!(
            names(&two, 2).trim_end(),
            there.iter().chain(back).copied().collect::<Vec<_>>().join(" ")
        );
        assert_eq!(n_frames_of(&two, Rounds::Fixed(2), 2, 2), 2 * (3 * 8 + 2 * 7));
        let open = round(&two, Rounds::Fixed(2), 0, &[false, true]);
        assert_eq!(open.iter().map(|b| b.i_case).collect::<Vec<_>>(), [1, 1]);
        assert_eq!(open.iter().map(|b| b.is_last_in_round).collect::<Vec<_>>(), [false, true]);
    }

    fn until(seed: u64) -> Rounds {
        Rounds::Until(Precision { wanted: 0.01, seed, limit: Duration::from_secs(1) })
    }

    #[test]
    fn a_cycle_times_every_frame_once_in_every_loop() {
        // 100 frames in 8 segments of 12 or 13.
        let scene = loaded(100);
        let of_cycle = all(&scene, until(7), 8);
        for of in &scene[0].loops {
            let blocks = of_cycle.iter().filter(|b| b.of == *of);
            let mut frames: Vec<u32> = blocks.flat_map(|b| b.frames.clone()).collect();
            frames.sort_unstable();
            assert_eq!(frames, (0..100).collect::<Vec<_>>());
        }
        assert!(of_cycle[21..].iter().all(|b| b.frames == (87..100)), "the last frames end it");
        assert_eq!(n_frames_of(&scene, until(7), 16, 4), 3 * 2 * (100 + 8 * 4));
    }

    #[test]
    fn the_order_is_random_and_repeats_with_its_seed() {
        let two = [loaded(100), loaded(100)].concat();
        let of = |seed| all(&two, until(seed), 40);
        assert_eq!(of(1), of(1));
        assert_ne!(of(1), of(2));
        // The first of six blocks of a round: each of the six in about a sixth of 240 rounds. 40
        // on average with a standard deviation of 5.8.
        let blocks = all(&two, until(3), 240);
        for i_case in 0..2 {
            for of in &two[0].loops {
                let is_it = |b: &&PlannedBlock| b.i_case == i_case && b.of == *of;
                let n = blocks.iter().step_by(6).filter(is_it).count();
                assert!((20..=60).contains(&n), "{n} of 240");
            }
        }
        // The first segments of thirty cycles: each of seven is there.
        let first = blocks.iter().step_by(48).map(|b| b.frames.start);
        assert!(first.collect::<std::collections::BTreeSet<_>>().len() >= 6);
    }
}
