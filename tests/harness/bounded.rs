//! Running error analysis: numbers with a bound on the error of their evaluation in f32.
//!
//! The bounds follow Vulkan's guarantees (specification, "Precision and Operation of SPIR-V
//! Instructions"): +, −, × correctly rounded (contraction to fma only rounds less), division 2.5
//! ulp, exp and exp2 3 + 2|x| ulp, log and log2 3 ulp or 2⁻²¹ near 1, inversesqrt 2 ulp. An ulp is
//! at most 2u of the result, u = 2⁻²⁴. A result below the smallest normal number may be flushed to
//! zero.

#![allow(dead_code, reason = "each test binary uses its own part")]

/// Unit round-off of f32.
pub const U: f64 = 1.0 / 16_777_216.0;
/// Smallest normal f32: the error of a flush to zero.
const TINY: f64 = 1.175_494_350_822_287_5e-38;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounded {
    pub value: f64,
    pub error: f64,
}

impl Bounded {
    pub fn exact(value: f64) -> Bounded {
        Bounded { value, error: 0.0 }
    }

    /// Returns a constant or input that was rounded to f32 once.
    pub fn once(value: f64) -> Bounded {
        Bounded { value, error: U * value.abs() }
    }

    /// The computed number is rounded, which is at most |value| + inherited error.
    fn rounded(value: f64, inherited: f64, units: f64) -> Bounded {
        Bounded { value, error: inherited + units * U * (value.abs() + inherited) + TINY }
    }

    pub fn plus(self, b: Bounded) -> Bounded {
        Bounded::rounded(self.value + b.value, self.error + b.error, 1.0)
    }

    pub fn minus(self, b: Bounded) -> Bounded {
        self.plus(b.scaled(-1.0))
    }

    pub fn times(self, b: Bounded) -> Bounded {
        let inherited =
            self.value.abs() * b.error + b.value.abs() * self.error + self.error * b.error;
        Bounded::rounded(self.value * b.value, inherited, 1.0)
    }

    pub fn over(self, b: Bounded) -> Bounded {
        let value = self.value / b.value;
        // |a'/b' − a/b| ≤ (δa + |a/b| δb)/|b'|; |b'| ≥ |b| − δb. If the divisor may be 0, there is
        // no bound.
        let least = b.value.abs() - b.error;
        let inherited =
            if least > 0.0 { (self.error + value.abs() * b.error) / least } else { f64::INFINITY };
        Bounded::rounded(value, inherited, 5.0)
    }

    /// Multiplies by a power of two or by −1, which is exact.
    pub fn scaled(self, by: f64) -> Bounded {
        Bounded { value: self.value * by, error: self.error * by.abs() }
    }

    pub fn squared(self) -> Bounded {
        self.times(self)
    }

    /// Returns max(self, 0), which does not increase errors.
    pub fn at_least_0(self) -> Bounded {
        Bounded { value: self.value.max(0.0), error: self.error }
    }

    /// Returns max(self, a) with an f32 number `a`.
    pub fn at_least(self, a: f64) -> Bounded {
        Bounded { value: self.value.max(a), error: self.error }
    }

    /// Clamps to [0, 1], which does not increase errors.
    pub fn within_0_and_1(self) -> Bounded {
        Bounded { value: self.value.clamp(0.0, 1.0), error: self.error }
    }

    /// Returns √self: 1 / inversesqrt, which is 2 ulp and a division.
    pub fn root(self) -> Bounded {
        let value = self.value.sqrt();
        let inherited = value - (self.value - self.error).max(0.0).sqrt();
        Bounded::rounded(value, inherited, 4.0 + 5.0)
    }

    pub fn exp(self) -> Bounded {
        let value = self.value.exp();
        let ulps = 3.0 + 2.0 * (self.value.abs() + self.error);
        Bounded::rounded(value, value * self.error.exp_m1(), 2.0 * ulps)
    }

    /// Returns ln, or log2 in units of ln 2: 4 ulp, or 2⁻²¹ from ½ to 2; unbounded if the number
    /// may be 0. Vulkan promises 3 ulp; log2 x times ln 2 takes up to one more (NVIDIA).
    pub fn log(self) -> Bounded {
        let value = self.value.ln();
        let inherited = if self.error < self.value {
            -(-self.error / self.value).ln_1p()
        } else {
            f64::INFINITY
        };
        let near_1 = self.value - self.error < 2.0 && self.value + self.error > 0.5;
        let promised = if near_1 { 2f64.powi(-21) } else { 0.0 };
        Bounded::rounded(value, inherited + promised, 8.0)
    }

    pub fn exp2(self) -> Bounded {
        let value = self.value.exp2();
        let ulps = 3.0 + 2.0 * (self.value.abs() + self.error);
        Bounded::rounded(value, value * (self.error * std::f64::consts::LN_2).exp_m1(), 2.0 * ulps)
    }
}

/// Returns Σ aᵢbᵢ in any order: every term passes at most three roundings.
pub fn dot(a: [Bounded; 3], b: [Bounded; 3]) -> Bounded {
    let products = [0, 1, 2].map(|i| a[i].times(b[i]));
    let sum = products[0].plus(products[1]).plus(products[2]);
    let magnitude: f64 = products.iter().map(|p| p.value.abs() + p.error).sum();
    Bounded {
        value: sum.value,
        error: products.iter().map(|p| p.error).sum::<f64>() + 2.001 * U * magnitude + TINY,
    }
}

pub fn exact3(v: [f32; 3]) -> [Bounded; 3] {
    v.map(|v| Bounded::exact(f64::from(v)))
}

/// A small deterministic generator (SplitMix64) of test inputs.
pub struct Random(pub u64);

impl Random {
    pub fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Returns a number uniform in [low, high), rounded to f32.
    pub fn within(&mut self, low: f64, high: f64) -> f32 {
        (low + (high - low) * (self.word() >> 11) as f64 / (1u64 << 53) as f64) as f32
    }

    /// Returns a unit vector, rounded to f32.
    pub fn direction(&mut self) -> [f32; 3] {
        loop {
            let v = [0; 3].map(|_| f64::from(self.within(-1.0, 1.0)));
            let l = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            if l > 0.1 && l <= 1.0 {
                return v.map(|x| (x / l) as f32);
            }
        }
    }
}

/// Returns the greatest |value − truth|/bound; NaN counts as infinite.
pub fn greatest_ratio(values: &[f64], truths: &[f64], bounds: &[f64]) -> f64 {
    assert!(values.len() == truths.len() && values.len() == bounds.len());
    let ratio = |i: usize| {
        let error = (values[i] - truths[i]).abs();
        if error == 0.0 { 0.0 } else { error / bounds[i] }
    };
    let ratios = (0..values.len()).map(ratio).map(|r| if r.is_nan() { f64::INFINITY } else { r });
    ratios.fold(0.0, f64::max)
}
