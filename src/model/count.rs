//! Number of a cloud's particles that are drawn, by its distance and size: C (4)–(6),
//! model.md §3.

/// Fraction of a particle below which nothing of a group is drawn: at distances over 14 a, some
/// 3900 d₀. It keeps every factor within f32. With `conserve` less than this share of the group's
/// optical depth is lost at once.
pub const MIN_DRAWN: f64 = 1.0 / 1_048_576.0;

/// Law of the particle count over distance. *Source*: C (4)–(6).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Count {
    /// Decay constant a.
    pub a: f64,
    /// Reference distance d₀, scene units.
    pub d0: f64,
    /// Whether n(d₀, r₀) = n₀, as C's text says, instead of e^{−1/a} n₀, as C's formula gives.
    pub normalised: bool,
    /// Whether κ grows as the count falls.
    pub conserve: bool,
}

/// The part of a group that is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnCount {
    /// Number of first particles that are drawn.
    pub n: u32,
    /// Factor on κ of all drawn particles.
    pub kappa_scale: f64,
    /// Factor on κ of the last drawn particle, in (0, 1].
    pub last_weight: f64,
}

impl DrawnCount {
    /// Nothing is drawn.
    pub const NOTHING: DrawnCount = DrawnCount { n: 0, kappa_scale: 1.0, last_weight: 1.0 };

    /// Returns the count that draws all `n` particles.
    pub fn all(n: u32) -> DrawnCount {
        DrawnCount { n, ..DrawnCount::NOTHING }
    }
}

impl Count {
    /// Returns x/N, the share of a cloud's particles that is drawn at `distance` of a cloud of
    /// `scale` r/r₀; at most 1.
    pub fn share(&self, scale: f64, distance: f64) -> f64 {
        let nearer = if self.normalised { self.d0 } else { 0.0 };
        let share = scale.powi(3) * ((nearer - distance) / (self.a * self.d0)).exp();
        // NaN passes through and draws nothing.
        if share >= 1.0 { 1.0 } else { share }
    }

    /// Returns the part that is drawn of a group of `n` particles when `share` of its cloud is
    /// drawn.
    pub fn drawn(&self, n: u32, share: f64) -> DrawnCount {
        let x = f64::from(n) * share;
        if x.is_nan() || x < MIN_DRAWN {
            return DrawnCount::NOTHING;
        }
        // A single particle stands for at most all of the group. Below one particle it fades with
        // x; otherwise it would stay as dense as the whole group until it vanished.
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
    fn all_are_drawn_at_the_eye_and_none_far_away() {
        assert_eq!(COUNT.drawn(7, COUNT.share(1.0, 0.0)), DrawnCount::all(7));
        assert_eq!(COUNT.drawn(0, 1.0), DrawnCount::NOTHING);
        for distance in [1e6, 1e300, f64::INFINITY, f64::NAN] {
            assert_eq!(
                COUNT.drawn(1000, COUNT.share(1.0, distance)),
                DrawnCount::NOTHING,
                "{distance}"
            );
        }
        // As long as anything is drawn, every factor is a normal f32.
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
            // Below one particle, its density fades.
            let of_all = if sum < 1.0 { sum } else { 1.0 };
            assert!((sum * drawn.kappa_scale - 37.0 * of_all).abs() < 1e-12, "{k}");
        }
    }
}
