//! Tests of verdicts on known distributions, and of the matching of loops.

use super::*;
use crate::measure::random::{SplitMix64, block_times, frame_times};
use crate::timing::results::Measure;

const N_TRIALS: usize = 100;
const SEED: u64 = 1;
/// Frames of a scene of 120 frames in two blocks, the default.
const N_FRAMES: usize = 240;
/// Least and greatest noise of a quiet machine, relative to the median.
const NOISE: [f64; 2] = [0.015, 0.03];
/// Correlation from frame to frame.
const RHO: f64 = 0.3;

/// Returns how often B at `slowdown` times A was called faster, the same, slower and undecided.
fn verdicts(
    (slowdown, margin): (f64, f64),
    noise: f64,
    n_trials: usize,
    lists: impl Fn(&mut SplitMix64, f64, f64) -> Vec<Block>,
) -> [usize; 4] {
    let mut random = SplitMix64(SEED);
    let mut count = [0; 4];
    for _ in 0..n_trials {
        let [a, b] = [1.0, slowdown].map(|by| lists(&mut random, 16.0 * by, noise));
        let of = |blocks| Times { blocks, widening: 1.0 };
        match compare(HEADLINE, of(&a), of(&b), margin).verdict {
            Verdict::Faster => count[0] += 1,
            Verdict::Same => count[1] += 1,
            Verdict::Slower => count[2] += 1,
            Verdict::Undecided => count[3] += 1,
            other => panic!("{other:?}"),
        }
    }
    count
}

/// Two long blocks of all frames, the default.
fn long(random: &mut SplitMix64, ms: f64, noise: f64) -> Vec<Block> {
    let values = frame_times(random, N_FRAMES, ms, noise, RHO);
    values
        .chunks(N_FRAMES / 2)
        .map(|half| Block { start: 0, stratum: 0, values: half.to_vec() })
        .collect()
}

/// Sixteen short blocks of eight segments, each as a whole off by a fifth of the noise of a frame.
fn short(random: &mut SplitMix64, ms: f64, noise: f64) -> Vec<Block> {
    let block = |k: u32| Block {
        start: 0,
        stratum: k % 8,
        values: block_times(random, N_FRAMES / 16, noise, RHO, 0.2 * noise)
            .into_iter()
            .map(|by| ms * by)
            .collect(),
    };
    (0..16).map(block).collect()
}

#[test]
fn verdicts_are_rarely_wrong_at_the_margin() {
    // B is slower by just the margin: "the same" and "slower" are both wrong, each in 2.5 % of
    // runs, with a standard deviation of 0.5 % over 1000.
    for noise in NOISE {
        for margin in [0.005, 0.03] {
            let at = (1.0 + margin, margin);
            for found in [verdicts(at, noise, 1000, long), verdicts(at, noise, 1000, short)] {
                let [faster, same, slower, _] = found;
                assert!(
                    faster == 0 && same <= 50 && slower <= 50,
                    "noise {noise}, margin {margin}: {found:?}"
                );
            }
        }
    }
    // Without a margin any difference of two equal runs is wrong, 5 % in all.
    let [faster, same, slower, _] = verdicts((1.0, 0.0), NOISE[0], 1000, long);
    assert!(same == 0 && (20..=75).contains(&(faster + slower)), "{faster} {slower}");
}

#[test]
fn verdicts_are_found_away_from_the_margin() {
    // The standard error of the ratio is at most 1.25 · 3 % · 1.36 /√240 · √2 = 0.47 %: 3 % beyond
    // a margin of 1 % is six of them, and so are 3 % within one of 3 %.
    for noise in NOISE {
        for (slowdown, i) in [(1.04, 2), (1.0 / 1.04, 0)] {
            for found in [
                verdicts((slowdown, 0.01), noise, N_TRIALS, long),
                verdicts((slowdown, 0.01), noise, N_TRIALS, short),
            ] {
                assert!(found[i] >= 97, "{slowdown}: {found:?}");
            }
        }
        let found = verdicts((1.0, 0.03), noise, N_TRIALS, long);
        assert!(found[1] >= 97, "{found:?}");
    }
}

/// Compares two lists of one block each.
fn of_lists(a: &[f64], b: &[f64], margin: f64) -> MeasureComparison {
    let block = |ms: &[f64]| [Block { start: 0, stratum: 0, values: ms.to_vec() }];
    let of = |blocks| Times { blocks, widening: 1.0 };
    compare("x", of(&block(a)), of(&block(b)), margin)
}

