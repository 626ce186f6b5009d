//! A weather file without regard to its format: named dimensions, variables over them, attributes.
//! Variables are read in parts.

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

    /// Returns the shape in words, such as "14 x 48 x 48".
    pub fn shape_text(&self) -> String {
        let lengths: Vec<String> = self.dimensions.iter().map(|d| d.length.to_string()).collect();
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

/// An open file. Opening reads the declarations of its variables, not their numbers.
pub trait Container: Send + Sync {
    /// Returns the format in words, such as "NetCDF-4 (HDF5)".
    fn kind(&self) -> &'static str;

    /// Returns the dimensions of the file.
    fn dimensions(&self) -> &[Dimension];

    /// Returns the variables of the file.
    fn variables(&self) -> &[Variable];

    /// Returns the attributes of the whole file.
    fn attributes(&self) -> &[Attribute];

    /// Reads the part of a variable that begins at `start` and has `count` places along each of its
    /// dimensions, slowest first. Numbers are returned as stored; fill values are numbers too.
    ///
    /// # Errors
    /// When the file is damaged or the part lies outside the variable.
    fn read(&self, variable: &str, start: &[u64], count: &[u64]) -> Checked<Vec<f64>>;

    /// Reads the rows of a variable of characters, whose last dimension runs along a row.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    fn read_rows(&self, variable: &str) -> Checked<Vec<String>>;

    /// Finds a variable.
    fn variable(&self, name: &str) -> Option<&Variable> {
        self.variables().iter().find(|v| v.name == name)
    }
}
