//! Division of consecutive items into shards (docs/explanation/farm.md). Short shards spend much on
//! set-ups and on the scheduler; long ones lose much in a failure.

use std::collections::VecDeque;
use std::ops::Range;

/// The longest duration that is distinguished, thirty thousand years. Sums of such durations still
/// resolve a millisecond.
const LONGEST_ITEM_S: f64 = 1e12;

/// Divides items, given by their predicted durations, into shards of neighbours. A shard takes
/// `setup_s` and the durations of its items.
///
/// - No shard is longer than `longest_s`, except for single items that are.
///
/// - Under that condition as few shards as possible are shorter than `shortest_s`.
///
/// - The number of shards is what `longest_s` needs, rounded up to a multiple of `n_nodes`, so that
///   shards of equal length leave no node idle. If there cannot be as many, it is the greatest
///   possible number.
///
/// - Each shard ends as near to an even share of the rest as these conditions allow.
///
/// The result is deterministic, and takes time linear in the number of items. Durations that are
/// NaN or below 0 count as 0, 0 nodes count as one, and a `shortest_s` above `longest_s` counts as
/// `longest_s`.
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

/// The best division of the items from some item on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Tail {
    /// The number of shards that are too short.
    n_short: usize,
    /// The greatest number of shards with so few short ones.
    most_shards: usize,
}

impl Tail {
    const END: Tail = Tail { n_short: 0, most_shards: 0 };

    /// Returns the division with one more shard before it.
    fn after(self, is_short: bool) -> Tail {
        Tail { n_short: self.n_short + usize::from(is_short), most_shards: self.most_shards + 1 }
    }

    fn is_better_than(self, other: Tail) -> bool {
        (self.n_short, other.most_shards) < (other.n_short, self.most_shards)
    }
}

/// The durations of all ranges of items.
struct Cuts {
    /// The sum of all durations before each item, and before the end.
    before_s: Vec<f64>,
    setup_s: f64,
    shortest_s: f64,
    longest_s: f64,
}

impl Cuts {
    fn new(item_s: &[f64], setup_s: f64, shortest_s: f64, longest_s: f64) -> Cuts {
        // NaN is not above 0.
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

    /// Returns for every item the least number of shards from it on of which none is too long. Each
    /// shard is as long as possible, since a rest that begins later never needs more shards.
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

    /// Returns for every item the best division from it on. Items are visited from the last to the
    /// first. A shard that begins earlier reaches the same length earlier, so that the limits of
    /// its end only move down, and each end enters and leaves the range once.
    fn tails(&self) -> Vec<Tail> {
        let n = self.n_items();
        let mut tails = vec![Tail::END; n + 1];
        let (mut good, mut short) = (Ends::new(n), Ends::new(n));
        // The first end at which a shard is long enough, n + 1 if there is none, and the last end
        // at which it is not too long.
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

    /// Returns the end of the shard that begins at `from`, when `n_left` shards are still wanted.
    ///
    /// The end keeps the least number of short shards and leaves enough items for the other shards.
    /// Ends after which the wanted number suffices come first; of them the one nearest to an even
    /// share of the rest is taken.
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
        // `tails` has found such an end, with at least `n_left` shards.
        nearest.map_or(n, |(_, to)| to)
    }
}

/// The best end in a range whose two limits only move down. A lower end stays longer, so that ends
/// above it are dropped unless they are better. The ends that are kept get worse from front to
/// back.
struct Ends {
    kept: VecDeque<usize>,
    /// The lowest end that has entered.
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
