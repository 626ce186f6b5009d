use super::*;
use crate::measure::random::{SplitMix64, normal};

/// Returns the number of short shards and of all shards; none if a shard of several items is too
/// long.
fn counts_of(
    item_s: &[f64],
    shards: &[Range<usize>],
    limits: (f64, f64, f64),
) -> Option<(usize, usize)> {
    let (setup_s, shortest_s, longest_s) = limits;
    let mut n_short = 0;
    for shard in shards {
        let seconds = setup_s + item_s[shard.clone()].iter().sum::<f64>();
        if shard.len() > 1 && seconds > longest_s {
            return None;
        }
        n_short += usize::from(seconds < shortest_s);
    }
    Some((n_short, shards.len()))
}

/// Tries all 2ⁿ⁻¹ divisions. Returns the least number of short shards, and the greatest number of
/// shards with so few.
fn best_of_all(item_s: &[f64], limits: (f64, f64, f64)) -> (usize, usize) {
    let n = item_s.len();
    let ways = (0..1_usize << (n - 1)).filter_map(|cuts| {
        let inner = (1..n).filter(|i| cuts >> (i - 1) & 1 == 1);
        let ends: Vec<usize> = [0].into_iter().chain(inner).chain([n]).collect();
        let shards: Vec<Range<usize>> = ends.windows(2).map(|pair| pair[0]..pair[1]).collect();
        counts_of(item_s, &shards, limits)
    });
    ways.min_by_key(|(n_short, n_shards)| (*n_short, n - n_shards)).unwrap()
}

fn assert_covers(shards: &[Range<usize>], n_items: usize) {
    let items: Vec<usize> = shards.iter().cloned().flatten().collect();
    assert_eq!(items, (0..n_items).collect::<Vec<_>>());
    assert!(shards.iter().all(|shard| !shard.is_empty()));
}

/// Whole seconds, so that sums are exact.
fn items(random: &mut SplitMix64, n: usize, middle: f64) -> Vec<f64> {
    normal(random, n).iter().map(|z| (middle * z.exp()).floor()).collect()
}

#[test]
fn even_items_make_a_multiple_of_the_nodes() {
    // 120 frames of 10 s, a set-up of 20 s, at most 600 s: 58 frames fit, so 3 shards, so 4 on four
    // nodes.
    let shards = split(&[10.0; 120], 20.0, 60.0, 600.0, 4);
    assert_eq!(shards, [0..30, 30..60, 60..90, 90..120]);
    // On one node 3, on two again 4, on 40 nodes as many as reach 60 s: 4 frames each, 30 shards.
    assert_eq!(split(&[10.0; 120], 20.0, 60.0, 600.0, 1), [0..40, 40..80, 80..120]);
    assert_eq!(split(&[10.0; 120], 20.0, 60.0, 600.0, 2).len(), 4);
    assert_eq!(split(&[10.0; 120], 20.0, 60.0, 600.0, 40).len(), 30);
}

#[test]
fn little_work_is_one_shard() {
    assert_eq!(split(&[1.0, 2.0, 3.0], 5.0, 60.0, 600.0, 8), vec![0..3]);
    assert!(split(&[], 5.0, 60.0, 600.0, 8).is_empty());
    assert_eq!(split(&[0.0; 4], 0.0, 60.0, 600.0, 2), vec![0..4]);
}

#[test]
fn a_long_item_is_alone() {
    assert_eq!(split(&[100.0, 900.0, 100.0], 0.0, 60.0, 600.0, 1), [0..1, 1..2, 2..3]);
    // So is every item if a set-up alone is too long.
    assert_eq!(split(&[1.0; 3], 700.0, 60.0, 600.0, 1), [0..1, 1..2, 2..3]);
    assert_eq!(
        split(&[f64::INFINITY, 10.0, f64::INFINITY], 0.0, 5.0, 600.0, 1),
        [0..1, 1..2, 2..3]
    );
}

#[test]
fn no_shard_is_short_where_another_cut_avoids_it() {
    // 4 + 4 is as long as can be, and leaves 1; all together are 9.
    assert_eq!(split(&[4.0, 4.0, 1.0], 0.0, 5.0, 9.0, 1), vec![0..3]);
    // 4 + 4 + 4 would be too long. 4 + 4 and 4 + 1 do.
    assert_eq!(split(&[4.0, 4.0, 4.0, 1.0], 0.0, 5.0, 9.0, 1), vec![0..2, 2..4]);
    assert_eq!(split(&[6.0, 1.0, 7.0], 0.0, 7.0, 8.0, 1), vec![0..2, 2..3]);
}

