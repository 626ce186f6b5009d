//! Times in turn: rounds in which every configuration has a turn of a few frames, and the scene as
//! it stands one every few others, so that each is compared with what the scene took just before
//! and just after it. Whatever a shared machine does over minutes falls on both alike.

use crate::measure::bootstrap::Bootstrap;
use crate::measure::stats::median;
use crate::studies::provenance::Figure;

/// Configurations between two turns of the scene as it stands, which is number 0.
pub const BETWEEN: usize = 4;

/// A few frames of one configuration, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    pub i_configuration: usize,
    pub i_round: usize,
    /// Of every frame; empty without timestamps.
    pub gpu_ms: Vec<f64>,
    pub frame_ms: Vec<f64>,
}

/// Which time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Time {
    /// Device time of all passes.
    Gpu,
    /// From the begin of the game step to the finished picture.
    Frame,
}

impl Time {
    pub const NAMES: [(&'static str, Time); 2] = [("gpu", Time::Gpu), ("frame", Time::Frame)];

    pub fn name(self) -> &'static str {
        Time::NAMES.iter().find(|(_, time)| *time == self).map_or("", |(name, _)| name)
    }

    fn of(self, turn: &Turn) -> Option<f64> {
        median(if self == Time::Gpu { &turn.gpu_ms } else { &turn.frame_ms })
    }
}

/// The turns of a round of `others`, there and, in every second round, back: 0 a b c d 0 e f 0.
pub fn order(others: &[usize], i_round: usize) -> Vec<usize> {
    let mut others = others.to_vec();
    if i_round % 2 == 1 {
        others.reverse();
    }
    let mut order = vec![0];
    for few in others.chunks(BETWEEN) {
        order.extend(few);
        order.push(0);
    }
    order
}

/// Of configuration `i` every turn's time by that of the scene's turns around it (their geometric
/// mean).
fn ratios(turns: &[Turn], i: usize, time: Time) -> Vec<f64> {
    let base = |turn: &&Turn| turn.i_configuration == 0;
    let mut found = Vec::new();
    for (k, turn) in turns.iter().enumerate().filter(|(_, turn)| turn.i_configuration == i) {
        let same_round = |other: &&Turn| other.i_round == turn.i_round;
        let before =
            turns[..k].iter().rev().take_while(same_round).find(base).and_then(|t| time.of(t));
        let after =
            turns[k + 1..].iter().take_while(same_round).find(base).and_then(|t| time.of(t));
        // A round that was cut short has none after it.
        let around: Vec<f64> = before.into_iter().chain(after).filter(|ms| *ms > 0.0).collect();
        let mean = (around.iter().map(|ms| ms.ln()).sum::<f64>() / around.len() as f64).exp();
        found.extend(time.of(turn).filter(|_| !around.is_empty()).map(|ms| ms / mean));
    }
    found
}

/// Median with a 95 % interval over `values`, which neighbours of each other know nothing of.
fn figure(values: &[f64]) -> Option<Figure> {
    let value = median(values)?;
    let interval = Bootstrap::default().median(values);
    // Of positive values a median is positive, however few there are to tell.
    Some(Figure { value, low: interval.map(|i| i.low.max(0.0)), high: interval.map(|i| i.high) })
}

/// What the turns say of configuration `i`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timed {
    /// Its time by that of the scene as it stands.
    pub by_base: Figure,
    /// That times the median of the scene as it stands, ms; of that itself its median, whose
    /// interval knows the drift.
    pub ms: Figure,
}

/// None where it has no turn, or there are no such times.
pub fn timed(turns: &[Turn], i: usize, time: Time) -> Option<Timed> {
    let of_base: Vec<f64> =
        turns.iter().filter(|t| t.i_configuration == 0).filter_map(|t| time.of(t)).collect();
    let base = figure(&of_base)?;
    if i == 0 {
        let one = Figure { value: 1.0, low: Some(1.0), high: Some(1.0) };
        return Some(Timed { by_base: one, ms: base });
    }
    let by_base = figure(&ratios(turns, i, time))?;
    let ms = |ratio: f64| ratio * base.value;
    let Figure { value, low, high } = by_base;
    Some(Timed { by_base, ms: Figure { value: ms(value), low: low.map(ms), high: high.map(ms) } })
}

/// Turns of configuration `i`.
pub fn n_turns(turns: &[Turn], i: usize) -> usize {
    turns.iter().filter(|turn| turn.i_configuration == i).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(i_configuration: usize, i_round: usize, ms: f64) -> Turn {
        Turn {
            i_configuration,
            i_round,
            gpu_ms: vec![ms],
            frame_ms: vec![ms + 1.0, ms + 1.0, ms + 90.0],
        }
    }

    #[test]
    fn the_scene_has_a_turn_before_and_after_every_few() {
        assert_eq!(order(&[1, 2, 3, 4, 5, 6], 0), [0, 1, 2, 3, 4, 0, 5, 6, 0]);
        assert_eq!(order(&[1, 2, 3, 4, 5, 6], 1), [0, 6, 5, 4, 3, 0, 2, 1, 0]);
        assert_eq!(order(&[], 3), [0]);
    }

    #[test]
    fn a_drift_falls_on_both() {
        // A machine that gets slower from turn to turn by 3 %, and one configuration that takes 0.8
        // of the scene's time.
        let mut turns = Vec::new();
        for i_round in 0..10 {
            for i in order(&[1, 2], i_round) {
                let speed = 1.03f64.powi(turns.len() as i32);
                turns.push(turn(i, i_round, speed * [10.0, 8.0, 20.0][i]));
            }
        }
        for (i, ratio) in [(1, 0.8), (2, 2.0)] {
            let found = timed(&turns, i, Time::Gpu).unwrap();
            assert!((found.by_base.value / ratio - 1.0).abs() < 0.02, "{found:?}");
            assert!(
                found.by_base.low.unwrap() <= ratio * 1.02
                    && found.by_base.high.unwrap() >= ratio * 0.98
            );
            let base = timed(&turns, 0, Time::Gpu).unwrap();
            assert!((found.ms.value - base.ms.value * found.by_base.value).abs() < 1e-12);
            assert_eq!(base.by_base.value, 1.0);
        }
        // Of a turn's frames the median counts: one that somebody disturbed does not.
        let frame = timed(&turns[..4], 1, Time::Frame).unwrap();
        assert!((frame.by_base.value - 9.0 / 11.0).abs() < 0.03);
    }

    #[test]
    fn what_was_cut_short_or_has_no_timestamps() {
        let cut = [turn(0, 0, 10.0), turn(1, 0, 5.0)];
        let found = timed(&cut, 1, Time::Gpu).unwrap();
        // A geometric mean of one rounds.
        assert!((found.by_base.value - 0.5).abs() < 1e-15 && found.by_base.low.is_none());
        assert_eq!((timed(&cut, 2, Time::Gpu), timed(&[], 0, Time::Gpu)), (None, None));
        let none = [
            Turn { gpu_ms: vec![], ..turn(0, 0, 1.0) },
            Turn { gpu_ms: vec![], ..turn(1, 0, 1.0) },
        ];
        assert_eq!(timed(&none, 1, Time::Gpu), None);
        assert!(timed(&none, 1, Time::Frame).is_some());
        // The scene of another round is not around it.
        assert_eq!(timed(&[turn(0, 0, 10.0), turn(1, 1, 5.0)], 1, Time::Gpu), None);
        assert_eq!((n_turns(&cut, 0), n_turns(&cut, 1), n_turns(&cut, 2)), (1, 1, 0));
    }
}
