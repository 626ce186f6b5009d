//! Which node does which shards, and what that costs (docs/model.md §17).

use serde::{Deserialize, Serialize};

pub use super::split::split;

/// Shards on nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Packing {
    /// For every node its shards' indices, in the order they are to be done.
    pub nodes: Vec<Vec<usize>>,
    /// For every node the sum of its shards' seconds.
    pub node_seconds: Vec<f64>,
    /// The greatest of those: when all is done that begins together.
    pub makespan_s: f64,
    /// The share of nodes · makespan in which a node has nothing to do; 0 where nothing takes time.
    pub idle_share: f64,
}

/// Longest first, each onto the node that has least so far (of equals the earlier shard, the
/// earlier node). Takes at most 4/3 − 1/(3N) times as long as the best packing (Graham 1969). No
/// node at all counts as one; seconds are finite and not negative.
pub fn pack(seconds: &[f64], n_nodes: usize) -> Packing {
    let n_nodes = n_nodes.max(1);
    let mut longest_first: Vec<usize> = (0..seconds.len()).collect();
    // A stable sort: equals stay by index.
    longest_first.sort_by(|i, j| seconds[*j].total_cmp(&seconds[*i]));
    let (mut nodes, mut node_seconds) = (vec![Vec::new(); n_nodes], vec![0.0; n_nodes]);
    for shard in longest_first {
        let least = (1..n_nodes)
            .fold(0, |least, i| if node_seconds[i] < node_seconds[least] { i } else { least });
        nodes[least].push(shard);
        node_seconds[least] += seconds[shard];
    }
    let makespan_s = node_seconds.iter().copied().fold(0.0, f64::max);
    let idle_s: f64 = node_seconds.iter().map(|seconds| makespan_s - seconds).sum();
    let idle_share = if makespan_s > 0.0 { idle_s / (makespan_s * n_nodes as f64) } else { 0.0 };
    Packing { nodes, node_seconds, makespan_s, idle_share }
}

/// What a node's time costs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rate {
    /// Time is paid for in pieces of so many seconds, each whole.
    pub quantum_s: f64,
    /// In whatever money; prices come out in it.
    pub price_per_quantum: f64,
    /// The share of attempts at a shard that fail and are repeated, in [0, 1).
    pub retry_share: f64,
}

/// In the money of the [`Rate`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Price {
    /// Pieces of time where nothing fails.
    pub quanta: u64,
    pub without_retries: f64,
    /// What repeating is expected to cost on top.
    pub retries: f64,
    pub total: f64,
}

/// The share of a quantum by which a node may be over without paying for one more: a sum of n times
/// is off by n ε/2 at most, 1e-9 for nine million shards, and three shards of a third of a quantum
/// are one.
const QUANTUM_SLACK: f64 = 1e-9;

/// A failed attempt ends, one with another, in the middle of its shard. With a constant hazard
/// failures lie a little before that, so that this is too much rather than too little: by 2 % of
/// what is lost at a retry share of 0.1.
const SHARE_LOST: f64 = 0.5;

/// Σ over nodes of ⌈seconds / quantum⌉ · price per quantum, and what retries are expected to cost.
///
/// Of those: attempts at a shard fail independently with probability p until one does not, so k of
/// them fail with probability pᵏ (1 − p), in the mean Σ k pᵏ (1 − p) = p/(1 − p). Each loses
/// `SHARE_LOST` of its shard's seconds, set-up included, since a shard's seconds have theirs in
/// them; so a node of t seconds is expected to take ½ t p/(1 − p) more. These are not rounded up:
/// where a node's last quantum ends anywhere, every place as likely, x seconds more begin x /
/// quantum new ones in the mean. Err where the rate is not one that can be; it says what was
/// expected.
pub fn price(packing: &Packing, rate: &Rate) -> Result<Price, String> {
    check(rate)?;
    let in_quanta = packing.node_seconds.iter().map(|seconds| seconds / rate.quantum_s);
    let quanta =
        in_quanta.map(|n| (n * (1.0 - QUANTUM_SLACK)).ceil() as u64).fold(0, u64::saturating_add);
    let n_failed = rate.retry_share / (1.0 - rate.retry_share);
    let lost_s = SHARE_LOST * n_failed * packing.node_seconds.iter().sum::<f64>();
    let without_retries = quanta as f64 * rate.price_per_quantum;
    let retries = lost_s / rate.quantum_s * rate.price_per_quantum;
    Ok(Price { quanta, without_retries, retries, total: without_retries + retries })
}

