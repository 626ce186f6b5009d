//! Numbers formatted for people.

/// Formats a number with at most three significant digits, very small and large ones with a power
/// of ten: "0", "0.025", "1.5×10⁻⁶", "∞".
pub fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        let text = match value {
            _ if value.is_nan() => "—",
            _ if value > 0.0 => "∞",
            _ => "−∞",
        };
        return text.to_owned();
    }
    // The exponent of the rounded number, so that 9.999 becomes 10.
    let scientific = format!("{value:.2e}");
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-3..5).contains(&exponent) {
        let places = (2 - exponent).max(0) as usize;
        return trimmed(&format!("{value:.places$}"));
    }
    let mantissa = trimmed(mantissa);
    let power = format!("10{}", superscript(exponent));
    if mantissa == "1" { power } else { format!("{mantissa}×{power}") }
}

/// Removes trailing zeros after the decimal point, and replaces the hyphen by a minus sign.
fn trimmed(text: &str) -> String {
    let text =
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text };
    text.replace('-', "−")
}

fn superscript(n: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digit = |c: char| c.to_digit(10).map_or('⁻', |d| DIGITS[d as usize]);
    n.to_string().chars().map(digit).collect()
}

/// Formats a value with its interval: "12.3 (11.9 to 12.8)", "1.5 (1.2 to 1.8)×10⁻⁶", or the value
/// alone.
pub fn with_interval(value: f64, low: Option<f64>, high: Option<f64>) -> String {
    let (Some(low), Some(high)) = (low, high) else { return number(value) };
    match number(value).split_once('×') {
        // All three share one power of ten.
        Some((_, power)) => {
            let scale = 10f64.powf(value.abs().log10().floor());
            let [value, low, high] = [value, low, high].map(|v| number(v / scale));
            format!("{value} ({low} to {high})×{power}")
        }
        None => format!("{} ({} to {})", number(value), number(low), number(high)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_three_significant_digits() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (12.345, "12.3"),
            (0.0012345, "0.00123"),
            (0.00012345, "1.23×10⁻⁴"),
            (1e-5, "10⁻⁵"),
            (99999.0, "10⁵"),
            (12345.0, "12345"),
            (9.999, "10"),
            (-0.5, "−0.5"),
            (1e300, "10³⁰⁰"),
            (f64::NAN, "—"),
            (f64::INFINITY, "∞"),
        ] {
            assert_eq!(number(value), text);
        }
        assert_eq!(with_interval(1.0, Some(0.5), Some(2.0)), "1 (0.5 to 2)");
        assert_eq!(with_interval(1.0, None, Some(2.0)), "1");
        assert_eq!(with_interval(1.5e-6, Some(9e-7), Some(2.1e-5)), "1.5 (0.9 to 21)×10⁻⁶");
    }
}
