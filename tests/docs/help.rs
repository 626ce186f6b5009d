//! The examples of `nimbus help COMMAND`: they run, they show what they claim, and a terminal of 80
//! columns does not break them.

use clap::{Command, CommandFactory, Parser};
use nimbus::cli::args::Args;

use super::{run_lines, words};

/// Returns name and help of every command, as a terminal of `columns` shows it.
fn helps(columns: usize) -> Vec<(String, String)> {
    fn push(all: &mut Vec<(String, String)>, command: &mut Command, name: &str) {
        all.push((name.to_owned(), command.render_long_help().to_string()));
        for sub in command.get_subcommands_mut().filter(|sub| sub.get_name() != "help") {
            let name = format!("{name} {}", sub.get_name());
            push(all, sub, &name);
        }
    }
    let mut root = Args::command().term_width(columns).color(clap::ColorChoice::Never);
    root.build();
    let mut all = Vec::new();
    push(&mut all, &mut root, "nimbus");
    all
}

/// Returns the examples of a help as a user would paste them: from `  nimbus ` on, with the lines
/// that a backslash continues.
fn examples(help: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    let mut continues = false;
    for line in help.lines() {
        let text = line.trim();
        let begins = line.starts_with("  nimbus ") && !continues;
        if begins {
            found.push(String::new());
        }
        if begins || continues {
            let (text, goes_on) =
                text.strip_suffix('\\').map_or((text, false), |text| (text.trim_end(), true));
            let last = found.last_mut().expect("an example has begun");
            *last = format!("{last} {text}").trim().to_owned();
            continues = goes_on;
        }
    }
    found
}

#[test]
fn examples_of_the_help_can_be_pasted_at_80_columns() {
    let (narrow, wide) = (helps(80), helps(400));
    let mut n = 0;
    for ((name, narrow), (_, wide)) in narrow.iter().zip(&wide) {
        let (narrow, wide) = (examples(narrow), examples(wide));
        assert_eq!(narrow, wide, "{name}: a line of an example is too long for 80 columns");
        for example in narrow {
            let typed = words(&example);
            assert_eq!(typed.first().map(String::as_str), Some("nimbus"));
            let parsed = Args::try_parse_from(&typed);
            assert!(parsed.is_ok(), "{name}: {example}: {}", parsed.expect_err("it is refused"));
            n += 1;
        }
    }
    assert!(n > 35, "{n} examples");
}

#[test]
fn examples_of_the_help_run() {
    let mut failures = Vec::new();
    for (name, help) in helps(80) {
        let lines = examples(&help).into_iter().map(|line| {
            // A few frames of an animation.
            format!("tools/{}", line.replace("0..240", "0..3"))
        });
        failures.extend(run_lines(&name, lines.collect()));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
