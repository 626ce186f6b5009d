//! Hand-worked intervals, and how often intervals hold the truth.

use super::*;
use crate::measure::random::{SplitMix64, block_times, normal};

fn block(stratum: u32, values: &[f64]) -> Block {
    Block { start: 0, stratum, values: values.to_vec() }
}

#[test]
fn a_hand_worked_interval() {
    // Eight blocks of two values in one stratum, 1 to 16 in pairs: the median is 8.5. Four blocks
    // are below, four above: w (½ − p) = ∓ 1/16. Sum of squares 8/256, times 8/7: 1/28. Seven
    // degrees: t = 2.3646, half width 2.3646 √(1/28) = 0.44687. Quantiles at 0.05313 and 0.94687 of
    // 1 … 16: 1 + 15 · 0.05313 = 1.797 and 15.203.
    let blocks: Vec<Block> =
        (0..8).map(|k| block(3, &[f64::from(2 * k + 1), f64::from(2 * k + 2)])).collect();
    let median = BlockedMedian::new(&blocks).unwrap();
    let Interval { estimate, low, high } = median.interval(1.0);
    assert_eq!(estimate, 8.5);
    assert!((low - 1.797).abs() < 2e-3 && (high - 15.203).abs() < 2e-3, "{low} {high}");
    // Half as wide in terms of quantiles.
    let half = median.interval(0.5);
    assert!((half.low - (8.5 - 15.0 * 0.2234)).abs() < 2e-3, "{}", half.low);
}

#[test]
fn strata_take_out_what_differs_from_frame_to_frame() {
    // Four strata with medians 10, 20, 30, 40 and two equal blocks each: no noise at all.
    let blocks: Vec<Block> =
        (0..8u32).map(|k| block(k % 4, &[f64::from(10 * (k % 4 + 1)); 3])).collect();
    let median = BlockedMedian::new(&blocks).unwrap();
    assert_eq!(median.interval(1.0).low, 25.0);
    // As one stratum the same blocks have an interval as wide as all values.
    let one: Vec<Block> = blocks.iter().map(|b| block(0, &b.values)).collect();
    let wide = BlockedMedian::new(&one).unwrap().interval(1.0);
    assert!(wide.low < 15.0 && wide.high > 35.0, "{wide:?}");
}

#[test]
fn single_blocks_are_compared_with_their_neighbours() {
    assert_eq!(groups([5, 1, 3, 9].into_iter()), [vec![1, 2], vec![0, 3]]);
    assert_eq!(groups([5, 1, 3].into_iter()), [vec![1, 2, 0]]);
    assert_eq!(groups([1, 1, 4, 2, 2].into_iter()), [vec![0, 1], vec![3, 4, 2]]);
    assert_eq!(groups([7].into_iter()), [vec![0]]);
    assert_eq!(groups([1, 4, 4].into_iter()), [vec![0, 1, 2]]);
}

#[test]
fn too_few_blocks_have_no_interval() {
    let of = |n: u32| (0..n).map(|k| block(k, &[1.0, 2.0])).collect::<Vec<_>>();
    assert!(BlockedMedian::new(&of(7)).is_none());
    assert!(BlockedMedian::new(&of(8)).is_some());
    let mut empty = of(8);
    empty[3].values = vec![f64::NAN];
    assert!(BlockedMedian::new(&empty).is_none(), "a block without a finite value is none");
}

#[test]
fn starts_are_compared_as_a_whole() {
    // Three starts of four equal blocks each: 10, 11 and 12 ms. Shares ½, 0, −½ of a third each:
    // squares 2/36, times 3/2: 1/12. Two degrees: half width 4.303 √(1/12) is above ½.
    let of = |n: u32| {
        let start =
            |k: u32| Block { start: k / 4, stratum: k % 4, values: vec![f64::from(10 + k / 4); 5] };
        (0..4 * n).map(start).collect::<Vec<_>>()
    };
    assert!(has_starts(&of(2)) && !has_starts(&of(1)));
    assert!(BlockedMedian::new(&of(2)).is_none(), "two starts tell little");
    let interval = BlockedMedian::new(&of(3)).unwrap().interval(1.0);
    assert_eq!((interval.estimate, interval.low, interval.high), (11.0, 10.0, 12.0));
}

