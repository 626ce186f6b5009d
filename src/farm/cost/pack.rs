//! Assignment of shards to nodes, and the price of the nodes' time (docs/explanation/farm.md).

use std::fmt;

use crate::error::{Error, Result};

/// Shards on nodes.
#[derive(Debug, Clone, PartialEq)]
struct Packing {
    /// The shards of each node, in the order in which they are packed.
    nodes: Vec<Vec<usize>>,
    /// The sum of the shards' durations on each node, s.
    node_seconds: Vec<f64>,
    /// The greatest of those sums: the duration of the whole work, s.
    makespan_s: f64,
    /// The share of nodes · makespan in which a node is idle; 0 for work without duration.
    idle_share: f64,
}

/// Packs shards onto nodes: longest first, each onto the node with the least duration so far.
///
/// Ties go to the earlier shard and the earlier node. The makespan is at most 4/3 − 1/(3N) times
/// the best one (Graham 1969). Durations are finite and not negative; 0 nodes count as one.
fn pack(seconds: &[f64], n_nodes: usize) -> Packing {
    let n_nodes = n_nodes.max(1);
    let mut longest_first: Vec<usize> = (0..seconds.len()).collect();
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

/// The price of a node's time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// The period that is paid for as a whole, s.
    pub quantum_s: f64,
    /// The price of such a period, in any currency.
    pub price_per_quantum: f64,
    /// The share of attempts at a shard that fail and are repeated, in [0, 1).
    pub retry_share: f64,
}

/// The price of a packing, in the currency of its [`Rate`].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Price {
    /// Periods that are paid for if no attempt fails.
    quanta: u64,
    /// Their price.
    without_retries: f64,
    /// The expected price of repeated attempts.
    retries: f64,
}

impl Price {
    fn total(&self) -> f64 {
        self.without_retries + self.retries
    }
}

/// The share of a quantum that a node may exceed it by without paying for another one. A sum of n
/// durations is off by n ε/2 at most, which is 1e-9 for nine million shards. So three shards of a
/// third of a quantum are one quantum.
const QUANTUM_SLACK: f64 = 1e-9;

/// The share of its shard that a failed attempt loses on average. With a constant hazard attempts
/// fail a little earlier, so that this overestimates: by 2 % of what is lost at a retry share of
/// 0.1.
const SHARE_LOST: f64 = 0.5;

/// Computes Σ ⌈seconds / quantum⌉ · price per quantum over the nodes, and the expected price of
/// repeated attempts.
///
/// Attempts at a shard fail independently with probability p until one succeeds: k of them with
/// pᵏ (1 − p), in the mean p/(1 − p). Each loses `SHARE_LOST` of its shard's duration, so that a
/// node of t seconds needs ½ t p/(1 − p) more. These seconds are not rounded up: where the last
/// quantum of a node ends anywhere with equal probability, x seconds more begin x / quantum new
/// ones in the mean.
fn price(packing: &Packing, rate: &Rate) -> std::result::Result<Price, String> {
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
    let in_quanta = packing.node_seconds.iter().map(|seconds| seconds / quantum_s);
    let quanta =
        in_quanta.map(|n| (n * (1.0 - QUANTUM_SLACK)).ceil() as u64).fold(0, u64::saturating_add);
    let n_failed = retry_share / (1.0 - retry_share);
    let lost_s = SHARE_LOST * n_failed * packing.node_seconds.iter().sum::<f64>();
    let without_retries = quanta as f64 * price_per_quantum;
    Ok(Price { quanta, without_retries, retries: lost_s / quantum_s * price_per_quantum })
}

/// The predicted duration and price of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    packing: Packing,
    price: Option<(f64, Price)>,
}

impl Estimate {
    /// Estimates shards of these durations (s) on so many nodes.
    ///
    /// # Errors
    /// When the rate is impossible.
    pub fn new(seconds: &[f64], n_nodes: usize, rate: Option<Rate>) -> Result<Estimate> {
        let packing = pack(seconds, n_nodes);
        let priced = |rate: Rate| price(&packing, &rate).map(|price| (rate.quantum_s, price));
        let price = rate.map(priced).transpose().map_err(Error::usage)?;
        Ok(Estimate { packing, price })
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Packing { nodes, node_seconds, makespan_s, idle_share } = &self.packing;
        let (all, span) = (duration(node_seconds.iter().sum()), duration(*makespan_s));
        let (n_nodes, idle) = (nodes.len(), 100.0 * idle_share);
        writeln!(
            f,
            "predicted: {all} of runs; on {n_nodes} nodes done after {span}, {idle:.0} % of their \
             time idle"
        )?;
        let Some((quantum_s, price)) = &self.price else { return Ok(()) };
        let Price { quanta, without_retries, retries } = price;
        writeln!(
            f,
            "price: {without_retries:.2} for {quanta} periods of {quantum_s} s, and {retries:.2} \
             for expected retries: {:.2}",
            price.total()
        )
    }
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests;
