//! Words of an input in messages: shortened, listed, and with the nearest known name to a mistyped
//! one.

use crate::io::plain_text::one_line;

/// Returns the known name nearest to `typed` (Levenshtein distance, with a swap of neighbours as
/// one edit), if it is within a third of its length. One edit is always near enough, so that `x1`
/// still finds `x`.
pub fn nearest<'a>(typed: &str, known: &[&'a str]) -> Option<&'a str> {
    // A long word is near no known name; its start shows that as well.
    let typed: String = typed.to_lowercase().chars().take(64).collect();
    let scored =
        known.iter().map(|name| (strsim::osa_distance(&typed, &name.to_lowercase()), *name));
    let allowed = |name: &str| (name.chars().count() / 3).max(1);
    let near = scored.filter(|(n, name)| *n <= allowed(name)).min_by_key(|(n, _)| *n);
    near.map(|(_, name)| name).or_else(|| of_same_word(&typed, known))
}

/// Returns the only known name of which a word is one of `typed` or at most one edit away, such as
/// `fov_y_deg` for `fov`.
fn of_same_word<'a>(typed: &str, known: &[&'a str]) -> Option<&'a str> {
    const SHORTEST: usize = 3;
    let words = |name: &str| -> Vec<String> {
        let words = name.split(['_', '-', ' ']).filter(|word| word.len() >= SHORTEST);
        words.map(str::to_lowercase).collect()
    };
    let of_typed = words(typed);
    let is_near = |a: &String, b: &String| strsim::osa_distance(a, b) <= 1;
    let shares =
        |name: &&&str| words(name).iter().any(|word| of_typed.iter().any(|of| is_near(of, word)));
    let mut all = known.iter().filter(shares);
    let first = all.next();
    first.filter(|_| all.next().is_none()).copied()
}

/// Returns `; did you mean …?` with the nearest known name, or nothing.
pub fn did_you_mean(typed: &str, known: &[&str]) -> String {
    nearest(typed, known).map_or(String::new(), |name| format!("; did you mean `{}`?", shown(name)))
}

/// Returns [`did_you_mean`], or `;` where no name is near. A list of the known names follows.
pub fn suggestion(typed: &str, known: &[&str]) -> String {
    let text = did_you_mean(typed, known);
    if text.is_empty() { ";".to_owned() } else { text }
}

/// Returns a word of an input for a message: cut where it is long, and without characters that a
/// terminal would obey.
pub fn shown(word: &str) -> String {
    cut(word, 80)
}

/// Returns text of an input for a message: at most `longest` characters of it, and no character
/// that a terminal would obey.
pub fn cut(text: &str, longest: usize) -> String {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{}…", one_line(&text[..end])),
        None => one_line(text).into_owned(),
    }
}

/// Lists the first of the names that an input gave.
pub fn list_given(names: &[&str]) -> String {
    const MOST: usize = 16;
    let first: Vec<String> = names.iter().take(MOST).map(|name| shown(name)).collect();
    let first = list(&first.iter().map(String::as_str).collect::<Vec<_>>());
    match names.len().saturating_sub(MOST) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

/// Lists names of ours: `a`, `b`, `c`.
pub fn list(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_cut_and_control_characters_escaped() {
        assert_eq!(shown("a\u{1b}[31m\nä\u{7f}"), "a\\u{1b}[31m\\nä\\u{7f}");
        assert_eq!(shown(&"é".repeat(80)), "é".repeat(80));
        assert_eq!(shown(&"é".repeat(70_000)), format!("{}…", "é".repeat(80)));
        assert_eq!(list_given(&["a", "b\n"]), "`a`, `b\\n`");
        assert!(list_given(&["x"; 99]).ends_with("`x` and 83 more"));
    }

    #[test]
    fn near_names_are_found_and_far_ones_are_not() {
        assert_eq!(nearest("heigth", &["width", "height"]), Some("height"));
        assert_eq!(nearest("Width", &["width", "height"]), Some("width"));
        assert_eq!(nearest("banana", &["width", "height"]), None);
        assert_eq!(nearest("fov", &["near", "fov_y_deg"]), Some("fov_y_deg"));
        assert_eq!(nearest("step", &["start_s", "step_s"]), Some("step_s"));
        assert_eq!(nearest("gust", &["gust_length", "gust_waves"]), None);
        assert_eq!(nearest("", &[]), None);
        assert_eq!(nearest(&"x".repeat(1 << 20), &["x"]), None);
    }
}
