//! Bound on the dots of a key. The TOML parser bounds the nesting of arrays and inline tables, but
//! a key of 100 000 dots makes as many tables within tables, and dropping those overflows the
//! stack.

/// Most dots of a key; the deepest key of a scene, `camera.path`, has one. With the parser's own
/// bound on inline tables (80, each with such a key) a tree stays below 1500 levels, some 100 KiB
/// of stack.
pub const MAX_DOTS: usize = 16;

/// Returns the byte offset where a key has more than [`MAX_DOTS`] dots. Strings and comments are
/// skipped. For text that is no TOML the answer may be wrong; the parser refuses such text anyway.
pub fn too_deep(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let (mut i, mut n_dots) = (0, 0);
    while i < bytes.len() {
        match bytes[i] {
            b'#' => i = end_of(bytes, i, b"\n", false),
            b'"' if bytes[i..].starts_with(b"\"\"\"") => i = end_of(bytes, i + 2, b"\"\"\"", true),
            b'\'' if bytes[i..].starts_with(b"'''") => i = end_of(bytes, i + 2, b"'''", false),
            b'"' => i = end_of(bytes, i, b"\"", true),
            b'\'' => i = end_of(bytes, i, b"'", false),
            b'.' if n_dots == MAX_DOTS => return Some(i),
            b'.' => n_dots += 1,
            b' ' | b'\t' | b'-' | b'_' => {}
            c if c.is_ascii_alphanumeric() => {}
            _ => n_dots = 0,
        }
        i += 1;
    }
    None
}

/// Returns the last byte of the next `mark` after `start`. The end of a line ends a string that is
/// not closed, so that the text behind it is searched too.
fn end_of(bytes: &[u8], start: usize, mark: &[u8], has_escapes: bool) -> usize {
    let mut i = start + 1;
    while i < bytes.len() {
        if has_escapes && bytes[i] == b'\\' {
            i += 1;
        } else if bytes[i..].starts_with(mark) {
            return i + mark.len() - 1;
        } else if bytes[i] == b'\n' && mark.len() == 1 {
            return i;
        }
        i += 1;
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_dots_of_keys_count() {
        let dots = ".".repeat(100);
        for text in [
            format!("# {dots}\ntitle = '{dots}' # {dots}\nb = \"{dots}\\\"{dots}\""),
            format!("t = '''\n{dots}'\n{dots}'''\nu = \"\"\"\n\"{dots}\"\"\""),
            "x = [1.5, 2.5]\n".repeat(100),
        ] {
            assert_eq!(too_deep(&text), None, "{text}");
        }
        assert_eq!(too_deep(&format!("{}x = 1", "a.".repeat(MAX_DOTS))), None);
        assert_eq!(
            too_deep(&format!("{}x = 1", "a.".repeat(MAX_DOTS + 1))),
            Some(2 * MAX_DOTS + 1)
        );
        assert_eq!(
            too_deep(&format!("'{dots}' = 1\nx = {{ {} }}", "'a' . ".repeat(40))),
            Some(107 + 6 + 6 * 16 + 4)
        );
    }
}
