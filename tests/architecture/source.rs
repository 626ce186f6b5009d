//! A reader of imports in Rust sources: tokens without comments and strings, and the paths that
//! begin with `crate`, `nimbus`, `super` or `self`, resolved relative to their module.

use std::path::Path;

#[derive(Debug, Clone, PartialEq)]
pub struct Token {
    /// An identifier, `::`, or one other character; `"` stands for a string or character literal.
    pub text: String,
    pub line: usize,
    /// Whether the token is inside an item with `#[cfg(test)]`.
    pub in_test: bool,
}

pub struct Source {
    /// Path below src/.
    pub path: String,
    /// Path of the module: src/gpu/kernel.rs and src/gpu/kernel/mod.rs are ["gpu", "kernel"].
    pub module: Vec<String>,
    pub tokens: Vec<Token>,
}

/// A path to an item of the crate: `crate::gpu::kernel` is ["gpu", "kernel"].
pub struct Import {
    pub path: Vec<String>,
    pub line: usize,
    pub in_test: bool,
    /// Whether the path belongs to a `pub use`.
    pub is_reexport: bool,
}

impl Source {
    pub fn read(path: &Path, text: &str) -> Self {
        let mut module: Vec<String> = path
            .with_extension("")
            .iter()
            .map(|part| part.to_string_lossy().into_owned())
            .collect();
        if module.last().is_some_and(|name| name == "mod") {
            module.pop();
        }
        let mut tokens = tokens(text);
        // A file `tests.rs` holds a test module.
        let all_test = path.file_stem().is_some_and(|stem| stem == "tests");
        mark_tests(&mut tokens, all_test);
        Source { path: path.display().to_string(), module, tokens }
    }

    /// Returns the folder or file directly below src/; none for lib.rs.
    pub fn room(&self) -> Option<&str> {
        self.module.first().map(String::as_str).filter(|room| *room != "lib")
    }

    /// Returns the pass that the file belongs to; none for passes/mod.rs.
    pub fn pass(&self) -> Option<&str> {
        if self.room() == Some("passes") { self.module.get(1).map(String::as_str) } else { None }
    }

    pub fn imports(&self) -> Vec<Import> {
        let mut imports = Vec::new();
        let children: Vec<&str> = self.declared_modules().collect();
        // Names of the enclosing inline modules; None for other braces.
        let mut open: Vec<Option<&str>> = Vec::new();
        for i in 0..self.tokens.len() {
            match self.text(i) {
                "{" => {
                    let is_module = i >= 2 && self.text(i - 2) == "mod";
                    open.push(is_module.then(|| self.text(i - 1)));
                }
                "}" => {
                    open.pop();
                }
                "crate" | "nimbus" | "super" | "self"
                    if self.text(i + 1) == "::" && !self.continues_a_path(i) =>
                {
                    self.read_path(i, open.iter().flatten(), &mut imports);
                }
                name if children.contains(&name)
                    && self.text(i + 1) == "::"
                    && !self.continues_a_path(i) =>
                {
                    let n_before = imports.len();
                    self.read_tree(i, &self.module, &mut imports);
                    let is_reexport = i >= 2
                        && self.text(i - 1) == "use"
                        && matches!(self.text(i - 2), "pub" | ")");
                    imports[n_before..].iter_mut().for_each(|i| i.is_reexport = is_reexport);
                }
                _ => {}
            }
        }
        imports
    }

    /// Returns the modules that the file declares with `mod name;`.
    fn declared_modules(&self) -> impl Iterator<Item = &str> {
        let is_declared = |i: &usize| self.text(*i) == "mod" && self.text(i + 2) == ";";
        (0..self.tokens.len()).filter(is_declared).map(|i| self.text(i + 1))
    }

    /// The module that this file is, from the crate's root.
    pub fn module(&self) -> &[String] {
        &self.module
    }

    /// Names that this file hands on by `pub use`, and the paths that they stand for.
    pub fn handed_on(&self) -> Vec<(Vec<String>, Vec<String>)> {
        let mut found = Vec::new();
        for i in self.uses().filter(|&i| self.is_public(i)) {
            for path in self.tree_at(i + 1) {
                let Some(name) = path.last().cloned() else { continue };
                found.push(([self.module.as_slice(), &[name]].concat(), path));
            }
        }
        found
    }

