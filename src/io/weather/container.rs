//! Declarations of a weather file: named dimensions, variables over them, attributes.

/// Result of reading a weather file. The error says what is wrong, without the name of the file.
pub type Checked<T> = Result<T, String>;

/// A dimension and its length.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dimension {
    /// Name in the file.
    pub name: String,
    /// Number of places along it.
    pub length: u64,
}

/// Value of an attribute.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Characters or strings.
    Text(String),
    /// Numbers of any type.
    Numbers(Vec<f64>),
}

/// A named value of a file or of a variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// Name in the file.
    pub name: String,
    /// Its value.
    pub value: Value,
}

/// A variable: its type, shape and attributes without its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Name in the file.
    pub name: String,
    /// Type in the file, such as "float".
    pub kind: String,
    /// Dimensions, slowest first.
    pub dimensions: Vec<Dimension>,
    /// Attributes, such as its unit.
    pub attributes: Vec<Attribute>,
}

impl Variable {
    /// Returns the text of an attribute, as [`text`] does.
    pub fn text(&self, name: &str) -> Option<&str> {
        text(&self.attributes, name)
    }

    /// Returns the first number of an attribute.
    pub fn number(&self, name: &str) -> Option<f64> {
        number(&self.attributes, name)
    }

    /// Returns the lengths of its dimensions, slowest first.
    pub fn lengths(&self) -> Vec<u64> {
        self.dimensions.iter().map(|d| d.length).collect()
    }

    /// Returns the shape in words, such as "14 x 48 x 48".
    pub fn shape_text(&self) -> String {
        let lengths: Vec<String> = self.lengths().iter().map(u64::to_string).collect();
        if lengths.is_empty() { "one number".to_owned() } else { lengths.join(" x ") }
    }
}

/// Returns the text of the attribute `name`, without the blanks and zeros around it.
pub fn text<'a>(attributes: &'a [Attribute], name: &str) -> Option<&'a str> {
    attributes.iter().find(|a| a.name == name).and_then(|a| match &a.value {
        Value::Text(text) => Some(text.trim_matches(|c: char| c == '\0' || c.is_whitespace())),
        Value::Numbers(_) => None,
    })
}

/// Returns the first number of the attribute `name`.
pub fn number(attributes: &[Attribute], name: &str) -> Option<f64> {
    attributes.iter().find(|a| a.name == name).and_then(|a| match &a.value {
        Value::Numbers(numbers) => numbers.first().copied(),
        Value::Text(_) => None,
    })
}
