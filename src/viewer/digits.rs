//! Numbers as panels and messages show them: with the digits that matter.

/// Smallest number of digits, whatever the resolution, so that a small number is not shown as 0.
const LEAST_DIGITS: i32 = 3;
/// Largest number of digits after the first one: about the precision of f64.
const MOST_DIGITS: i32 = 15;
/// Magnitudes that are written without an exponent. Others would need many zeros without meaning.
const PLAIN: std::ops::Range<f64> = 1e-4..1e9;

/// Writes `v` without the digits below `resolution`, and without trailing zeros.
///
/// At least three digits stay, so that a small number is not shown as 0. A number that reads back
/// from fewer digits is not padded.
pub fn format_to_resolution(v: f64, resolution: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return if v == 0.0 { "0".to_owned() } else { format!("{v}") };
    }
    let exponent = v.abs().log10().floor() as i32;
    let by_resolution = match resolution.is_finite() && resolution > 0.0 {
        // The small part keeps 0.001 at three decimals where its logarithm is a little below −3.
        true => (-resolution.log10() - 1e-9).ceil() as i32,
        false => LEAST_DIGITS - 1 - exponent,
    };
    // Digits after the first one.
    let n_digits = (by_resolution + exponent).clamp(LEAST_DIGITS - 1, MOST_DIGITS);
    let text = format!("{v:.*e}", n_digits as usize);
    // The written number decides: 9.999e-5 to three digits is 0.0001.
    let rounded: f64 = text.parse().unwrap_or(v);
    if !PLAIN.contains(&rounded.abs()) {
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{power}", trimmed(digits));
    }
    trimmed(&format!("{v:.*}", (n_digits - exponent).max(0) as usize)).to_owned()
}

/// Writes `v` with `n` significant digits at most.
pub fn format_significant(v: f64, n: i32) -> String {
    let exponent = if v == 0.0 { 0.0 } else { v.abs().log10().floor() };
    format_to_resolution(v, 10f64.powf(exponent - f64::from(n - 1)))
}

/// Returns a number without the zeros at the end of its decimals.
fn trimmed(text: &str) -> &str {
    if !text.contains('.') {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn digits_below_the_resolution_are_left_out() {
        for (v, resolution, expected) in [
            (0.1 + 0.2, 1e-5, "0.3"),
            (7.39642, 1e-5, "7.39642"),
            (-0.600002, 1e-5, "-0.6"),
            (-0.600002, 1e-6, "-0.600002"),
            (6.12438e-7, 1e-5, "6.12e-7"),
            (0.00034, 1e-2, "0.00034"),
            (1234.5678, 1e-2, "1234.57"),
            (1234.5678, 100.0, "1235"),
            (2.0, 0.1, "2"),
            (100.0, 0.1, "100"),
            (0.0, 0.1, "0"),
            (-0.0, 0.1, "0"),
            (1e15, 1.0, "1e15"),
            (9.9999e-5, 1e-5, "0.0001"),
            (999_999_999.7, 1.0, "1e9"),
            (1.0, 0.0, "1"),
            (8.731_787_123, f64::NAN, "8.73"),
        ] {
            assert_eq!(format_to_resolution(v, resolution), expected, "{v} to {resolution}");
        }
        assert_eq!(
            [
                format_significant(4.654_545, 3),
                format_significant(0.0, 3),
                format_significant(-1e-12 / 3.0, 4)
            ],
            ["4.65", "0", "-3.333e-13"]
        );
    }

    proptest! {
        #[test]
        fn shown_numbers_read_back_within_the_resolution(
            sign in prop::bool::ANY, power in -30.0..15.0f64, step in -12i32..6
        ) {
            let (v, resolution) =
                (if sign { -1.0 } else { 1.0 } * 10f64.powf(power), 10f64.powi(step));
            let text = format_to_resolution(v, resolution);
            let back: f64 = text.parse().expect("a number");
            // Half a unit of the last digit: of the resolution, or of the third digit. Beyond 15
            // digits f64 ends. Where a number lies halfway, `back` is one rounding of f64 away from
            // what is written, half an epsilon of it; the bound and the resolution have theirs.
            let bound = (0.5 * resolution).min(0.005 * v.abs()).max(1e-14 * v.abs());
            let rounding = f64::EPSILON * v.abs();
            prop_assert!((back - v).abs() <= bound + rounding, "{text} for {v} to {resolution}");
            prop_assert!(text.len() <= 24, "{text}");
            prop_assert_eq!(format_to_resolution(back, resolution), text);
        }
    }
}
