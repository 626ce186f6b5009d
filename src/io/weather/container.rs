//! What a weather file is, whatever its format: named dimensions, variables over them, attributes.
//! What a variable holds is read a part at a time.

/// A dimension and its length.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dimension {
    pub name: String,
    pub length: u64,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    Text(String),
    Numbers(Vec<f64>),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    pub name: String,
    pub value: Value,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    pub name: String,
    /// As stored, such as "float".
    pub kind: String,
    /// Slowest first.
    pub dimensions: Vec<Dimension>,
    pub attributes: Vec<Attribute>,
}

impl Variable {
    pub fn text(&self, name: &str) -> Option<&str> {
        text(&self.attributes, name)
    }

    pub fn number(&self, name: &str) -> Option<f64> {
        number(&self.attributes, name)
    }

    /// "14 x 48 x 48".
    pub fn shape_text(&self) -> String {
        let lengths: Vec<String> = self.dimensions.iter().map(|d| d.length.to_string()).collect();
        if lengths.is_empty() { "one number".to_owned() } else { lengths.join(" x ") }
    }
}

/// The text of the attribute `name`, without the blanks and zeros around it.
pub fn text<'a>(attributes: &'a [Attribute], name: &str) -> Option<&'a str> {
    attributes.iter().find(|a| a.name == name).and_then(|a| match &a.value {
        Value::Text(text) => Some(text.trim_matches(|c: char| c == '\0' || c.is_whitespace())),
        Value::Numbers(_) => None,
    })
}

/// The first number of the attribute `name`.
pub fn number(attributes: &[Attribute], name: &str) -> Option<f64> {
    attributes.iter().find(|a| a.name == name).and_then(|a| match &a.value {
        Value::Numbers(numbers) => numbers.first().copied(),
        Value::Text(_) => None,
    })
}

/// An open file. Opening reads what is in it, not its numbers.
pub trait Container: Send + Sync {
    /// The format in words, such as "NetCDF-4 (HDF5)".
    fn kind(&self) -> &'static str;

    fn dimensions(&self) -> &[Dimension];

    fn variables(&self) -> &[Variable];

    /// Those of the whole file.
    fn attributes(&self) -> &[Attribute];

    /// The numbers of the part of a variable that begins at `start` and has `count` along each of
    /// its dimensions, slowest first, as they are stored: fill values are numbers like others.
    ///
    /// # Errors
    /// What is wrong with the file or the request.
    fn read(&self, variable: &str, start: &[u64], count: &[u64]) -> Result<Vec<f64>, String>;

    /// The rows of a variable of characters, whose last dimension runs along a row.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    fn read_rows(&self, variable: &str) -> Result<Vec<String>, String>;

    fn variable(&self, name: &str) -> Option<&Variable> {
        self.variables().iter().find(|v| v.name == name)
    }
}
