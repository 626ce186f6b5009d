//! Files of other kinds that are given in place of a scene.

use std::path::Path;

const BOXES: &str = "a box file, which a [[cloud]] with from = \"boxes\" names as its `file`";

/// Ends of file names, and what such files are.
const KINDS: [(&str, &str); 5] = [
    ("dat", BOXES),
    ("csv", "a particle list, which a [[cloud]] with from = \"particles\" names as its `file`"),
    ("nc", "a weather file, which a [[cloud]] with from = \"weather\" names as its `file`"),
    ("png", "a picture"),
    ("exr", "a picture"),
];

/// Returns whether a text begins with a number alone on its line, as a box file does.
pub fn begins_with_number(text: &str) -> bool {
    let first = text.lines().map(str::trim).find(|line| !line.is_empty());
    first.is_some_and(|line| line.parse::<f64>().is_ok())
}

/// Returns what a file that is no scene looks like, by its name or by its beginning, and what to do
/// with it.
pub fn remark(path: &Path, begins_with_number: bool) -> Option<String> {
    let end = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let by_name = KINDS.iter().find(|(name, _)| *name == end).map(|(_, kind)| *kind);
    let kind = by_name.or(begins_with_number.then_some(BOXES))?;
    Some(format!("a scene is TOML, and this looks like {kind}"))
}