    /// Paths that begin with a module which this file declares, outside `pub use` and tests.
    pub fn paths_into_children(&self) -> Vec<Vec<String>> {
        let children: Vec<&str> = (1..self.tokens.len())
            .filter(|&i| self.text(i - 1) == "mod" && self.text(i + 1) == ";")
            .map(|i| self.text(i))
            .collect();
        let begins = |i: &usize| {
            children.contains(&self.text(*i))
                && self.text(i + 1) == "::"
                && !self.continues_a_path(*i)
                && !self.tokens[*i].in_test
        };
        let starts: Vec<usize> = (0..self.tokens.len()).filter(begins).collect();
        let is_handed_on = |i: usize| i > 0 && self.text(i - 1) == "use" && self.is_public(i - 1);
        starts.into_iter().filter(|&i| !is_handed_on(i)).flat_map(|i| self.tree_at(i)).collect()
    }

    fn uses(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.tokens.len()).filter(|&i| self.text(i) == "use" && !self.tokens[i].in_test)
    }

    /// Whether the `use` at token `i` has `pub` or `pub(…)` before it.
    fn is_public(&self, i: usize) -> bool {
        let before = |n: usize| i.checked_sub(n).map_or("", |i| self.text(i));
        before(1) == "pub" || before(1) == ")" && (2..6).any(|n| before(n) == "pub")
    }

    /// The paths of a use tree, those of this module's children made absolute.
    fn tree_at(&self, i: usize) -> Vec<Vec<String>> {
        let mut imports = Vec::new();
        match self.text(i) {
            "super" | "self" | "crate" | "nimbus" => self.read_path(i, [].iter(), &mut imports),
            _ => {
                self.read_tree(i, &self.module, &mut imports);
            }
        }
        imports.into_iter().map(|import| import.path).collect()
    }

    /// Returns the first words of paths to other crates: `ash` of `ash::vk`, but not of
    /// `crate::ash::vk`.
    pub fn crate_mentions<'a>(&'a self, crates: &'a [String]) -> impl Iterator<Item = &'a Token> {
        self.tokens.iter().enumerate().filter_map(move |(i, token)| {
            let begins_path = self.text(i + 1) == "::" || (i > 0 && self.text(i - 1) == "use");
            (crates.contains(&token.text) && begins_path && !self.continues_a_path(i))
                .then_some(token)
        })
    }

    fn text(&self, i: usize) -> &str {
        self.tokens.get(i).map_or("", |token| token.text.as_str())
    }

    fn continues_a_path(&self, i: usize) -> bool {
        // `use ::ash` starts at the root as well.
        i >= 2
            && self.text(i - 1) == "::"
            && is_identifier(self.text(i - 2))
            && self.text(i - 2) != "use"
    }

    fn read_path<'a>(
        &self,
        at: usize,
        open: impl Iterator<Item = &'a &'a str>,
        imports: &mut Vec<Import>,
    ) {
        let mut prefix = Vec::new();
        let mut i = at;
        if matches!(self.text(i), "super" | "self") {
            prefix.extend(self.module.iter().cloned().chain(open.map(|name| (*name).to_owned())));
        }
        while matches!(self.text(i), "super" | "self" | "crate" | "nimbus")
            && self.text(i + 1) == "::"
        {
            if self.text(i) == "super" {
                prefix.pop();
            }
            i += 2;
        }
        self.read_tree(i, &prefix, imports);
    }

    /// Reads a use tree or a plain path at token `i`; returns the index of the token after it.
    fn read_tree(&self, mut i: usize, prefix: &[String], imports: &mut Vec<Import>) -> usize {
        if self.text(i) == "{" {
            i += 1;
            while !matches!(self.text(i), "}" | "") {
                i = self.read_tree(i, prefix, imports);
                // Skips `as name` and the comma.
                while !matches!(self.text(i), "," | "}" | "") {
                    i += 1;
                }
                i += usize::from(self.text(i) == ",");
            }
            return i + 1;
        }
        let mut path = prefix.to_vec();
        if self.text(i) != "self" && self.text(i) != "*" || path.is_empty() {
            path.push(self.text(i).to_owned());
        }
        if self.text(i + 1) == "::"
            && (is_identifier(self.text(i + 2)) || matches!(self.text(i + 2), "{" | "*"))
        {
            return self.read_tree(i + 2, &path, imports);
        }
        let Token { line, in_test, .. } = self.tokens[i.min(self.tokens.len() - 1)];
        imports.push(Import { path, line, in_test, is_reexport: false });
        i + 1
    }
}

