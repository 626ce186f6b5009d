//! Numbers and decisions with what an f32 evaluation may make of them instead.

/// A number, and how far its f32 evaluation may lie from it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Known {
    pub value: f64,
    pub error: f64,
}

impl Known {
    pub const NOTHING: Known = Known { value: 0.0, error: 0.0 };
    pub const ONE: Known = Known { value: 1.0, error: 0.0 };

    /// `value` of what may be as little as `low` and as much as `high`.
    pub fn between(low: f64, value: f64, high: f64) -> Known {
        Known { value, error: (high - value).max(value - low) }
    }

    pub fn plus(self, b: Known) -> Known {
        Known { value: self.value + b.value, error: self.error + b.error }
    }

    pub fn times(self, b: Known) -> Known {
        let error = self.value.abs() * b.error + b.value.abs() * self.error + self.error * b.error;
        Known { value: self.value * b.value, error }
    }

    pub fn scaled(self, by: f64) -> Known {
        Known { value: self.value * by, error: self.error * by.abs() }
    }

    /// 1 − self.
    pub fn rest(self) -> Known {
        Known { value: 1.0 - self.value, ..self }
    }

    /// `self`, in doubt whether it is not `b`.
    pub fn or(self, b: Known) -> Known {
        Known { error: self.error.max((self.value - b.value).abs() + b.error), ..self }
    }

    /// `self` where `d`, else `b`.
    pub fn where_or(self, d: Decision, b: Known) -> Known {
        let (is, other) = if d.taken { (self, b) } else { (b, self) };
        if d.sure { is } else { is.or(other) }
    }

    pub fn is_nothing(self) -> bool {
        self.value == 0.0 && self.error == 0.0
    }

    pub fn is_positive(self) -> Decision {
        Decision {
            taken: self.value > 0.0,
            sure: self.error == 0.0 || self.error < self.value.abs(),
        }
    }
}

/// What is decided, and whether rounding cannot decide otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decision {
    pub taken: bool,
    pub sure: bool,
}

impl Decision {
    pub const YES: Decision = Decision { taken: true, sure: true };
    pub const NO: Decision = Decision { taken: false, sure: true };

    /// a > b, their difference known to `slack`.
    pub fn above(a: f64, b: f64, slack: f64) -> Decision {
        Decision { taken: a > b, sure: (a - b).abs() > slack }
    }

    /// a > b.
    pub fn greater(a: Known, b: Known) -> Decision {
        Decision::above(a.value, b.value, a.error + b.error)
    }

    /// The first of what is possible is the law's.
    pub fn of(mut possible: impl Iterator<Item = bool>) -> Decision {
        let taken = possible.next().unwrap_or(false);
        Decision { taken, sure: possible.all(|p| p == taken) }
    }

    pub fn not(self) -> Decision {
        Decision { taken: !self.taken, ..self }
    }

    /// One that surely is not taken makes the other's doubt no matter.
    pub fn and(self, b: Decision) -> Decision {
        let sure = (self.sure && b.sure) || self == Decision::NO || b == Decision::NO;
        Decision { taken: self.taken && b.taken, sure }
    }

    pub fn or(self, b: Decision) -> Decision {
        self.not().and(b.not()).not()
    }

    pub fn is_possible(self) -> bool {
        self.taken || !self.sure
    }
}
