//! How many attempts a box's particles take (P, Fig. 1): a place that falls outside of the box is
//! drawn by lot anew, so a box that accepts few is dear, and one whose particles run out of
//! attempts has them folded back.

use crate::model::boxes::{CloudBox, Form};
use crate::passes::generate::FOLDED;
use crate::reference::generate::{Acceptance, generate_particle};

/// Particles that are counted at most. 64 attempts each take some hundredths of a second; the share
/// of accepted attempts is then known to 1/√4096, 1.6 %, or better.
pub const MOST_COUNTED: u32 = 4096;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counted {
    pub acceptance: Acceptance,
    /// The box's first particles: all of them, or [`MOST_COUNTED`].
    pub n_counted: u32,
    pub n_particles: u32,
}

/// Counts the attempts of a box's own particles, by the f64 reference: those that the device makes
/// too, but where an attempt falls on a face but for rounding.
pub fn counted(b: &CloudBox, i_box: u32, seed: u32, form: Form) -> Counted {
    let n_counted = b.n_particles.min(MOST_COUNTED);
    // Depth and scale of the blobs say nothing about places.
    let particles: Vec<_> =
        (0..n_counted).map(|i| generate_particle(b, i_box, seed, form, 1.0, 1.0, i)).collect();
    Counted { acceptance: Acceptance::of(&particles), n_counted, n_particles: b.n_particles }
}

/// What the device counted of every box, from the statuses of their particles, in order
/// (`Renderer::status`). Boxes whose particles have not been made, or are not among them, have no
/// rate.
pub fn of_statuses(boxes: &[CloudBox], statuses: &[u32]) -> Vec<Counted> {
    let mut rest = statuses;
    let of = |b: &CloudBox| {
        let (own, others) = rest.split_at(rest.len().min(b.n_particles as usize));
        rest = others;
        let n_made = own.iter().filter(|status| **status & !FOLDED > 0).count() as u64;
        let n_folded = own.iter().filter(|status| **status & FOLDED != 0).count() as u64;
        let n_attempts = own.iter().map(|status| u64::from(status & !FOLDED)).sum();
        let acceptance = Acceptance { n_attempts, n_accepted: n_made - n_folded, n_folded };
        Counted { acceptance, n_counted: n_made as u32, n_particles: b.n_particles }
    };
    boxes.iter().map(of).collect()
}

impl Counted {
    /// Accepted over made attempts; none of an empty box.
    pub fn rate(&self) -> Option<f64> {
        self.acceptance.rate()
    }

    /// Whether the counts are those of the whole box.
    pub fn is_whole(&self) -> bool {
        self.n_counted == self.n_particles
    }
}

/// Attempts over all boxes, as a mean over their particles; boxes that were not counted as a whole
/// weigh by their particles.
pub fn mean_rate(boxes: &[Counted]) -> Option<f64> {
    let weight = |c: &Counted| f64::from(c.n_particles) / f64::from(c.n_counted.max(1));
    let sum = |of: fn(&Acceptance) -> u64| {
        boxes.iter().map(|c| of(&c.acceptance) as f64 * weight(c)).sum::<f64>()
    };
    let n_attempts = sum(|a| a.n_attempts);
    (n_attempts > 0.0).then(|| sum(|a| a.n_accepted) / n_attempts)
}

#[cfg(test)]
mod tests {
    use super::super::samples::unit_box;
    use super::*;
    use crate::reference::generate::{generate_box, is_inside, offset};

    #[test]
    fn the_rate_is_the_share_of_the_volume_that_lands_inside() {
        let b = CloudBox { n_particles: 100_000, ..unit_box() };
        let counted = counted(&b, 3, 7, Form::Centred);
        assert_eq!((counted.n_counted, counted.is_whole()), (MOST_COUNTED, false));
        // The mean over a lattice of the attempts' own law.
        let n = 60;
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
        let places = (0..n)
            .flat_map(|i| (0..n).flat_map(move |j| (0..n).map(move |k| [at(i), at(j), at(k)])));
        let n_inside = places
            .filter(|u| is_inside(offset(b.extent, Form::Centred, *u), 0.5 * b.extent))
            .count();
        let expected = n_inside as f64 / f64::from(n).powi(3);
        // Five standard deviations of 4096 geometric counts: p √((1 − p)/4096) each.
        let deviation = expected * ((1.0 - expected) / 4096.0).sqrt();
        let rate = counted.rate().unwrap();
        assert!((rate - expected).abs() < 5.0 * deviation, "{rate} {expected}");
        assert!(expected > 0.01 && expected < 0.9);
    }

    #[test]
    fn the_devices_statuses_are_counted_box_by_box() {
        let boxes = [3, 0, 2, 4].map(|n_particles| CloudBox { n_particles, ..unit_box() });
        // The last box's particles have not been made.
        let counted = of_statuses(&boxes, &[1, 64 | FOLDED, 5, 2, 2, 0, 0, 0, 0]);
        let of = |n_attempts, n_accepted, n_folded| Acceptance { n_attempts, n_accepted, n_folded };
        assert_eq!(
            counted.iter().map(|c| c.acceptance).collect::<Vec<_>>(),
            [of(70, 2, 1), of(0, 0, 0), of(4, 2, 0), of(0, 0, 0)]
        );
        assert_eq!(
            counted.iter().map(Counted::is_whole).collect::<Vec<_>>(),
            [true, true, true, false]
        );
        assert_eq!((counted[0].rate(), counted[3].rate()), (Some(2.0 / 70.0), None));
        assert_eq!(mean_rate(&counted), Some(4.0 / 74.0));
        // As the reference counts them.
        let b = CloudBox { n_particles: 50, ..unit_box() };
        let word = |p: &crate::reference::generate::Generated| {
            p.n_attempts | if p.folded { FOLDED } else { 0 }
        };
        let words: Vec<u32> =
            generate_box(&b, 2, 9, Form::Centred, 1.0, 1.0).iter().map(word).collect();
        assert_eq!(of_statuses(&[b], &words), [super::counted(&b, 2, 9, Form::Centred)]);
    }

    #[test]
    fn a_small_box_is_counted_whole_and_an_empty_one_has_no_rate() {
        let b = CloudBox { n_particles: 50, ..unit_box() };
        let whole = counted(&b, 2, 9, Form::Centred);
        let particles = generate_box(&b, 2, 9, Form::Centred, 1.0, 1.0);
        assert_eq!((whole.acceptance, whole.is_whole()), (Acceptance::of(&particles), true));
        let empty = counted(&CloudBox { n_particles: 0, ..b }, 2, 9, Form::Centred);
        assert_eq!((empty.rate(), empty.is_whole(), mean_rate(&[empty])), (None, true, None));
        assert_eq!(mean_rate(&[whole, empty]), whole.rate());
        // One of 4096 counted that stands for twice as many weighs as two of them.
        let part = counted(&CloudBox { n_particles: 2 * MOST_COUNTED, ..b }, 0, 9, Form::Centred);
        let half = Counted { n_particles: MOST_COUNTED, ..part };
        assert_eq!(mean_rate(&[part, whole]), mean_rate(&[half, half, whole]));
    }
}
