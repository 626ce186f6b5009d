//! Numbers and decisions with bounds on their f32 evaluation.

/// A number with a bound on the error of its f32 evaluation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Bounded {
    /// Exact value.
    pub value: f64,
    /// Bound on the error.
    pub error: f64,
}

impl Bounded {
    /// Exactly 0.
    pub const ZERO: Bounded = Bounded { value: 0.0, error: 0.0 };
    /// Exactly 1.
    pub const ONE: Bounded = Bounded { value: 1.0, error: 0.0 };

    /// Returns an exact number.
    pub fn exact(value: f64) -> Bounded {
        Bounded { value, error: 0.0 }
    }

    /// Returns an input or constant that was rounded once.
    pub fn once(value: f64, u: f64) -> Bounded {
        Bounded::exact(value).rounded(u)
    }

    /// Returns the number after a rounding. The computed number is rounded, whose magnitude is at
    /// most |value| + error.
    pub fn rounded(self, u: f64) -> Bounded {
        Bounded { error: self.error + u * (self.value.abs() + self.error), ..self }
    }

    /// Returns `value` whose evaluation lies between `low` and `high`.
    pub fn between(low: f64, value: f64, high: f64) -> Bounded {
        Bounded { value, error: (high - value).max(value - low) }
    }

    /// Returns the sum.
    pub fn plus(self, b: Bounded) -> Bounded {
        Bounded { value: self.value + b.value, error: self.error + b.error }
    }

    /// Returns the product: |ab − a'b'| ≤ |a|δb + |b|δa + δaδb.
    pub fn times(self, b: Bounded) -> Bounded {
        let error = self.value.abs() * b.error + b.value.abs() * self.error + self.error * b.error;
        Bounded { value: self.value * b.value, error }
    }

    /// Returns the value times an exact factor.
    pub fn scaled(self, by: f64) -> Bounded {
        Bounded { value: self.value * by, error: self.error * by.abs() }
    }

    /// Returns 1 − self.
    pub fn complement(self) -> Bounded {
        Bounded { value: 1.0 - self.value, ..self }
    }

    /// Returns `self` where rounding may select `b` instead.
    pub fn or(self, b: Bounded) -> Bounded {
        Bounded { error: self.error.max((self.value - b.value).abs() + b.error), ..self }
    }

    /// Returns `self` if `d` is true, else `b`, with both in the bound if `d` is not sure.
    pub fn select(self, d: Decision, b: Bounded) -> Bounded {
        let (is, other) = if d.is_true { (self, b) } else { (b, self) };
        if d.is_sure { is } else { is.or(other) }
    }

    /// Returns whether the value is exactly 0.
    pub fn is_zero(self) -> bool {
        self.value == 0.0 && self.error == 0.0
    }

    /// Returns whether the value is positive.
    pub fn is_positive(self) -> Decision {
        Decision {
            is_true: self.value > 0.0,
            is_sure: self.error == 0.0 || self.error < self.value.abs(),
        }
    }
}

/// A decision that rounding may turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decision {
    /// Exact outcome.
    pub is_true: bool,
    /// Whether rounding cannot change the outcome.
    pub is_sure: bool,
}

impl Decision {
    /// Surely true.
    pub const YES: Decision = Decision { is_true: true, is_sure: true };
    /// Surely false.
    pub const NO: Decision = Decision { is_true: false, is_sure: true };

    /// Returns whether a > b, with the difference known to `slack`.
    pub fn above(a: f64, b: f64, slack: f64) -> Decision {
        Decision { is_true: a > b, is_sure: (a - b).abs() > slack }
    }

    /// Returns whether a > b.
    pub fn greater(a: Bounded, b: Bounded) -> Decision {
        Decision::above(a.value, b.value, a.error + b.error)
    }

    /// Returns the decision among `possible` outcomes, the exact one first.
    pub fn of(mut possible: impl Iterator<Item = bool>) -> Decision {
        let taken = possible.next().unwrap_or(false);
        Decision { is_true: taken, is_sure: possible.all(|p| p == taken) }
    }

    /// Returns the opposite.
    pub fn negated(self) -> Decision {
        Decision { is_true: !self.is_true, ..self }
    }

    /// A surely false decision makes the other's uncertainty irrelevant.
    pub fn and(self, b: Decision) -> Decision {
        let sure = (self.is_sure && b.is_sure) || self == Decision::NO || b == Decision::NO;
        Decision { is_true: self.is_true && b.is_true, is_sure: sure }
    }

    /// Returns whether either is true.
    pub fn or(self, b: Decision) -> Decision {
        self.negated().and(b.negated()).negated()
    }

    /// Returns whether the decision may come out true.
    pub fn is_possible(self) -> bool {
        self.is_true || !self.is_sure
    }
}
