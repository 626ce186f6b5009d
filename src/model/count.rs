//! How many of a cloud's particles are drawn, by its distance and size: C (4)–(6), docs/model.md
//! §3.

/// Of a group of which fewer than this of a particle would be drawn nothing is: at 14 a, some 3900
/// d₀, and farther. Keeps every factor within f32; with `conserve` less than this share of the
/// group's optical depth goes at once.
pub const MIN_DRAWN: f64 = 1.0 / 1_048_576.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Count {
    pub a: f64,
    /// Scene units.
    pub d0: f64,
    /// n(d₀, r₀) = n₀, as C says, and not e^{−1/a} n₀, as C's formula gives.
    pub normalised: bool,
    /// κ grows as the count falls.
    pub conserve: bool,
}

/// What is drawn of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnCount {
    /// The first so many of its particles.
    pub n: u32,
    /// Factor on the κ of all.
    pub kappa_scale: f64,
    /// Factor on the κ of the last one, in (0, 1].
    pub last_weight: f64,
}

impl DrawnCount {
    pub const NOTHING: DrawnCount = DrawnCount { n: 0, kappa_scale: 1.0, last_weight: 1.0 };

    pub fn all(n: u32) -> DrawnCount {
        DrawnCount { n, ..DrawnCount::NOTHING }
    }
}

impl Count {
    /// x/N: the share of a cloud's particles that is drawn at `distance` of a cloud of `scale`
    /// r/r₀; at most 1.
    pub fn share(&self, scale: f64, distance: f64) -> f64 {
        let nearer = if self.normalised { self.d0 } else { 0.0 };
        let share = scale.powi(3) * ((nearer - distance) / (self.a * self.d0)).exp();
        // What is no number stays none.
        if share >= 1.0 { 1.0 } else { share }
    }

    /// What is drawn of a group of `n` particles where `share` of its cloud is.
    pub fn drawn(&self, n: u32, share: f64) -> DrawnCount {
        let x = f64::from(n) * share;
        if x.is_nan() || x < MIN_DRAWN {
            return DrawnCount::NOTHING;
        }
        // One particle stands for all at most: below one it fades with x, where it would otherwise
        // stay as dense as all of them until it vanished.
        let kappa_scale = if self.conserve { (1.0 / share).min(f64::from(n)) } else { 1.0 };
        let n = (x.ceil() as u32).min(n);
        DrawnCount { n, kappa_scale, last_weight: x - f64::from(n - 1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: Count = Count { a: 280.0, d0: 1.0, normalised: false, conserve: true };

    #[test]
    fn all_at_the_eye_fewer_beyond_and_nothing_without_end() {
        assert_eq!(COUNT.drawn(7, COUNT.share(1.0, 0.0)), DrawnCount::all(7));
        assert_eq!(COUNT.drawn(0, 1.0), DrawnCount::NOTHING);
        for distance in [1e6, 1e300, f64::INFINITY, f64::NAN] {
            assert_eq!(
                COUNT.drawn(1000, COUNT.share(1.0, distance)),
                DrawnCount::NOTHING,
                "{distance}"
            );
        }
        // As long as anything is drawn every factor is a number that f32 has.
        let far = COUNT.drawn(1, MIN_DRAWN);
        assert_eq!((far.n, far.kappa_scale, far.last_weight), (1, 1.0, MIN_DRAWN));
        assert_eq!(Count { normalised: true, ..COUNT }.share(1.0, 0.0), 1.0);
        assert!(COUNT.share(10.0, 100.0) == 1.0 && COUNT.share(0.5, 0.0) == 0.125);
    }

    #[test]
    fn the_weights_add_up_to_the_count() {
        for k in 0..2000 {
            let share = f64::from(k) / 1999.0;
            let drawn = COUNT.drawn(37, share);
            if drawn == DrawnCount::NOTHING {
                continue;
            }
            let sum = f64::from(drawn.n - 1) + drawn.last_weight;
            assert!(
                (sum - 37.0 * share).abs() < 1e-13
                    && drawn.last_weight > 0.0
                    && drawn.last_weight <= 1.0
            );
            // Below one particle what it stands for fades.
            let of_all = if sum < 1.0 { sum } else { 1.0 };
            assert!((sum * drawn.kappa_scale - 37.0 * of_all).abs() < 1e-12, "{k}");
        }
    }
}
