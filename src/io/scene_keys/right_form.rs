//! The right form of a value of the wrong kind, for messages. Each other reading of the value is
//! tried on the key, and the first that the key accepts is suggested.

use crate::io::document::tree::{Node, Origin, Value};

/// Names of "true" and "false" that TOML does not have.
const TRUE: [&str; 4] = ["true", "yes", "on", "1"];
const FALSE: [&str; 4] = ["false", "no", "off", "0"];

/// Returns other readings of a value, the nearest first.
pub fn readings(value: &Value) -> Vec<Value> {
    match value {
        Value::String(text) => of_text(text),
        Value::Integer(_) | Value::Float(_) => of_number(value),
        Value::Boolean(flag) => {
            let names = if *flag { TRUE } else { FALSE };
            names.iter().map(|name| Value::from(*name)).collect()
        }
        Value::Array(items) => of_array(items),
        Value::Datetime | Value::Table(_) => vec![],
    }
}

fn of_text(text: &str) -> Vec<Value> {
    let text = text.trim();
    let mut all = Vec::new();
    if let Some(number) = leading_number(text) {
        all.extend(whole(&number));
        all.push(number);
    }
    let lower = text.to_lowercase();
    for (names, flag) in [(TRUE, true), (FALSE, false)] {
        if names.contains(&lower.as_str()) {
            all.push(Value::Boolean(flag));
            all.extend(names.iter().map(|name| Value::from(*name)));
        }
    }
    let bare = lower.trim_matches(|c: char| matches!(c, '"' | '\'' | '`' | ';' | ' '));
    let hyphens = bare.replace(['_', ' '], "-");
    all.extend([bare, hyphens.as_str(), &bare.replace(['-', ' '], "_")].map(Value::from));
    let is_between = |c: char| c.is_whitespace() || ",;x×()[]{}<>".contains(c);
    let parts: Vec<&str> = text.split(is_between).filter(|part| !part.is_empty()).collect();
    if let (true, Some(numbers)) =
        (parts.len() > 1, parts.iter().map(|part| leading_number(part)).collect())
    {
        all.extend(arrays(numbers));
    }
    all
}

fn of_number(value: &Value) -> Vec<Value> {
    let mut all = Vec::new();
    all.extend(whole(value));
    all.push(match value {
        Value::Integer(i) => Value::String(i.to_string()),
        other => Value::String(other.json().to_string()),
    });
    if let Value::Integer(i @ (0 | 1)) = value {
        all.push(Value::Boolean(*i == 1));
        all.push(Value::from(if *i == 1 { "on" } else { "off" }));
    }
    all.extend([2, 3].map(|n| array(vec![value.clone(); n])));
    all
}

fn of_array(items: &[Node]) -> Vec<Value> {
    let values: Vec<Value> = items.iter().map(|item| item.value.clone()).collect();
    let number = |value: &Value| match value {
        Value::String(text) => leading_number(text),
        other => other.as_f64().map(|_| other.clone()),
    };
    let numbers: Option<Vec<Value>> = values.iter().map(number).collect();
    let mut all: Vec<Value> = numbers.map_or(vec![], arrays);
    if let [only] = &values[..] {
        all.push(only.clone());
        all.extend(readings(only));
    }
    all
}

/// Returns an array of the numbers, and one of whole numbers if all are whole.
fn arrays(numbers: Vec<Value>) -> Vec<Value> {
    let wholes: Option<Vec<Value>> = numbers
        .iter()
        .map(|n| if matches!(n, Value::Integer(_)) { Some(n.clone()) } else { whole(n) })
        .collect();
    [Some(numbers), wholes].into_iter().flatten().map(array).collect()
}

fn array(values: Vec<Value>) -> Value {
    let node = |value| Node { origin: Origin::Default, value };
    Value::Array(values.into_iter().map(node).collect())
}

/// Returns a float without a fraction as an integer.
fn whole(value: &Value) -> Option<Value> {
    match value {
        Value::Float(v) if v.fract() == 0.0 && v.abs() < 1e15 => Some(Value::Integer(*v as i128)),
        _ => None,
    }
}

/// Returns the number that a text begins with, without its unit; a percentage as a share.
fn leading_number(text: &str) -> Option<Value> {
    let is_of_number = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
    let mut end = text.find(|c| !is_of_number(c)).unwrap_or(text.len());
    // "8em" begins with 8, and "e" with no number.
    while end > 0 && !text[..end].ends_with(|c: char| c.is_ascii_digit() || c == '.') {
        end -= 1;
    }
    let unit = text[end..].trim();
    // More numbers are not a unit.
    if unit.len() > 12 || unit.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let number: f64 = text[..end].parse().ok().filter(|v: &f64| v.is_finite())?;
    Some(match text[..end].parse::<i128>() {
        _ if unit == "%" => Value::Float(number / 100.0),
        Ok(i) => Value::Integer(i),
        Err(_) => Value::Float(number),
    })
}

/// Returns a value as TOML; none for a value that is too long for a message.
pub fn toml_text(value: &Value) -> Option<String> {
    const LONGEST: usize = 60;
    // Strings, numbers and lists of JSON are TOML.
    Some(value.json().to_string()).filter(|text| text.chars().count() <= LONGEST)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn texts(value: &Value) -> Vec<String> {
        readings(value).iter().filter_map(toml_text).collect()
    }

    #[test]
    fn other_readings_are_what_was_meant() {
        for (typed, meant) in [
            ("800px", "800"),
            ("0.1 s", "0.1"),
            ("50%", "0.5"),
            ("yes", "true"),
            ("On", "\"on\""),
            ("OFF", "false"),
            ("Two_Reflection", "\"two-reflection\""),
            ("(1; 2; 3)", "[1,2,3]"),
            ("800x600", "[800,600]"),
            ("1e3", "1000"),
        ] {
            let texts = texts(&Value::from(typed));
            assert!(texts.iter().any(|text| text == meant), "{typed}: {texts:?}");
        }
        assert!(texts(&Value::Integer(3)).contains(&"[3,3,3]".to_owned()));
        assert!(texts(&Value::Integer(3)).contains(&"\"3\"".to_owned()));
        assert!(texts(&Value::Float(800.0)).contains(&"800".to_owned()));
        assert!(texts(&Value::Boolean(true)).contains(&"\"on\"".to_owned()));
        for word in ["", "e", "-", "red", "1.2.3.4", "infinity", "nan"] {
            assert!(leading_number(word).is_none(), "{word}");
        }
    }

    proptest! {
        /// However three numbers are separated and enclosed, their array is one of the readings.
        #[test]
        fn three_numbers_are_found_in_any_form(
            numbers in prop::array::uniform3(-1000i32..1000),
            between in prop::sample::select(vec![",", ", ", " ", ";", " ; "]),
            around in prop::sample::select(vec![["", ""], ["(", ")"], ["[", "]"], ["<", ">"]]),
        ) {
            let [a, b, c] = numbers;
            let text = format!("{}{a}{between}{b}{between}{c}{}", around[0], around[1]);
            let meant = format!("[{a},{b},{c}]");
            prop_assert!(texts(&Value::String(text)).contains(&meant));
        }

        /// No text makes the search fail.
        #[test]
        fn any_text_has_readings(text in ".{0,40}") {
            let _ = texts(&Value::String(text));
        }
    }
}
