//! Ranges of the numbers in input files, so that the f32 arithmetic on the device carries all that
//! is computed from them. f32's normal numbers run from 1.2e-38 to 3.4e38.
//!
//! A number of at most 1e15 can be squared and summed over a vector (3e30), and a length can be
//! multiplied by a wave number or divided by a distance of 1e-15 (1e30); both leave orders of
//! magnitude for constants. Products of three such factors are checked by themselves
//! (`scene_keys/device_range.rs`).

use std::fmt;

use glam::DVec3;

/// Upper limit of coordinates, lengths, times, κ, optical depths, irradiance and colours.
pub const GREATEST: f64 = 1e15;
/// Lower limit of lengths that something is divided by: σ, wavelengths, the near distance. Its
/// square is 1e-30, and 1e15 / 1e-15 is 1e30: both are normal numbers.
pub const LEAST: f64 = 1e-15;
/// Lower limit of box edges. They are only multiplied by numbers of 24 bits: 1e-30 · 2⁻²⁴ is 6e-38,
/// still a normal number.
pub const LEAST_EXTENT: f64 = 1e-30;
/// Upper limit of a factor on an irradiance that colours are a factor on too: 1e15 · 1e15 · 1e6 is
/// 1e36.
pub const GREATEST_SHARE: f64 = 1e6;
/// Upper limit of n_s: a lobe a thousandth of a degree wide. A narrower one has no number between
/// two neighbouring directions in f32.
pub const GREATEST_EXPONENT: f64 = 1e6;
/// Lower limit of the distance below which a point light's irradiance stops growing: 1e15 / (1e-9)²
/// is 1e33, still a normal number.
pub const LEAST_LIGHT_RADIUS: f64 = 1e-9;

/// Range of numbers of either sign.
pub const COORDINATE: Bounds = Bounds::Within(-GREATEST, GREATEST);
/// Range of numbers that cannot be negative.
pub const AMOUNT: Bounds = Bounds::Within(0.0, GREATEST);
/// Range of numbers that something is divided by.
pub const DIVISOR: Bounds = Bounds::Within(LEAST, GREATEST);
/// Range of shares of a whole.
pub const SHARE: Bounds = Bounds::Within(0.0, 1.0);

/// Range of a finite number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bounds {
    /// Every finite number.
    Any,
    /// Both ends allowed.
    Within(f64, f64),
    /// The first end allowed, the second not.
    From(f64, f64),
    /// Neither end allowed.
    Between(f64, f64),
}

impl Bounds {
    /// Returns whether `v` is finite and in the range.
    #[inline]
    pub fn contains(self, v: f64) -> bool {
        v.is_finite()
            && match self {
                Bounds::Any => true,
                Bounds::Within(low, high) => (low..=high).contains(&v),
                Bounds::From(low, high) => (low..high).contains(&v),
                Bounds::Between(low, high) => v > low && v < high,
            }
    }
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (from, low, to, high) = match *self {
            Bounds::Any => return write!(f, "a finite number"),
            Bounds::Within(low, high) => ("from", low, "to", high),
            Bounds::From(low, high) => ("from", low, "to below", high),
            Bounds::Between(low, high) => ("above", low, "and below", high),
        };
        write!(f, "a number {from} {} {to} {}", shortest(low), shortest(high))
    }
}

/// Range of an integer, with both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegerBounds {
    /// The least integer allowed.
    pub low: u32,
    /// The greatest integer allowed.
    pub high: u32,
}

impl fmt::Display for IntegerBounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "an integer from {} to {}", self.low, self.high)
    }
}

/// Writes a number with the fewest digits that read back as the same number, and with an exponent
/// where plain digits would run long.
pub fn shortest(v: f64) -> String {
    let plain = v == 0.0 || (1e-4..1e9).contains(&v.abs());
    if plain { format!("{v}") } else { format!("{v:e}") }
}

/// Writes a computed number for a message, in four digits.
pub fn rounded(v: f64) -> String {
    format!("{v:.3e}")
}

/// Returns the expected range when `v` is no coordinate.
#[inline]
pub fn wrong_coordinate(v: f64) -> Option<String> {
    (!COORDINATE.contains(v)).then(|| COORDINATE.to_string())
}

/// Returns the expected range when `v` is no size: neither 0 nor a number from `least` to
/// [`GREATEST`]. With `least` 0 every number from 0 on is a size.
#[inline]
pub fn wrong_size(v: f64, least: f64) -> Option<String> {
    let range = Bounds::Within(least, GREATEST);
    let expected = || if least == 0.0 { range.to_string() } else { format!("0 or {range}") };
    (!is_size(v, least)).then(expected)
}

/// Returns whether `v` is a size, as in [`wrong_size`].
#[inline]
pub fn is_size(v: f64, least: f64) -> bool {
    v == 0.0 || Bounds::Within(least, GREATEST).contains(v)
}

/// Returns whether the device can carry a place.
pub fn is_carried_place(place: DVec3) -> bool {
    place.to_array().into_iter().all(|v| COORDINATE.contains(v))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f32_carries_products_of_numbers_in_the_bounds() {
        let f = |v: f64| v as f32;
        assert!((f(GREATEST) * f(GREATEST) * 1e6).is_finite());
        assert!((f(GREATEST) / f(LEAST)).is_finite());
        assert!(
            (f(LEAST) * f(LEAST)).is_normal() && (f(LEAST_EXTENT) * 2f32.powi(-24)).is_normal()
        );
    }

    #[test]
    fn a_size_is_zero_or_between_two_ends() {
        for good in [0.0, 1e-15, 1.0, 1e15] {
            assert_eq!(wrong_size(good, LEAST), None);
        }
        for bad in [-1.0, 9e-16, 1.1e15, f64::NAN] {
            assert_eq!(wrong_size(bad, LEAST).as_deref(), Some("0 or a number from 1e-15 to 1e15"));
        }
        assert_eq!(wrong_size(1e-300, 0.0), None);
        assert_eq!(wrong_size(-1.0, 0.0).as_deref(), Some("a number from 0 to 1e15"));
        assert_eq!(wrong_coordinate(-1.1e15).as_deref(), Some("a number from -1e15 to 1e15"));
        assert_eq!(wrong_coordinate(-1e15), None);
    }

    #[test]
    fn numbers_are_written_with_the_fewest_digits() {
        let short = [0.0, -0.0, 0.1, -3.0, 6.12438e-7, 1e300].map(shortest);
        assert_eq!(short, ["0", "-0", "0.1", "-3", "6.12438e-7", "1e300"]);
    }
}