fn check(rate: &Rate) -> Result<(), String> {
    let Rate { quantum_s, price_per_quantum, retry_share } = *rate;
    if !(quantum_s.is_finite() && quantum_s > 0.0) {
        return Err(format!("a quantum of {quantum_s} s, expected a finite time above 0"));
    }
    if !(price_per_quantum.is_finite() && price_per_quantum >= 0.0) {
        return Err(format!(
            "a price of {price_per_quantum} for a quantum, expected a finite number from 0"
        ));
    }
    if !(0.0..1.0).contains(&retry_share) {
        return Err(format!("a retry share of {retry_share}, expected one from 0 and below 1"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::random::{SplitMix64, normal};

    fn rate(quantum_s: f64, price_per_quantum: f64, retry_share: f64) -> Rate {
        Rate { quantum_s, price_per_quantum, retry_share }
    }

    /// The shortest makespan there is, by trying all: shard after shard onto every node.
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
    fn longest_first_by_hand() {
        // 5 → node 0, 4 → 1, 3 → 1 (7), 3 → 0 (8), 2 → 1 (9).
        let packing = pack(&[3.0, 5.0, 2.0, 4.0, 3.0], 2);
        assert_eq!(packing.nodes, [vec![1, 4], vec![3, 0, 2]]);
        assert_eq!((packing.node_seconds, packing.makespan_s), (vec![8.0, 9.0], 9.0));
        assert_eq!(packing.idle_share, 1.0 / 18.0);
    }

    #[test]
    fn the_worst_of_two_nodes_by_hand() {
        // Graham's own example: 3 + 2 + 2 and 3 + 2, where 3 + 3 and 2 + 2 + 2 would be 6; 7/6 =
        // 4/3 − 1/6.
        let packing = pack(&[3.0, 3.0, 2.0, 2.0, 2.0], 2);
        assert_eq!((packing.makespan_s, packing.idle_share), (7.0, 2.0 / 14.0));
        assert_eq!(best_makespan(&[3.0, 3.0, 2.0, 2.0, 2.0], &mut [0.0; 2]), 6.0);
    }

    #[test]
    fn nodes_without_shards_are_idle() {
        let packing = pack(&[6.0], 3);
        assert_eq!(
            (packing.nodes, packing.idle_share),
            (vec![vec![0], vec![], vec![]], 12.0 / 18.0)
        );
        let nothing = pack(&[], 2);
        assert_eq!((nothing.makespan_s, nothing.idle_share, nothing.nodes.len()), (0.0, 0.0, 2));
        assert_eq!(pack(&[1.0, 2.0], 0).nodes, [vec![1, 0]]);
        assert_eq!(pack(&[0.0, 0.0], 1).idle_share, 0.0);
    }

    #[test]
    fn every_shard_is_done_once_within_the_bound_of_graham() {
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
        // The bound is not one that everything keeps: some packings are not the best.
        assert!(worst > 1.05, "{worst}");
    }

    #[test]
    fn price_by_hand() {
        // 100 s and 61 s by the minute: 2 + 2 quanta of 0.5.
        let packing = pack(&[100.0, 61.0], 2);
        let free = price(&packing, &rate(60.0, 0.5, 0.0)).unwrap();
        assert_eq!(free, Price { quanta: 4, without_retries: 2.0, retries: 0.0, total: 2.0 });
        // p = 1/2: one failed attempt a shard, half a shard each: 80.5 s of 161, 80.5/60 · 0.5.
        let half = price(&packing, &rate(60.0, 0.5, 0.5)).unwrap();
        assert!(
            (half.retries - 80.5 / 120.0).abs() < 1e-15 && half.total == 2.0 + half.retries,
            "{half:?}"
        );
        // p = 1/5: a quarter of an attempt, an eighth of the time.
        let fifth = price(&packing, &rate(60.0, 0.5, 0.2)).unwrap();
        assert!((fifth.retries - 161.0 / 8.0 / 120.0).abs() < 1e-15, "{fifth:?}");
    }

    #[test]
    fn a_whole_quantum_is_one_and_an_idle_node_none() {
        let three_tenths = pack(&[0.1; 3], 1);
        assert!(three_tenths.node_seconds[0] > 0.3);
        assert_eq!(price(&three_tenths, &rate(0.3, 1.0, 0.0)).map(|price| price.quanta), Ok(1));
        assert_eq!(
            price(&pack(&[60.0, 120.0], 3), &rate(60.0, 1.0, 0.0)).map(|price| price.quanta),
            Ok(3)
        );
        assert_eq!(
            price(&pack(&[60.001], 1), &rate(60.0, 1.0, 0.0)).map(|price| price.quanta),
            Ok(2)
        );
    }

    #[test]
    fn failed_attempts_are_a_geometric_series_and_lose_half() {
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
    fn rates_that_cannot_be_are_refused() {
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
}
