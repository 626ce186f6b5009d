//! "did you mean": the known name nearest to a mistyped one.

/// The known name within a third of its length in edits (at least one, so that `x1` still finds `x`).
pub fn nearest<'a>(typed: &str, known: &[&'a str]) -> Option<&'a str> {
    let typed = typed.to_lowercase();
    let scored = known.iter().map(|name| (edits(&typed, &name.to_lowercase()), *name));
    let allowed = |name: &str| (name.chars().count() / 3).max(1);
    scored.filter(|(n, name)| *n <= allowed(name)).min_by_key(|(n, _)| *n).map(|(_, name)| name)
}

/// `; did you mean …?`, or nothing.
pub fn did_you_mean(typed: &str, known: &[&str]) -> String {
    nearest(typed, known).map_or(String::new(), |name| format!("; did you mean `{name}`?"))
}

/// Names for a message: `a`, `b`, `c`.
pub fn list(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// Levenshtein's distance, with a swap of neighbours as one edit. Names are short; a long one is cut, since it
/// is near to nothing known anyway.
fn edits(a: &str, b: &str) -> usize {
    const LONGEST: usize = 64;
    let a: Vec<char> = a.chars().take(LONGEST).collect();
    let b: Vec<char> = b.chars().take(LONGEST).collect();
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            rows[i][j] = if i == 0 || j == 0 {
                i + j
            } else {
                let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
                let swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
                let best = replaced.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
                if swapped { best.min(rows[i - 2][j - 2] + 1) } else { best }
            };
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_by_hand() {
        assert_eq!(edits("", "abc"), 3);
        assert_eq!(edits("kitten", "sitting"), 3);
        assert_eq!(edits("widht", "width"), 1);
        assert_eq!(edits("same", "same"), 0);
    }

    #[test]
    fn near_names_are_found_and_far_ones_are_not() {
        assert_eq!(nearest("heigth", &["width", "height"]), Some("height"));
        assert_eq!(nearest("Width", &["width", "height"]), Some("width"));
        assert_eq!(nearest("banana", &["width", "height"]), None);
        assert_eq!(nearest("", &[]), None);
    }
}
