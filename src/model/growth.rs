//! Growth of a cloud as a similarity about its own centre, in closed form of time
//! (model.md §13).

/// Least final scale. Beyond these two the particles would be specks, or cover the scene.
pub const MIN_SCALE: f64 = 1e-3;
/// Greatest final scale.
pub const MAX_SCALE: f64 = 1e3;

/// Growth of a cloud over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// Final lengths over those at time 0.
    pub to: f64,
    /// T: time in which a share of 1 − 1/e of the growth is done.
    pub time_s: f64,
}

impl Growth {
    /// No growth.
    pub const NONE: Growth = Growth { to: 1.0, time_s: 60.0 };

    /// Returns whether nothing grows.
    pub fn is_none(&self) -> bool {
        self.to == 1.0
    }

    /// Returns s(t) = 1 + (to − 1)(1 − e^{−t/T}); 1 before time 0, and exactly 1 without growth.
    pub fn at(&self, time_s: f64) -> f64 {
        if self.is_none() || time_s <= 0.0 {
            return 1.0;
        }
        1.0 - (self.to - 1.0) * libm::expm1(-time_s / self.time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_starts_at_one_and_tends_to_its_end() {
        let growth = Growth { to: 3.0, time_s: 10.0 };
        assert_eq!([-5.0, 0.0, f64::MAX].map(|t| growth.at(t)), [1.0, 1.0, 3.0]);
        // After T: 1 + 2 (1 − 1/e).
        assert!((growth.at(10.0) - (3.0 - 2.0 / std::f64::consts::E)).abs() < 1e-15);
        // The initial rate is (to − 1)/T.
        assert!((growth.at(1e-9) - 1.0 - 2e-10).abs() < 1e-15);
        assert!((Growth { to: 0.25, ..growth }.at(1e9) - 0.25).abs() < 1e-15);
        assert_eq!([0.0, 7.3, 1e15].map(|t| Growth::NONE.at(t)), [1.0; 3]);
    }
}