#[test]
fn evenness_does_not_add_a_shard() {
    // 27 s in three are 9 each. 8.5 is nearer to it than 8.5 + 1.5, but then 1.5 + 9.5 are too
    // long.
    assert_eq!(split(&[8.5, 1.5, 9.5, 7.5], 0.0, 0.0, 10.0, 1), [0..2, 2..3, 3..4]);
}

#[test]
fn uneven_items_still_give_every_node_a_shard() {
    // Evenly 4 s each, but 1 + 1 would leave only one more.
    assert_eq!(split(&[1.0, 1.0, 10.0], 0.0, 1.0, 100.0, 3), [0..1, 1..2, 2..3]);
}

#[test]
fn no_division_has_fewer_short_shards() {
    let mut random = SplitMix64(1);
    let (mut n_with_short, mut n_without) = (0, 0);
    for i in 0..6000 {
        let (n, n_nodes) = (1 + i % 10, 1 + i / 10 % 5);
        let item_s = items(&mut random, n, [2.0, 6.0, 20.0][i % 3]);
        let limits = (
            [0.0, 3.0, 12.0][i / 3 % 3],
            [5.0, 10.0, 25.0][i / 9 % 3],
            [12.0, 25.0, 60.0][i / 27 % 3],
        );
        let shards = split(&item_s, limits.0, limits.1, limits.2, n_nodes);
        assert_covers(&shards, n);
        // The shortest is never above the longest.
        let (n_short, n_shards) =
            counts_of(&item_s, &shards, (limits.0, limits.1.min(limits.2), limits.2)).unwrap();
        let (fewest_short, most) =
            best_of_all(&item_s, (limits.0, limits.1.min(limits.2), limits.2));
        assert_eq!(n_short, fewest_short, "{shards:?} of {item_s:?} within {limits:?}");
        assert!(
            n_shards >= n_nodes.min(most),
            "{shards:?} of {item_s:?} within {limits:?} on {n_nodes}, {most}"
        );
        if n_short == 0 { n_without += 1 } else { n_with_short += 1 }
    }
    assert!(n_with_short > 500 && n_without > 500, "{n_with_short} and {n_without}");
}

#[test]
fn long_lists_are_covered_once_within_the_limits_and_evenly() {
    let mut random = SplitMix64(2);
    for i in 0..40 {
        // Items of a few seconds, of which every shard has dozens.
        let item_s: Vec<f64> =
            items(&mut random, 3000, 3.0).iter().map(|seconds| seconds.min(30.0)).collect();
        let n_nodes = 1 + i * 3;
        let shards = split(&item_s, 10.0, 60.0, 600.0, n_nodes);
        assert_covers(&shards, item_s.len());
        let seconds: Vec<f64> =
            shards.iter().map(|shard| 10.0 + item_s[shard.clone()].iter().sum::<f64>()).collect();
        assert!(seconds.iter().all(|seconds| (60.0..=600.0).contains(seconds)), "{seconds:?}");
        let total: f64 = item_s.iter().sum();
        assert_eq!(shards.len() % n_nodes, 0, "{} on {n_nodes}", shards.len());
        // Each shard is off its even share by half an item at most, which the others share.
        let even = 10.0 + total / shards.len() as f64;
        assert!(
            seconds.iter().all(|seconds| (seconds - even).abs() <= 30.0),
            "{seconds:?} for {even}"
        );
        assert_eq!(shards, split(&item_s, 10.0, 60.0, 600.0, n_nodes));
    }
}

#[test]
fn durations_that_are_not_numbers_count_as_zero() {
    for bad in [f64::NAN, -5.0, f64::NEG_INFINITY] {
        let with = split(&[10.0, bad, 10.0, 10.0], 0.0, 10.0, 20.0, 1);
        assert_eq!(with, split(&[10.0, 0.0, 10.0, 10.0], 0.0, 10.0, 20.0, 1));
        assert_covers(&split(&[10.0; 5], bad, 10.0, 20.0, 1), 5);
        assert_covers(&split(&[10.0; 5], 1.0, bad, bad, 0), 5);
    }
    // The shortest is cut to the longest: 2 each.
    assert_eq!(split(&[10.0; 4], 0.0, 50.0, 20.0, 1), [0..2, 2..4]);
}

#[test]
fn a_hundred_thousand_items_are_divided_in_linear_time() {
    // A quadratic algorithm would need 10¹⁰ steps here.
    let shards = split(&[0.001; 100_000], 1.0, 60.0, 600.0, 7);
    assert_covers(&shards, 100_000);
    assert_eq!(shards.len(), 1);
}
