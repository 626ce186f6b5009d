//! Text without characters that a terminal obeys or that change how a line reads. All text for
//! people passes through [`plain`] where it is printed, because names in results, scenes, files and
//! devices may hold anything.

use std::borrow::Cow;

/// Returns whether a character moves the cursor, switches colours, rings, or reorders the text
/// around it: control characters (C0, DEL, C1), line separators, and marks of bidirectional text.
pub fn is_harmful(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}'
            | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

/// Returns text with every harmful character in the form `\u{1b}`; line feeds and tabs stay.
pub fn plain(text: &str) -> Cow<'_, str> {
    replaced(text, |c| c != '\n' && c != '\t' && is_harmful(c), |c| c.escape_unicode().to_string())
}

/// Returns text of one line: every harmful character, line feeds and tabs as well, is escaped as in
/// Rust's strings.
pub fn one_line(text: &str) -> Cow<'_, str> {
    replaced(text, is_harmful, |c| c.escape_debug().to_string())
}

/// Returns JSON with every harmful character in the form `\u001b`. Outside of strings, JSON has
/// only line feeds, which stay.
pub fn plain_json(json: &str) -> Cow<'_, str> {
    replaced(
        json,
        |c| c != '\n' && is_harmful(c),
        |c| {
            let mut units = [0; 2];
            c.encode_utf16(&mut units).iter().map(|unit| format!("\\u{unit:04x}")).collect()
        },
    )
}

/// Returns a page or a picture's text with U+FFFD for every harmful character; line feeds and tabs
/// stay.
pub fn plain_markup(text: &str) -> Cow<'_, str> {
    replaced(text, |c| c != '\n' && c != '\t' && is_harmful(c), |_| "\u{fffd}".to_owned())
}

fn replaced<'a>(
    text: &'a str,
    is_replaced: impl Fn(char) -> bool,
    by: impl Fn(char) -> String,
) -> Cow<'a, str> {
    if !text.chars().any(&is_replaced) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_replaced(c) { out += &by(c) } else { out.push(c) }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Texts in which about every second character is a harmful one.
    fn hostile() -> impl Strategy<Value = String> {
        let all = (0..=char::MAX as u32).filter_map(char::from_u32);
        let harmful: Vec<char> = all.filter(|c| is_harmful(*c)).collect();
        let any = prop_oneof![prop::sample::select(harmful), any::<char>()];
        prop::collection::vec(any, 0..40).prop_map(String::from_iter)
    }

    proptest! {
        #[test]
        fn no_harmful_character_is_left(text in hostile()) {
            let plain = plain(&text);
            prop_assert!(plain.chars().all(|c| c == '\n' || c == '\t' || !is_harmful(c)));
            prop_assert_eq!(super::plain(&plain), plain.as_ref());
            let markup = plain_markup(&text);
            prop_assert!(markup.chars().all(|c| c == '\n' || c == '\t' || !is_harmful(c)));
            prop_assert!(!one_line(&text).chars().any(is_harmful));
        }

        #[test]
        fn json_says_the_same(text in hostile()) {
            let value = serde_json::json!({ text.clone(): [text.clone(), "é√"] });
            let json = serde_json::to_string_pretty(&value).expect("JSON");
            let plain = plain_json(&json);
            prop_assert!(plain.chars().all(|c| c == '\n' || !is_harmful(c)));
            let back: serde_json::Value = serde_json::from_str(&plain).expect("JSON");
            prop_assert_eq!(back, value);
        }
    }

    #[test]
    fn usual_text_stays_as_it_is() {
        let text = "ä λ 日本 🙂\n\t\"[31m\"";
        assert!(matches!(plain(text), Cow::Borrowed(same) if same == text));
        assert_eq!(plain("a\u{1b}[31mb\r\u{9b}\u{202e}c"), "a\\u{1b}[31mb\\u{d}\\u{9b}\\u{202e}c");
        assert_eq!(plain_json("\"\u{7f}\u{e0001}\""), "\"\\u007f\\udb40\\udc01\"");
    }
}