#[test]
fn a_run_does_not_differ_from_itself() {
    for seed in 0..20 {
        let a = frame_times(&mut SplitMix64(seed), 60, 16.0, NOISE[1], RHO);
        let compared = of_lists(&a, &a, 0.05);
        assert_eq!(compared.verdict, Verdict::Same);
        assert_eq!((compared.b_by_a.unwrap().estimate, compared.block_len), (1.0, Some(8)));
    }
    assert_eq!(of_lists(&[0.5; 30], &[0.5; 30], 0.0).verdict, Verdict::Same);
    let short = short(&mut SplitMix64(2), 16.0, NOISE[0]);
    let of = Times { blocks: &short, widening: 1.0 };
    assert_eq!(compare(HEADLINE, of, of, 0.05).block_len, None, "whole blocks");
}

#[test]
fn a_missing_verdict_says_why() {
    let thirty = [2.0; N_FRAMES_NEEDED];
    assert_eq!(of_lists(&thirty, &[3.0; N_FRAMES_NEEDED], 0.01).verdict, Verdict::Slower);
    for (a, b, verdict) in [
        (&thirty[..29], &thirty[..], Verdict::TooFewFrames),
        (&thirty[..], &thirty[..29], Verdict::TooFewFrames),
        (&[], &thirty[..], Verdict::NotMeasuredInA),
        (&thirty[..], &[], Verdict::NotMeasuredInB),
        (&[0.0; 30], &thirty[..], Verdict::NoRatio),
    ] {
        let compared = of_lists(a, b, 0.01);
        assert_eq!((compared.verdict, compared.b_by_a), (verdict, None));
    }
    // The medians are reported all the same.
    assert_eq!(of_lists(&[1.0], &[4.0], 0.01).b_ms, Some(4.0));
}

fn mode(name: &str, frames: std::ops::Range<u32>, measures: &[(&str, f64)]) -> TimedMode {
    let n = frames.len();
    let measure = |&(name, ms): &(&str, f64)| Measure {
        name: name.to_owned(),
        blocks: vec![Block { start: 0, stratum: 0, values: vec![ms; n] }],
    };
    TimedMode {
        name: name.to_owned(),
        frames: frames.collect(),
        widening: 1.0,
        measures: measures.iter().map(measure).collect(),
    }
}

#[test]
fn measures_are_matched_by_name_in_any_order() {
    let a = [
        mode("serial", 0..40, &[("frame", 10.0), ("sort", 1.0), ("grid", 2.0)]),
        mode("parallel", 0..40, &[]),
    ];
    let mut b =
        [mode("serial", 0..40, &[("frame", 11.0), ("grid", 1.0), ("tree", 3.0), ("first", 0.0)])];
    b[0].measures[3].blocks.clear();
    let modes = compare_modes(&pairs(&a, &b), 0.01);
    assert_eq!(modes.len(), 1);
    let verdicts: Vec<_> =
        modes[0].measures.iter().map(|m| (m.measure.as_str(), m.verdict)).collect();
    assert_eq!(
        verdicts,
        [
            ("frame", Verdict::Slower),
            ("sort", Verdict::NotMeasuredInB),
            ("grid", Verdict::Faster),
            ("tree", Verdict::NotMeasuredInA)
        ]
    );
    assert_eq!(modes[0].headline().map(|m| m.verdict), Some(Verdict::Slower));
    let remarks = frame_remarks(&a, &b);
    assert!(
        remarks.len() == 1 && remarks[0].contains("parallel frames are in A alone"),
        "{remarks:?}"
    );
    let later = frame_remarks(&a[..1], &[mode("serial", 5..45, &[])]);
    assert!(later.len() == 1 && later[0].contains("different frames"), "{later:?}");
}

#[test]
fn a_difference_no_greater_than_between_blocks_is_remarked_on() {
    let with_blocks = |blocks: &[f64]| {
        let mut mode = mode("serial", 0..40, &[("frame", 0.0)]);
        let block = |ms: &f64| Block { start: 0, stratum: 0, values: vec![*ms; 20] };
        mode.measures[0].blocks = blocks.iter().map(block).collect();
        [mode]
    };
    let remarks = |a: &[TimedMode], b: &[TimedMode]| {
        let pairs = pairs(a, b);
        steadiness_remarks(&pairs, &compare_modes(&pairs, 0.01))
    };
    // 10 against 11 ms; blocks of A from 9.5 to 10.5 are 1.105 apart, of B from 10.9 to 11.1
    // are 1.018.
    let (a, b) = (with_blocks(&[9.5, 10.5]), with_blocks(&[11.1, 10.9]));
    let found = remarks(&a, &b);
    assert!(
        found.len() == 1 && found[0].contains("A's own blocks lie a factor of 1.105 apart"),
        "{found:?}"
    );
    let found = remarks(&b, &a);
    assert!(found.len() == 1 && found[0].contains("B's own blocks"), "{found:?}");
    // Steady enough; no difference to doubt; a single block.
    assert_eq!(remarks(&with_blocks(&[9.9, 10.1]), &b), [""; 0]);
    assert_eq!(remarks(&a, &a), [""; 0]);
    assert_eq!(remarks(&with_blocks(&[10.0]), &b), [""; 0]);
}
