//! Numbers and decisions with what an f32 evaluation may make of them instead.

/// A number, and how far its f32 evaluation may lie from it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Bounded {
    pub value: f64,
    pub error: f64,
}

impl Bounded {
    pub const ZERO: Bounded = Bounded { value: 0.0, error: 0.0 };
    pub const ONE: Bounded = Bounded { value: 1.0, error: 0.0 };

    /// `value` of what may be as little as `low` and as much as `high`.
    pub fn between(low: f64, value: f64, high: f64) -> Bounded {
        Bounded { value, error: (high - value).max(value - low) }
    }

    pub fn plus(self, b: Bounded) -> Bounded {
        Bounded { value: self.value + b.value, error: self.error + b.error }
    }

    pub fn times(self, b: Bounded) -> Bounded {
        let error = self.value.abs() * b.error + b.value.abs() * self.error + self.error * b.error;
        Bounded { value: self.value * b.value, error }
    }

    pub fn scaled(self, by: f64) -> Bounded {
        Bounded { value: self.value * by, error: self.error * by.abs() }
    }

    /// 1 − self.
    pub fn complement(self) -> Bounded {
        Bounded { value: 1.0 - self.value, ..self }
    }

    /// `self`, in doubt whether it is not `b`.
    pub fn or(self, b: Bounded) -> Bounded {
        Bounded { error: self.error.max((self.value - b.value).abs() + b.error), ..self }
    }

    /// `self` where `d`, else `b`.
    pub fn select(self, d: Decision, b: Bounded) -> Bounded {
        let (is, other) = if d.is_true { (self, b) } else { (b, self) };
        if d.is_sure { is } else { is.or(other) }
    }

    pub fn is_zero(self) -> bool {
        self.value == 0.0 && self.error == 0.0
    }

    pub fn is_positive(self) -> Decision {
        Decision {
            is_true: self.value > 0.0,
            is_sure: self.error == 0.0 || self.error < self.value.abs(),
        }
    }
}

/// What is decided, and whether rounding cannot decide otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decision {
    pub is_true: bool,
    pub is_sure: bool,
}

impl Decision {
    pub const YES: Decision = Decision { is_true: true, is_sure: true };
    pub const NO: Decision = Decision { is_true: false, is_sure: true };

    /// a > b, their difference known to `slack`.
    pub fn above(a: f64, b: f64, slack: f64) -> Decision {
        Decision { is_true: a > b, is_sure: (a - b).abs() > slack }
    }

    /// a > b.
    pub fn greater(a: Bounded, b: Bounded) -> Decision {
        Decision::above(a.value, b.value, a.error + b.error)
    }

    /// The first of what is possible is the law's.
    pub fn of(mut possible: impl Iterator<Item = bool>) -> Decision {
        let taken = possible.next().unwrap_or(false);
        Decision { is_true: taken, is_sure: possible.all(|p| p == taken) }
    }

    pub fn not(self) -> Decision {
        Decision { is_true: !self.is_true, ..self }
    }

    /// One that surely is not taken makes the other's doubt no matter.
    pub fn and(self, b: Decision) -> Decision {
        let sure = (self.is_sure && b.is_sure) || self == Decision::NO || b == Decision::NO;
        Decision { is_true: self.is_true && b.is_true, is_sure: sure }
    }

    pub fn or(self, b: Decision) -> Decision {
        self.not().and(b.not()).not()
    }

    pub fn is_possible(self) -> bool {
        self.is_true || !self.is_sure
    }
}
