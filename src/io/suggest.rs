//! "did you mean": the known name nearest to a mistyped one; and words of an input in messages.

/// The known name within a third of its length in edits (at least one, so that `x1` still finds
/// `x`).
pub fn nearest<'a>(typed: &str, known: &[&'a str]) -> Option<&'a str> {
    let typed = typed.to_lowercase();
    let scored = known.iter().map(|name| (edits(&typed, &name.to_lowercase()), *name));
    let allowed = |name: &str| (name.chars().count() / 3).max(1);
    scored.filter(|(n, name)| *n <= allowed(name)).min_by_key(|(n, _)| *n).map(|(_, name)| name)
}

/// `; did you mean …?`, or nothing.
pub fn did_you_mean(typed: &str, known: &[&str]) -> String {
    nearest(typed, known).map_or(String::new(), |name| format!("; did you mean `{}`?", shown(name)))
}

/// A word of an input in a message: cut where it is long, without characters that a terminal would
/// obey.
pub fn shown(word: &str) -> String {
    const LONGEST: usize = 80;
    let mut shown = String::new();
    for (i, c) in word.chars().enumerate() {
        if i == LONGEST {
            shown.push('…');
            break;
        }
        if c.is_control() { shown.extend(c.escape_debug()) } else { shown.push(c) }
    }
    shown
}

/// Names that an input gave, for a message: the first ones.
pub fn list_given(names: &[&str]) -> String {
    const MOST: usize = 16;
    let some: Vec<String> =
        names.iter().take(MOST).map(|name| format!("`{}`", shown(name))).collect();
    let more = if names.len() > MOST {
        format!(" and {} more", names.len() - MOST)
    } else {
        String::new()
    };
    some.join(", ") + &more
}

/// Names for a message: `a`, `b`, `c`.
pub fn list(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// Levenshtein's distance, with a swap of neighbours as one edit. Names are short; a long one is
/// cut, since it is near to nothing known anyway.
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
    fn words_are_shown_short_and_obey_no_terminal() {
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
        assert_eq!(nearest("", &[]), None);
    }
}
