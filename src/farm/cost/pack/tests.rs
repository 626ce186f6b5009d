use super::*;
use crate::measure::random::{SplitMix64, normal};

fn rate(quantum_s: f64, price_per_quantum: f64, retry_share: f64) -> Rate {
    Rate { quantum_s, price_per_quantum, retry_share }
}

/// Returns the shortest makespan, by trying every node for every shard.
fn best_makespan(seconds: &[f64], loads: &mut [f64]) -> f64 {
    let Some((first, rest)) = seconds.split_first() else {
        return loads.iter().copied().fold(0.0, f64::max);
    };
    let mut best = f64::INFINITY;
    for node in 0..loads.len() {
        let before = loads[node];
        loads[node] += first;
        best = best.min(best_makespan(rest, loads));
        loads[node] = before;
    }
    best
}

#[test]
fn five_shards_are_packed_longest_first() {
    // 5 → node 0, 4 → 1, 3 → 1 (7), 3 → 0 (8), 2 → 1 (9).
    let packing = pack(&[3.0, 5.0, 2.0, 4.0, 3.0], 2);
    assert_eq!(packing.nodes, [vec![1, 4], vec![3, 0, 2]]);
    assert_eq!((packing.node_seconds, packing.makespan_s), (vec![8.0, 9.0], 9.0));
    assert_eq!(packing.idle_share, 1.0 / 18.0);
}

#[test]
fn grahams_worst_case_for_two_nodes() {
    // Graham's own example: 3 + 2 + 2 and 3 + 2. The best packing is 3 + 3 and 2 + 2 + 2;
    // 7/6 = 4/3 − 1/6.
    let packing = pack(&[3.0, 3.0, 2.0, 2.0, 2.0], 2);
    assert_eq!((packing.makespan_s, packing.idle_share), (7.0, 2.0 / 14.0));
    assert_eq!(best_makespan(&[3.0, 3.0, 2.0, 2.0, 2.0], &mut [0.0; 2]), 6.0);
}

#[test]
fn nodes_without_shards_are_idle() {
    let packing = pack(&[6.0], 3);
    assert_eq!((packing.nodes, packing.idle_share), (vec![vec![0], vec![], vec![]], 12.0 / 18.0));
    let nothing = pack(&[], 2);
    assert_eq!((nothing.makespan_s, nothing.idle_share, nothing.nodes.len()), (0.0, 0.0, 2));
    assert_eq!(pack(&[1.0, 2.0], 0).nodes, [vec![1, 0]]);
    assert_eq!(pack(&[0.0, 0.0], 1).idle_share, 0.0);
}

#[test]
fn every_shard_is_packed_once_and_graham_s_bound_holds() {
    let mut random = SplitMix64(1);
    let mut worst: f64 = 0.0;
    for i in 0..600 {
        let (n, n_nodes) = (1 + i % 8, 1 + i / 8 % 4);
        // Whole seconds, so that sums are exact and ties happen.
        let seconds: Vec<f64> =
            normal(&mut random, n).iter().map(|z| (4.0 * z.exp()).ceil()).collect();
        let packing = pack(&seconds, n_nodes);
        let mut done: Vec<usize> = packing.nodes.concat();
        done.sort_unstable();
        assert_eq!(done, (0..n).collect::<Vec<_>>());
        for (node, total) in packing.nodes.iter().zip(&packing.node_seconds) {
            assert_eq!(node.iter().map(|i| seconds[*i]).sum::<f64>(), *total);
        }
        let ratio = packing.makespan_s / best_makespan(&seconds, &mut vec![0.0; n_nodes]);
        assert!(
            ratio <= 4.0 / 3.0 - 1.0 / (3.0 * n_nodes as f64) + 1e-12,
            "{ratio} for {seconds:?} on {n_nodes}"
        );
        worst = worst.max(ratio);
    }
    // Some packings are not the best, so that the bound is tested.
    assert!(worst > 1.05, "{worst}");
}

#[test]
fn quanta_and_retries_are_priced() {
    // 100 s and 61 s by the minute: 2 + 2 quanta of 0.5.
    let packing = pack(&[100.0, 61.0], 2);
    let free = price(&packing, &rate(60.0, 0.5, 0.0)).unwrap();
    assert_eq!(free, Price { quanta: 4, without_retries: 2.0, retries: 0.0 });
    // p = 1/2: one failed attempt a shard, half a shard each: 80.5 s of 161, 80.5/60 · 0.5.
    let half = price(&packing, &rate(60.0, 0.5, 0.5)).unwrap();
    assert!(
        (half.retries - 80.5 / 120.0).abs() < 1e-15 && half.total() == 2.0 + half.retries,
        "{half:?}"
    );
    // p = 1/5: a quarter of an attempt, an eighth of the time.
    let fifth = price(&packing, &rate(60.0, 0.5, 0.2)).unwrap();
    assert!((fifth.retries - 161.0 / 8.0 / 120.0).abs() < 1e-15, "{fifth:?}");
}

#[test]
fn a_whole_quantum_is_paid_once_and_an_idle_node_costs_nothing() {
    let three_tenths = pack(&[0.1; 3], 1);
    assert!(three_tenths.node_seconds[0] > 0.3);
    assert_eq!(price(&three_tenths, &rate(0.3, 1.0, 0.0)).map(|price| price.quanta), Ok(1));
    assert_eq!(
        price(&pack(&[60.0, 120.0], 3), &rate(60.0, 1.0, 0.0)).map(|price| price.quanta),
        Ok(3)
    );
    assert_eq!(price(&pack(&[60.001], 1), &rate(60.0, 1.0, 0.0)).map(|price| price.quanta), Ok(2));
}

#[test]
fn the_price_of_retries_is_that_of_a_geometric_series() {
    for p in [0.01, 0.1, 0.3_f64] {
        let series: f64 = (1..2000).map(|k| f64::from(k) * p.powi(k) * (1.0 - p)).sum();
        assert!((series - p / (1.0 - p)).abs() < 1e-14);
        // A constant hazard h a shard, p = 1 − e^{−h}: expected (e^h − 1)/h shards' time until
        // one is done.
        let hazard = -(1.0 - p).ln();
        let lost = hazard.exp_m1() / hazard - 1.0;
        let ours = price(&pack(&[1.0], 1), &rate(1.0, 1.0, p)).unwrap().retries;
        // h/6 of it, to first order.
        assert!(ours >= lost && ours <= lost * (1.0 + hazard / 5.0), "{ours} for {lost}");
    }
}

#[test]
fn impossible_rates_are_refused() {
    let packing = pack(&[1.0], 1);
    for (bad, message) in [
        (rate(0.0, 1.0, 0.0), "a quantum of 0 s"),
        (rate(f64::NAN, 1.0, 0.0), "a quantum of NaN"),
        (rate(1.0, -1.0, 0.0), "a price of -1"),
        (rate(1.0, 1.0, 1.0), "a retry share of 1"),
        (rate(1.0, 1.0, -0.1), "a retry share of -0.1"),
        (rate(1.0, 1.0, f64::NAN), "a retry share of NaN"),
    ] {
        let got = price(&packing, &bad).unwrap_err();
        assert!(got.contains(message) && got.contains("expected"), "{got}");
    }
}
