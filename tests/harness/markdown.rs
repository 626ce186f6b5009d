//! Reads Markdown as far as the tests of the documentation need it, and writes the page of
//! commands.

/// The lines outside fenced blocks.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut is_fenced = false;
    text.lines().filter(move |line| {
        let is_fence = line.trim_start().starts_with("```");
        is_fenced ^= is_fence;
        !is_fenced && !is_fence
    })
}

/// Returns the targets of all links and images, in order.
pub fn links(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for line in prose(text) {
        let mut rest = line;
        while let Some(i) = rest.find("](") {
            rest = &rest[i + 2..];
            let end = rest.find(')').unwrap_or(rest.len());
            found.push(rest[..end].to_owned());
            rest = &rest[end..];
        }
    }
    found
}

/// Returns the anchors of all headings as GitHub makes them: lower case, spaces as hyphens, no
/// punctuation; a repeated heading gets a number.
pub fn anchors(text: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for line in prose(text).filter(|line| line.starts_with('#')) {
        let title = line.trim_start_matches('#').trim().to_lowercase();
        let anchor: String = title
            .chars()
            .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
            .map(|c| if c == ' ' { '-' } else { c })
            .collect();
        let is_repeat = |other: &&String| {
            **other == anchor
                || other
                    .strip_prefix(&format!("{anchor}-"))
                    .is_some_and(|n| n.parse::<u32>().is_ok())
        };
        let n = found.iter().filter(is_repeat).count();
        found.push(if n == 0 { anchor } else { format!("{anchor}-{n}") });
    }
    found
}

/// Returns the lines of all `sh` blocks: continued lines joined, comments and empty lines left out.
/// A file that is written by `cat > FILE <<'END'` is one line with all of its text.
pub fn shell_lines(text: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    let (mut is_shell, mut continues, mut is_file) = (false, false, false);
    for line in text.lines() {
        if is_file {
            if let Some(file) = found.last_mut() {
                *file = format!("{file}\n{line}");
            }
            is_file = line != "END";
            continue;
        }
        is_file = is_shell && line.ends_with("<<'END'");
        if is_file {
            found.push(line.to_owned());
            continue;
        }
        if let Some(language) = line.trim_start().strip_prefix("```") {
            is_shell = !is_shell && language.trim() == "sh";
            continue;
        }
        if !is_shell {
            continue;
        }
        let code = line.split(" #").next().unwrap_or("").trim();
        let (code, goes_on) = match code.strip_suffix('\\') {
            Some(code) => (code.trim_end(), true),
            None => (code, false),
        };
        match found.last_mut().filter(|_| continues) {
            Some(last) => *last = format!("{last} {code}"),
            None if !code.is_empty() && !code.starts_with('#') => found.push(code.to_owned()),
            None => (),
        }
        continues = goes_on;
    }
    found
}

/// Returns the page that lists every command with its help.
pub fn commands(mut root: clap::Command) -> String {
    let mut page = String::from(
        "# Commands\n\nThis page is generated from `nimbus help`. `nimbus help COMMAND` prints the \
         same text.\n",
    );
    root = root.term_width(96).color(clap::ColorChoice::Never);
    root.build();
    push_command(&mut page, &mut root, "nimbus");
    page
}

fn push_command(page: &mut String, command: &mut clap::Command, name: &str) {
    let help = command.render_long_help().to_string();
    let lines: Vec<&str> = help.lines().map(str::trim_end).collect();
    page.push_str(&format!("\n## {name}\n\n```text\n{}\n```\n", lines.join("\n").trim_end()));
    for sub in command.get_subcommands_mut() {
        if sub.get_name() != "help" && !sub.is_hide_set() {
            let name = format!("{name} {}", sub.get_name());
            push_command(page, sub, &name);
        }
    }
}
