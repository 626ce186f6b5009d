//! Consecutive items cut into shards that are neither so short that set-ups and the cluster's own
//! work outweigh them, nor so long that a failure loses much (docs/model.md §17).

use std::collections::VecDeque;
use std::ops::Range;

/// Seconds beyond which an item counts no more: thirty thousand years. Sums of it still resolve a
/// millisecond.
const LONGEST_ITEM_S: f64 = 1e12;

/// Items (their predicted seconds, in order) into shards of neighbours, every item in one. A shard
/// takes `setup_s` and what its items take.
///
/// No shard is longer than `longest_s` but for a single item that is. Of all ways to cut that keep
/// to this, the result has the fewest shards shorter than `shortest_s`: none where that can be. Of
/// those it has at least as many shards as are needed for `longest_s`, rounded up to a multiple of
/// `n_nodes`, so that shards of one length leave no node idle; or as many as there can be, where
/// that is less. And shards are as even as going from one to the next makes them. Deterministic, in
/// time linear in the items. Times that are not numbers, or below 0, count as 0, and so does no
/// node as one; `shortest_s` above `longest_s` as `longest_s`.
pub fn split(
    item_s: &[f64],
    setup_s: f64,
    shortest_s: f64,
    longest_s: f64,
    n_nodes: usize,
) -> Vec<Range<usize>> {
    if item_s.is_empty() {
        return Vec::new();
    }
    let cuts = Cuts::new(item_s, setup_s, shortest_s, longest_s);
    let (tails, fewest) = (cuts.tails(), cuts.fewest());
    let n_shards = fewest[0].next_multiple_of(n_nodes.max(1)).min(tails[0].most_shards);
    let mut shards: Vec<Range<usize>> = Vec::new();
    let mut from = 0;
    while from < item_s.len() {
        let to = cuts.next(&tails, &fewest, from, n_shards.saturating_sub(shards.len()).max(1));
        shards.push(from..to);
        from = to;
    }
    shards
}

/// What can be made of the items from somewhere on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Tail {
    /// The fewest shards that are too short.
    n_short: usize,
    /// The most shards with so few of them.
    most_shards: usize,
}

impl Tail {
    const END: Tail = Tail { n_short: 0, most_shards: 0 };

    /// With one shard before it.
    fn after(self, is_short: bool) -> Tail {
        Tail { n_short: self.n_short + usize::from(is_short), most_shards: self.most_shards + 1 }
    }

    fn is_better_than(self, other: Tail) -> bool {
        (self.n_short, other.most_shards) < (other.n_short, self.most_shards)
    }
}

/// Where shards may begin and end.
struct Cuts {
    /// Seconds of all items before each, and of all at the end.
    before_s: Vec<f64>,
    setup_s: f64,
    shortest_s: f64,
    longest_s: f64,
}

impl Cuts {
    fn new(item_s: &[f64], setup_s: f64, shortest_s: f64, longest_s: f64) -> Cuts {
        // What is not a number is not above 0.
        let counted = |seconds: f64| if seconds > 0.0 { seconds.min(LONGEST_ITEM_S) } else { 0.0 };
        let mut before_s = vec![0.0];
        let mut sum = 0.0;
        for seconds in item_s {
            sum += counted(*seconds);
            before_s.push(sum);
        }
        let longest_s = longest_s.max(0.0);
        Cuts {
            before_s,
            setup_s: counted(setup_s),
            shortest_s: shortest_s.max(0.0).min(longest_s),
            longest_s,
        }
    }

    fn n_items(&self) -> usize {
        self.before_s.len() - 1
    }

    fn items_s(&self, from: usize, to: usize) -> f64 {
        self.before_s[to] - self.before_s[from]
    }

    fn seconds(&self, from: usize, to: usize) -> f64 {
        self.setup_s + self.items_s(from, to)
    }