fn is_identifier(text: &str) -> bool {
    text.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

fn tokens(text: &str) -> Vec<Token> {
    let chars: Vec<char> = text.chars().collect();
    let (mut tokens, mut i, mut line) = (Vec::new(), 0, 1);
    while i < chars.len() {
        let end = end_of_token(&chars, i);
        let token = &chars[i..end];
        let text = match token[0] {
            c if c.is_whitespace() => None,
            '/' if token.len() > 1 => None,
            // A lifetime.
            '\'' if !token.ends_with(&['\'']) => None,
            _ if token.len() > 1 && token.iter().any(|c| matches!(c, '"' | '\'')) => {
                Some("\"".to_owned())
            }
            _ => Some(token.iter().collect()),
        };
        tokens.extend(text.map(|text| Token { text, line, in_test: false }));
        line += token.iter().filter(|c| **c == '\n').count();
        i = end;
    }
    tokens
}

fn end_of_token(chars: &[char], i: usize) -> usize {
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let while_in = |from: usize, holds: fn(char) -> bool| {
        (from..).find(|&i| !holds(at(i))).unwrap_or(chars.len())
    };
    match (at(i), at(i + 1)) {
        ('/', '/') => while_in(i, |c| c != '\n' && c != '\0'),
        ('/', '*') => end_of_block_comment(chars, i),
        (':', ':') => i + 2,
        ('"', _) => end_of_string(chars, i),
        ('\'', '\\') => {
            (i + 3..chars.len()).find(|&i| at(i) == '\'').map_or(chars.len(), |i| i + 1)
        }
        ('\'', _) if at(i + 2) == '\'' => i + 3,
        ('\'', _) => while_in(i + 1, |c| c.is_alphanumeric() || c == '_'),
        ('r' | 'b' | 'c', _) if string_start(chars, i).is_some() => {
            string_start(chars, i).unwrap_or(i + 1)
        }
        (c, _) if c.is_alphanumeric() || c == '_' => {
            while_in(i, |c| c.is_alphanumeric() || c == '_')
        }
        _ => i + 1,
    }
}

/// Returns the end of a string with a prefix: b"…", r"…", r#"…"#, br#"…"#. None if no such string
/// begins here.
fn string_start(chars: &[char], i: usize) -> Option<usize> {
    let n_letters = chars[i..].iter().take(2).take_while(|c| matches!(c, 'r' | 'b' | 'c')).count();
    let n_hashes = chars[i + n_letters..].iter().take_while(|c| **c == '#').count();
    let quote = i + n_letters + n_hashes;
    if chars.get(quote) != Some(&'"') {
        return None;
    }
    if !chars[i..i + n_letters].contains(&'r') {
        return Some(end_of_string(chars, quote));
    }
    let closes = |at: usize| {
        chars[at] == '"' && chars[at + 1..].iter().take_while(|c| **c == '#').count() >= n_hashes
    };
    Some(
        (quote + 1..chars.len()).find(|&at| closes(at)).map_or(chars.len(), |at| at + 1 + n_hashes),
    )
}

fn end_of_string(chars: &[char], quote: usize) -> usize {
    let mut i = quote + 1;
    while i < chars.len() && chars[i] != '"' {
        i += if chars[i] == '\\' { 2 } else { 1 };
    }
    (i + 1).min(chars.len())
}

fn end_of_block_comment(chars: &[char], start: usize) -> usize {
    let (mut i, mut depth) = (start, 0);
    while i < chars.len() {
        match (chars[i], chars.get(i + 1)) {
            ('/', Some('*')) => (i, depth) = (i + 2, depth + 1),
            ('*', Some('/')) => (i, depth) = (i + 2, depth - 1),
            _ => i += 1,
        }
        if depth == 0 {
            break;
        }
    }
    i
}

/// Marks every item with `#[cfg(test)]`, up to its `;` or its closing brace.
fn mark_tests(tokens: &mut [Token], all: bool) {
    let attribute = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut i = 0;
    while i < tokens.len() {
        let is_attribute =
            tokens[i..].iter().map(|token| token.text.as_str()).take(7).eq(attribute);
        let end = if is_attribute { end_of_item(tokens, i + attribute.len()) } else { i + 1 };
        for token in &mut tokens[i..end] {
            token.in_test = is_attribute || all;
        }
        i = end;
    }
}

fn end_of_item(tokens: &[Token], start: usize) -> usize {
    let mut depth = 0;
    for (i, token) in tokens.iter().enumerate().skip(start) {
        match token.text.as_str() {
            "{" => depth += 1,
            "}" if depth == 1 => return i + 1,
            "}" => depth -= 1,
            ";" if depth == 0 => return i + 1,
            _ => {}
        }
    }
    tokens.len()
}
