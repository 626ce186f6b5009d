//! Types that keys of a scene have: how a value is read and checked, how the resolved scene writes
//! it, and how the reference describes it.

use std::fmt::Display;
use std::mem::discriminant;

use glam::DVec3;
use serde_json::{Value as Json, json};

use super::right_form::{readings, toml_text};
use crate::error::Result;
use crate::io::bounds::{Bounds, IntegerBounds};
use crate::io::document::section::Section;
use crate::io::document::suggest::{list, shown, suggestion};
use crate::io::document::tree::Value;

/// Type of a key's value, with its range and its default.
pub struct Spec<T> {
    /// Type and range in words, for messages.
    expected: String,
    /// Range of each of several numbers, for the reference.
    each: String,
    /// Value of a key that is not given; `None` for a required key.
    default: Option<Value>,
    /// A value for messages: the default, also where the key is required.
    example: Value,
    parse: Parser<T>,
}

/// A value as the model has it and as the resolved scene writes it.
type Parsed<T> = std::result::Result<(T, Json), Wrong>;

type Parser<T> = Box<dyn Fn(&Value) -> Parsed<T>>;

/// A complaint about a value.
enum Wrong {
    Value(String),
    /// About an item of an array, by its number.
    Item(usize, String),
}

fn unexpected(expected: &str, found: &Value) -> Wrong {
    Wrong::Value(format!("expected {expected}, found {}", found.describe()))
}

/// Description of a key's type for the reference.
#[derive(Debug, Clone, PartialEq)]
pub struct About {
    /// Type and range in words.
    pub expected: String,
    /// Value of a key that is not given; null where a scene without the key has no value for it,
    /// and `None` where the key is required.
    pub default: Option<Json>,
}

impl<T: 'static> Spec<T> {
    fn new(
        expected: impl Display,
        default: impl Into<Value>,
        parse: impl Fn(&Value) -> Parsed<T> + 'static,
    ) -> Spec<T> {
        let (expected, example) = (expected.to_string(), default.into());
        let (each, default) = (String::new(), Some(example.clone()));
        Spec { expected, each, default, example, parse: Box::new(parse) }
    }

    /// Makes the key required.
    pub fn required(self) -> Spec<T> {
        Spec { default: None, ..self }
    }

    /// Replaces the default.
    pub fn or(self, default: impl Into<Value>) -> Spec<T> {
        let example = default.into();
        Spec { default: Some(example.clone()), example, ..self }
    }

    /// Converts the value for the model; the resolved scene has it as it was.
    pub fn map<U>(self, convert: impl Fn(T) -> U + 'static) -> Spec<U> {
        let Spec { expected, each, default, example, parse } = self;
        let parse = move |value: &Value| parse(value).map(|(v, json)| (convert(v), json));
        Spec { expected, each, default, example, parse: Box::new(parse) }
    }

    /// Takes the key's value, or its default, out of a table and records it.
    pub fn take(&self, s: &mut Section, key: &str) -> Result<T> {
        let given = s.value(key).map(|node| &node.value).or(self.default.as_ref());
        let value = given.ok_or_else(|| s.missing(key, &self.expected))?;
        let (value, json) = (self.parse)(value).map_err(|wrong| match wrong {
            Wrong::Value(what) => s.fault(key, what + &self.right_form(s, key, value)),
            Wrong::Item(i, what) => s.fault_of_item(key, i, what + &self.right_form(s, key, value)),
        })?;
        s.record(key, json);
        Ok(value)
    }

    /// Returns how to write what was probably meant by a value of the wrong kind; empty if no other
    /// reading of the value is one that the key takes.
    fn right_form(&self, s: &Section, key: &str, value: &Value) -> String {
        let meant = readings(value).into_iter().find(|other| (self.parse)(other).is_ok());
        if let Some(text) = meant.and_then(|other| toml_text(&other)) {
            return format!("; write `{}`", s.assignment(key, &text));
        }
        let is_of_form = |example: &Value| match (example, value) {
            (Value::Array(example), Value::Array(items)) => example.len() == items.len(),
            _ => {
                discriminant(example) == discriminant(value)
                    || (example.as_f64().is_some() && value.as_f64().is_some())
            }
        };
        let example = Some(&self.example).filter(|e| !is_of_form(e) && e.is_number_or_list());
        let example = example.and_then(toml_text);
        example.map_or_else(String::new, |text| {
            format!("; for example `{}`", s.assignment(key, &text))
        })
    }

    /// Describes the type for the reference.
    pub fn about(&self) -> About {
        let expected = format!("{}{}", self.expected, self.each);
        About { expected, default: self.default.as_ref().map(Value::json) }
    }
}

/// A type of number that keys have.
pub trait Quantity: Copy + Into<Json> + Into<Value> + 'static {
    /// Range of such numbers.
    type Bounds: Copy + Display + 'static;
    /// Name of several of them.
    const NAME: &'static str;

    /// Reads a number within bounds. An error says what was expected and found.
    fn parse(value: &Value, bounds: Self::Bounds) -> std::result::Result<Self, String>;
}

impl Quantity for f64 {
    type Bounds = Bounds;
    const NAME: &'static str = "numbers";

    fn parse(value: &Value, bounds: Bounds) -> std::result::Result<f64, String> {
        match value.as_f64() {
            None => Err(format!("expected a number, found {}", value.describe())),
            Some(v) if bounds.contains(v) => Ok(v),
            Some(v) => Err(format!("expected {bounds}, found {v:?}")),
        }
    }
}

impl Quantity for u32 {
    type Bounds = IntegerBounds;
    const NAME: &'static str = "integers";