#[test]
fn a_ratio_needs_positive_medians() {
    let of = |value: f64| {
        let blocks: Vec<Block> = (0..8).map(|k| block(k, &[value, value])).collect();
        BlockedMedian::new(&blocks).unwrap()
    };
    assert_eq!(of(3.0).ratio(&of(0.0), 1.0), None);
    let exact = of(3.0).ratio(&of(2.0), 1.0).unwrap();
    assert_eq!((exact.estimate, exact.low, exact.high), (1.5, 1.5, 1.5));
}

#[test]
fn what_slows_a_round_cancels_in_a_paired_ratio() {
    // Rounds that differ by a factor of two, and loops that differ by 10 % with noise of 0.1 %.
    let mut random = SplitMix64(4);
    let round = normal(&mut random, 16).iter().map(|z| (0.3 * z).exp()).collect::<Vec<_>>();
    let mut loop_of = |factor: f64| -> BlockedMedian {
        let mut values = |k: usize| -> Vec<f64> {
            normal(&mut random, 12).iter().map(|z| factor * round[k] * (1.0 + 1e-3 * z)).collect()
        };
        let blocks: Vec<Block> = (0..16).map(|k| block(0, &values(k))).collect();
        BlockedMedian::new(&blocks).unwrap()
    };
    let (a, b) = (loop_of(1.0), loop_of(1.1));
    let width = |i: Interval| (i.high / i.low).ln();
    let (paired, alone) = (b.paired_ratio(&a, 1.0).unwrap(), b.ratio(&a, 1.0).unwrap());
    assert!(width(paired) < 0.2 * width(alone), "{paired:?} {alone:?}");
    assert!(paired.low <= 1.1 && 1.1 <= paired.high, "{paired:?}");
}

/// Series of blocks: noise within blocks, its correlation from frame to frame, noise of whole
/// blocks.
const SERIES: [(f64, f64, f64); 5] =
    [(0.03, 0.0, 0.0), (0.03, 0.6, 0.0), (0.03, 0.3, 0.01), (0.01, 0.3, 0.02), (0.02, 0.3, 0.005)];

/// How often the intervals of a median and of a ratio hold the truth.
fn coverage(
    n_trials: usize,
    n_blocks: u32,
    n_strata: u32,
    (sd, rho, of_block): (f64, f64, f64),
) -> [f64; 2] {
    let mut random = SplitMix64(17);
    let mut list = |n: u32| -> Vec<Block> {
        let times = |k: u32| block(k % n_strata, &block_times(&mut random, 15, sd, rho, of_block));
        (0..n).map(times).collect()
    };
    let all = list(20_000);
    let truth = BlockedMedian::new(&all).unwrap().median();
    let mut held = [0; 2];
    for _ in 0..n_trials {
        let [a, b] = [(); 2].map(|()| BlockedMedian::new(&list(n_blocks)).unwrap());
        let intervals = [(a.interval(1.0), truth), (a.ratio(&b, 1.0).unwrap(), 1.0)];
        for (held, (interval, truth)) in held.iter_mut().zip(intervals) {
            *held += usize::from(interval.low <= truth && truth <= interval.high);
        }
    }
    held.map(|n| n as f64 / n_trials as f64)
}

#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    // 95 % nominal; the standard error over 2000 trials is 0.5 %.
    for series in SERIES {
        for (n_blocks, n_strata) in [(8, 8), (16, 8), (32, 1)] {
            let found = coverage(2000, n_blocks, n_strata, series);
            assert!(
                found.iter().all(|share| (0.935..=0.97).contains(share)),
                "{series:?}, {n_blocks} blocks in {n_strata} strata: {found:?}"
            );
        }
    }
}