    /// For every item the fewest shards from it on of which none is too long: each as long as it
    /// may be, since what begins later never needs more.
    fn fewest(&self) -> Vec<usize> {
        let n = self.n_items();
        let (mut fewest, mut last) = (vec![0; n + 1], n);
        for from in (0..n).rev() {
            while last > from + 1 && self.seconds(from, last) > self.longest_s {
                last -= 1;
            }
            fewest[from] = 1 + fewest[last];
        }
        fewest
    }

    /// For every item the best of what is from it on, from the last to the first. A shard that
    /// begins earlier reaches the same length earlier, so that both ranges of ends only move down,
    /// and each end enters and leaves once.
    fn tails(&self) -> Vec<Tail> {
        let n = self.n_items();
        let mut tails = vec![Tail::END; n + 1];
        let (mut good, mut short) = (Ends::new(n), Ends::new(n));
        // The first end at which a shard is long enough, n + 1 where none is, and the last at which
        // it is not too long.
        let (mut first_good, mut last_good) = (n + 1, n);
        for from in (0..n).rev() {
            while first_good > from + 1 && self.seconds(from, first_good - 1) >= self.shortest_s {
                first_good -= 1;
            }
            while last_good > from && self.seconds(from, last_good) > self.longest_s {
                last_good -= 1;
            }
            let by_good =
                good.best(&tails, first_good, last_good).map(|end| tails[end].after(false));
            // What is too short is not too long.
            let by_short =
                short.best(&tails, from + 1, first_good - 1).map(|end| tails[end].after(true));
            let alone = (last_good == from).then(|| tails[from + 1].after(false));
            let all = [by_good, by_short, alone].into_iter().flatten();
            let better =
                |best: Tail, tail: Tail| if tail.is_better_than(best) { tail } else { best };
            tails[from] = all.reduce(better).unwrap_or(Tail::END);
        }
        tails
    }

    /// Where the shard that begins here ends, when `n_left` are still wanted: of the ends that keep
    /// what is best and leave enough for the others the one nearest to an even share of all that is
    /// left; one after which the others can be as few as wanted goes before.
    fn next(&self, tails: &[Tail], fewest: &[usize], from: usize, n_left: usize) -> usize {
        let n = self.n_items();
        let even_s = self.items_s(from, n) / n_left.max(fewest[from]) as f64;
        let mut nearest: Option<((bool, f64), usize)> = None;
        for to in from + 1..=n {
            let seconds = self.seconds(from, to);
            if to > from + 1 && seconds > self.longest_s {
                break;
            }
            let tail = tails[to].after(seconds < self.shortest_s);
            let off = (fewest[to] >= n_left, (self.items_s(from, to) - even_s).abs());
            let keeps = tail.n_short == tails[from].n_short && tail.most_shards >= n_left;
            if keeps && nearest.is_none_or(|(least, _)| off < least) {
                nearest = Some((off, to));
            }
        }
        // There is one: `tails` found it, and `n_left` was at most what it found.
        nearest.map_or(n, |(_, to)| to)
    }
}

/// The best end in a range whose two limits only move down. An end stays no longer than a lower
/// one, so that it is dropped when a lower one is as good, and those kept get worse from front to
/// back.
struct Ends {
    kept: VecDeque<usize>,
    /// The lowest end that was looked at.
    entered: usize,
}

impl Ends {
    fn new(n_items: usize) -> Ends {
        Ends { kept: VecDeque::new(), entered: n_items + 1 }
    }

    fn best(&mut self, tails: &[Tail], first: usize, last: usize) -> Option<usize> {
        while self.entered > first {
            self.entered -= 1;
            let entering = tails[self.entered];
            while self.kept.back().is_some_and(|end| !tails[*end].is_better_than(entering)) {
                self.kept.pop_back();
            }
            self.kept.push_back(self.entered);
        }
        while self.kept.front().is_some_and(|end| *end > last) {
            self.kept.pop_front();
        }
        self.kept.front().copied()
    }
}

#[cfg(test)]
mod tests;