    fn parse(value: &Value, bounds: IntegerBounds) -> std::result::Result<u32, String> {
        let found = match value {
            Value::Integer(i) => match u32::try_from(*i) {
                Ok(v) if (bounds.low..=bounds.high).contains(&v) => return Ok(v),
                _ => i.to_string(),
            },
            other => other.describe(),
        };
        Err(format!("expected {bounds}, found {found}"))
    }
}

fn one<Q: Quantity>(default: Q, bounds: Q::Bounds) -> Spec<Q> {
    Spec::new(bounds, default, move |value| {
        Q::parse(value, bounds).map(|v| (v, v.into())).map_err(Wrong::Value)
    })
}

fn several<Q: Quantity, const N: usize>(default: [Q; N], bounds: Q::Bounds) -> Spec<[Q; N]> {
    let count = format!("{} {}", ["no", "one", "two", "three"][N], Q::NAME);
    let expected = count.clone();
    let parse = move |value: &Value| {
        let items = match value {
            Value::Array(items) if items.len() == N => items,
            other => return Err(unexpected(&count, other)),
        };
        let mut values = default;
        for (i, item) in items.iter().enumerate() {
            values[i] = Q::parse(&item.value, bounds).map_err(|what| Wrong::Item(i, what))?;
        }
        let json = values.map(|v| -> Json { v.into() });
        Ok((values, Json::Array(json.to_vec())))
    };
    Spec { each: format!(", each {bounds}"), ..Spec::new(expected, default, parse) }
}

/// A number.
pub fn number(default: f64, bounds: Bounds) -> Spec<f64> {
    one(default, bounds)
}

/// An integer from `low` to `high`.
pub fn integer(default: u32, low: u32, high: u32) -> Spec<u32> {
    one(default, IntegerBounds { low, high })
}

/// Two numbers.
pub fn pair(default: [f64; 2], bounds: Bounds) -> Spec<[f64; 2]> {
    several(default, bounds)
}

/// Two integers from `low` to `high`.
pub fn integers(default: [u32; 2], low: u32, high: u32) -> Spec<[u32; 2]> {
    several(default, IntegerBounds { low, high })
}

/// A vector.
pub fn vector(default: [f64; 3], bounds: Bounds) -> Spec<DVec3> {
    several(default, bounds).map(DVec3::from_array)
}

/// A vector that must be given. The example of a message is a direction and a strength as well.
pub fn required_vector(bounds: Bounds) -> Spec<DVec3> {
    vector([1.0; 3], bounds).required()
}

/// True or false.
pub fn flag(default: bool) -> Spec<bool> {
    const EXPECTED: &str = "true or false";
    Spec::new(EXPECTED, default, |value| match value {
        Value::Boolean(flag) => Ok((*flag, json!(flag))),
        other => Err(unexpected(EXPECTED, other)),
    })
}

fn parse_text(value: &Value) -> std::result::Result<&str, Wrong> {
    match value {
        Value::String(text) => Ok(text),
        other => Err(unexpected("a string", other)),
    }
}

/// A string.
pub fn text(default: &str) -> Spec<String> {
    Spec::new("a string", default, |value| parse_text(value).map(|t| (t.to_owned(), json!(t))))
}

/// A string that must be given and is not empty.
pub fn required_text() -> Spec<String> {
    let parse = |value: &Value| match parse_text(value)? {
        "" => Err(Wrong::Value("expected a string that is not empty".to_owned())),
        text => Ok((text.to_owned(), json!(text))),
    };
    Spec::new("a string", "", parse).required()
}

/// One of several names, each of which stands for a value.
pub fn choice<T: Copy>(default: &str, names: &'static [(&'static str, T)]) -> Spec<T> {
    let known: Vec<&str> = names.iter().map(|(name, _)| *name).collect();
    let expected = format!("one of {}", list(&known));
    Spec::new(expected, default, move |value| {
        let name = parse_text(value)?;
        let found = names.iter().find(|(known, _)| *known == name);
        found.map(|(name, value)| (*value, json!(name))).ok_or_else(|| {
            let (name, nearest) = (shown(name), suggestion(name, &known));
            Wrong::Value(format!("unknown value `{name}`{nearest} known here: {}", list(&known)))
        })
    })
}

/// One of several values that stand for something by themselves, or one of `others`.
pub fn one_of<T: Copy + 'static, const N: usize>(
    default: impl Into<Value>,
    values: [(Value, T); N],
    others: Option<Spec<T>>,
) -> Spec<T> {
    let others_expected = others.iter().map(|others| others.expected.clone() + &others.each);
    let mut names: Vec<String> =
        others_expected.chain(values.iter().map(|(value, _)| value.json().to_string())).collect();
    let last = names.pop().unwrap_or_default();
    let comma = if names.iter().any(|name| name.contains(',')) { "," } else { "" };
    let expected = format!("{}{comma} or {last}", names.join(", "));
    Spec::new(expected.clone(), default, move |value| {
        let found = values.iter().find(|(known, _)| known.is_same(value));
        match (found, others.as_ref().map(|others| (others.parse)(value))) {
            (Some((known, of)), _) => Ok((*of, known.json())),
            (None, Some(Ok(parsed))) => Ok(parsed),
            // One of several numbers is wrong: that says more.
            (None, Some(Err(item @ Wrong::Item(..)))) => Err(item),
            (None, _) => Err(unexpected(&expected, value)),
        }
    })
}

/// A value that a reader of its own takes; `expected` describes it for the reference.
pub fn described(expected: &str) -> Spec<()> {
    Spec::new(expected, f64::NAN, |_| Ok(((), Json::Null)))
}
