//! A clock that drifts is told, and one that only scatters is not.

use nimbus::timing::state::rules::{ClockPoint, LEAST_READINGS, drift};
use nimbus::timing::state::{Drift, Event};

use super::{csv, judged};

/// Uniform numbers in [-1, 1) by SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

const N: usize = 240;

/// Six blocks of two loops in the order A B, B A, A B, at 1900 and 1500 MHz, whose clock scatters
/// by about 1 %, is correlated from reading to reading (0.8), and has changed by `change` at the
/// end.
fn series(seed: u64, change: f64) -> Vec<ClockPoint> {
    let (mut random, mut noise) = (Random(seed), 0.0);
    let mut point = |i: usize| {
        let i_block = i * 6 / N;
        let of = [0, 1, 1, 0, 0, 1][i_block];
        let white: f64 = (0..3).map(|_| random.next()).sum();
        noise = 0.8 * noise + 0.6 * white;
        let clock = [1900.0, 1500.0][of];
        let mhz = clock * (1.0 + 0.01 * noise) * (1.0 + change * i as f64 / N as f64);
        ClockPoint { of, i_block: i_block as u32, mhz }
    };
    (0..N).map(&mut point).collect()
}

fn n_drifting(change: f64) -> usize {
    let drifts = |seed: &u64| drift(&series(*seed, change)).expect("enough readings").drifts;
    (0..200).filter(drifts).count()
}

#[test]
fn a_drift_is_told_and_scatter_is_not() {
    // Loops of different clocks in turn are no drift, in none of 200 runs.
    assert_eq!(n_drifting(0.0), 0);
    // Thirds of a change by 6 % differ by 4 %.
    let n = n_drifting(-0.06);
    assert!(n >= 190, "{n} of 200");
    let n = n_drifting(0.08);
    assert!(n >= 195, "{n} of 200");
    // Half a percent is less than counts, however certain.
    assert_eq!(n_drifting(0.005), 0);
}

#[test]
fn traces_of_a_gpu_drift_or_do_not() {
    let of = |name: &str| judged(&csv(name), 4.0, false).1;
    let run = of("nvml-drift.csv");
    let Some(Drift { last_by_first, low, high, drifts }) = run.drift else { panic!("no drift") };
    assert!(drifts && low < last_by_first && last_by_first < high && high < 1.0);
    assert!((last_by_first - 0.959).abs() < 0.01, "{last_by_first}");
    let expected = "the clock drifts: in the last third of the run it is 0.9";
    assert!(run.remarks.iter().any(|r| r.starts_with(expected)), "{:?}", run.remarks);
    let steady = of("nvml-steady.csv");
    assert!(steady.drift.is_some_and(|drift| !drift.drifts), "{:?}", steady.drift);
}

#[test]
fn too_few_readings_tell_no_drift() {
    let falling = series(1, -0.3);
    assert!(drift(&falling).is_some_and(|drift| drift.drifts));
    assert_eq!(drift(&[]), None);
    // A loop of one block has its own clock, and cannot tell a change from it.
    let alone: Vec<ClockPoint> =
        falling.iter().map(|p| ClockPoint { of: p.i_block as usize, ..*p }).collect();
    assert_eq!(drift(&alone), None);
    let one_loop = |n: usize| -> Vec<ClockPoint> {
        let point = |i: usize| ClockPoint { of: 0, i_block: u32::from(i > 0), mhz: 1e3 - i as f64 };
        (0..n).map(point).collect()
    };
    assert_eq!(drift(&one_loop(3 * LEAST_READINGS - 1)), None);
    assert!(drift(&one_loop(3 * LEAST_READINGS)).is_some());
    let still = one_loop(120).iter().map(|p| ClockPoint { mhz: 0.0, ..*p }).collect::<Vec<_>>();
    assert_eq!(drift(&still), None);
    let rows = csv("nvml-drift.csv");
    assert!(rows.iter().all(|row| row.event != Event::Start));
}
