//! Parsing of typed numbers with units. A number without a unit is in scene units.

/// A unit of length: `metres / per` metres. The fraction makes 110 cm exactly 1.1 m.
struct Unit {
    name: &'static str,
    metres: f64,
    per: f64,
}

/// Units that a typed length may have.
const UNITS: [Unit; 4] = [
    Unit { name: "mm", metres: 1.0, per: 1000.0 },
    Unit { name: "cm", metres: 1.0, per: 100.0 },
    Unit { name: "m", metres: 1.0, per: 1.0 },
    Unit { name: "km", metres: 1000.0, per: 1.0 },
];

/// Largest number of typed characters that a message repeats, so that a long pasted text does not
/// hide the rest of the message.
const MAX_SHOWN: usize = 40;

/// Parses a length such as "1.5", "1.5 m", "150cm" or "2 km".
///
/// *Units*: the result is in scene units of `metres_per_unit` metres.
///
/// # Errors
/// The text is not a finite number with a known unit.
pub fn length(text: &str, metres_per_unit: f64) -> Result<f64, String> {
    let expected = "a length such as 1.5, 1.5 m, 150 cm or 2 km";
    let (number, unit) = split(text);
    let v = finite(number, expected, text)?;
    match unit {
        "" => Ok(v),
        name => {
            let unit = unit_named(name, text)?;
            within(v * unit.metres / unit.per / metres_per_unit, expected, text)
        }
    }
}

/// Parses a density such as "12", "12 /m³", "0.5/km3" or "8 per m^3".
///
/// *Units*: the result is in particles per cubic scene unit, of `metres_per_unit` metres edge.
///
/// # Errors
/// The text is not a finite number with a known unit.
pub fn density(text: &str, metres_per_unit: f64) -> Result<f64, String> {
    let expected = "particles in a volume such as 12, 12 /m³ or 0.5 /km³";
    let parted = text.split_once('/').or_else(|| text.split_once("per"));
    let Some((number, volume)) = parted else { return finite(text.trim(), expected, text) };
    let v = finite(number.trim(), expected, text)?;
    let volume = volume.trim();
    let cubed = ["³", "^3", "3"].iter().find_map(|power| volume.strip_suffix(power));
    let Some(name) = cubed else { return Err(unexpected(expected, text)) };
    let unit = unit_named(name.trim(), text)?;
    // Of the two ratios of edges, only the one above 1 can be an exact integer, which makes the
    // result exact: 12 /m³ are 12000 in a cube of 10 m.
    let (edge, inverse) =
        (unit.metres / unit.per / metres_per_unit, metres_per_unit * unit.per / unit.metres);
    let v = if edge < 1.0 { v * inverse.powi(3) } else { v / edge.powi(3) };
    within(v, expected, text)
}

/// Parses a number of particles or a seed.
///
/// # Errors
/// The text is not an integer of 32 bits.
pub fn count(text: &str) -> Result<u32, String> {
    let expected = format!("an integer from 0 to {}", u32::MAX);
    text.trim().parse().map_err(|_| unexpected(&expected, text))
}

/// Splits a text into number and unit, which begins after the last digit or point.
fn split(text: &str) -> (&str, &str) {
    let end = text.rfind(|c: char| c.is_ascii_digit() || c == '.').map_or(0, |i| i + 1);
    (text[..end].trim(), text[end..].trim())
}

fn unit_named(name: &str, text: &str) -> Result<&'static Unit, String> {
    let unit = UNITS.iter().find(|unit| unit.name == name);
    unit.ok_or_else(|| unexpected("mm, cm, m, km or no unit after the number", text))
}

fn finite(number: &str, expected: &str, text: &str) -> Result<f64, String> {
    // f64 would also parse words such as "inf". Pasted text may have the minus sign U+2212.
    let number = number.replace('\u{2212}', "-");
    let is_digits = number.chars().all(|c| c.is_ascii_digit() || "+-.eE".contains(c));
    let v = number.parse().ok().filter(|_| is_digits);
    within(v.unwrap_or(f64::NAN), expected, text)
}

fn within(v: f64, expected: &str, text: &str) -> Result<f64, String> {
    if v.is_finite() { Ok(v) } else { Err(unexpected(expected, text)) }
}

fn unexpected(expected: &str, text: &str) -> String {
    let mut shown: String = text.trim().chars().take(MAX_SHOWN).collect();
    if text.trim().chars().nth(MAX_SHOWN).is_some() {
        shown.push('…');
    }
    format!("expected {expected}, found `{shown}`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_in_every_unit() {
        for (text, metres_per_unit, expected) in [
            ("1.5", 1.0, 1.5),
            (" 1.5 m ", 1.0, 1.5),
            ("150 cm", 1.0, 1.5),
            ("110cm", 1.0, 1.1),
            ("3 mm", 1.0, 0.003),
            ("2 km", 1.0, 2000.0),
            ("2 km", 500.0, 4.0),
            ("1.5", 500.0, 1.5),
            ("-.5", 1.0, -0.5),
            ("\u{2212}3.4m", 1.0, -3.4),
            ("6.12438e-007", 1.0, 6.12438e-7),
            ("1e3m", 1.0, 1000.0),
            ("+2.", 1.0, 2.0),
        ] {
            assert_eq!(length(text, metres_per_unit), Ok(expected), "{text}");
        }
    }

    #[test]
    fn other_text_is_refused_in_one_sentence() {
        let example = "expected a length such as 1.5, 1.5 m, 150 cm or 2 km, found ";
        for text in ["", "m", "1,5", "nan", "inf", "-inf m", "1e999", "1 2", "0x10", "--1", "1 2 m"]
        {
            assert_eq!(length(text, 1.0), Err(format!("{example}`{text}`")));
        }
        let unit = "expected mm, cm, m, km or no unit after the number, found ";
        for text in ["1 lb", "1 M", "1e", "1.5 m m", "3 m²"] {
            assert_eq!(length(text, 1.0), Err(format!("{unit}`{text}`")));
        }
        let long = length(&"x".repeat(5000), 1.0).unwrap_err();
        assert_eq!(long, format!("{example}`{}…`", "x".repeat(MAX_SHOWN)));
        assert!(length("1e300 km", 1e-300).is_err());
    }

    #[test]
    fn densities_and_counts_are_read() {
        assert_eq!(density("12", 500.0), Ok(12.0));
        for text in ["12 /m³", "12/m3", "12 per m^3"] {
            assert_eq!(density(text, 10.0), Ok(12_000.0), "{text}");
        }
        assert_eq!(density("5e8/km3", 1.0), Ok(0.5));
        for text in ["12 /m", "12 /m²", "12 /lb3", "/m3", "x", "", "inf"] {
            assert!(density(text, 1.0).is_err(), "{text}");
        }
        assert_eq!(count(" 554 "), Ok(554));
        for text in ["-1", "1.5", "4294967296", "", "many"] {
            let expected = format!("expected an integer from 0 to 4294967295, found `{text}`");
            assert_eq!(count(text), Err(expected));
        }
    }
}
