//! How well diagnosed clouds agree with given ones, cell by cell.

use std::ops::Add;

use super::statistics::FAINT;

/// Cells by whether they have clouds in truth and by a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Agreement {
    /// Cells with both.
    pub n_hits: usize,
    /// Cells with given clouds alone.
    pub n_missed: usize,
    /// Cells with diagnosed clouds alone.
    pub n_false: usize,
    /// Cells with neither.
    pub n_clear: usize,
}

impl Agreement {
    /// Compares extinctions by cell; a cell has clouds above [`FAINT`].
    pub fn of(given: &[f64], diagnosed: &[f64]) -> Agreement {
        let mut all = Agreement::default();
        for (given, diagnosed) in given.iter().zip(diagnosed) {
            let count = match (*given > FAINT, *diagnosed > FAINT) {
                (true, true) => &mut all.n_hits,
                (true, false) => &mut all.n_missed,
                (false, true) => &mut all.n_false,
                (false, false) => &mut all.n_clear,
            };
            *count += 1;
        }
        all
    }

    /// Returns the number of diagnosed cells over that of given ones; `None` without given clouds.
    pub fn bias(&self) -> Option<f64> {
        quotient(self.n_hits + self.n_false, self.n_hits + self.n_missed)
    }

    /// Returns the share of given clouds that the diagnosis has.
    pub fn hit_rate(&self) -> Option<f64> {
        quotient(self.n_hits, self.n_hits + self.n_missed)
    }

    /// Returns the share of clear cells that the diagnosis has clouds in.
    pub fn false_alarm_rate(&self) -> Option<f64> {
        quotient(self.n_false, self.n_false + self.n_clear)
    }

    /// Returns the share of diagnosed clouds that are none.
    pub fn false_alarm_ratio(&self) -> Option<f64> {
        quotient(self.n_false, self.n_hits + self.n_false)
    }
}

impl Add for Agreement {
    type Output = Agreement;

    fn add(self, other: Agreement) -> Agreement {
        Agreement {
            n_hits: self.n_hits + other.n_hits,
            n_missed: self.n_missed + other.n_missed,
            n_false: self.n_false + other.n_false,
            n_clear: self.n_clear + other.n_clear,
        }
    }
}

fn quotient(part: usize, whole: usize) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_by_hand() {
        let given = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let diagnosed = [1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1e-7];
        let all = Agreement::of(&given, &diagnosed);
        assert_eq!(all, Agreement { n_hits: 3, n_missed: 1, n_false: 2, n_clear: 4 });
        assert_eq!((all.bias(), all.hit_rate()), (Some(1.25), Some(0.75)));
        assert_eq!((all.false_alarm_rate(), all.false_alarm_ratio()), (Some(2.0 / 6.0), Some(0.4)));
        let none = Agreement::of(&[0.0], &[0.0]);
        assert_eq!((none.bias(), none.false_alarm_rate()), (None, Some(0.0)));
    }
}
