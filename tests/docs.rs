//! The documentation is true: links lead somewhere, lines fit, commands run, and the pages that are
//! generated are those that the program would generate now.

#[cfg(feature = "window")]
#[path = "harness/display.rs"]
mod display;
#[path = "docs/help.rs"]
mod help;
#[path = "harness/markdown.rs"]
mod markdown;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use clap::CommandFactory;
use nimbus::cli::args::Args;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// All pages of the repository, relative to its root.
fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> =
        ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"]
            .map(PathBuf::from)
            .into();
    let mut folders = vec![PathBuf::from("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(Path::new(ROOT).join(&folder)).expect("a folder of docs") {
            let path = folder.join(entry.expect("an entry").file_name());
            if Path::new(ROOT).join(&path).is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                pages.push(path);
            }
        }
    }
    pages.sort();
    pages
}

fn read(page: &Path) -> String {
    fs::read_to_string(Path::new(ROOT).join(page)).expect("a page")
}

#[test]
fn links_lead_to_files_and_headings_that_exist() {
    let mut broken = Vec::new();
    for page in pages() {
        for link in markdown::links(&read(&page)) {
            if link.contains("://") {
                continue;
            }
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = match file {
                "" => Path::new(ROOT).join(&page),
                _ => Path::new(ROOT).join(&page).with_file_name("").join(file),
            };
            let has_anchor = || {
                let text = fs::read_to_string(&target).unwrap_or_default();
                anchor.is_empty() || markdown::anchors(&text).iter().any(|a| a == anchor)
            };
            if !target.exists() || !has_anchor() {
                broken.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(broken.is_empty(), "broken links:\n{}", broken.join("\n"));
}

#[test]
fn lines_fit_into_100_columns() {
    let is_long = |line: &&str| line.chars().count() > 100 && !line.contains("http");
    let long: Vec<String> = pages()
        .iter()
        .map(|page| (page, read(page).lines().filter(is_long).count()))
        .filter(|(_, n)| *n > 0)
        .map(|(page, n)| format!("{}: {n} lines", page.display()))
        .collect();
    assert!(long.is_empty(), "lines of more than 100 columns:\n{}", long.join("\n"));
}

#[test]
fn readme_and_architecture_stay_short() {
    for page in ["README.md", "ARCHITECTURE.md"] {
        let n_lines = read(Path::new(page)).lines().count();
        assert!(n_lines <= 120, "{page} has {n_lines} lines, the limit is 120");
    }
}

/// Set `NIMBUS_BLESS=1` to write the page instead of comparing it.
#[test]
fn the_page_of_commands_is_what_help_prints() {
    let page = "docs/reference/commands.md";
    let expected = markdown::commands(Args::command());
    if std::env::var_os("NIMBUS_BLESS").is_some() {
        fs::write(Path::new(ROOT).join(page), &expected).expect("the page");
    }
    assert!(read(Path::new(page)) == expected, "{page} is out of date: run with NIMBUS_BLESS=1");
}

/// Options that make a command of the docs small.
const SMALL: [(&str, &[(&str, &str)]); 7] = [
    ("render", &[("--size", "64x48")]),
    ("bench", &[("--size", "64x48"), ("--frames", "2"), ("--warmup", "1"), ("--repeat", "2")]),
    ("error", &[("--size", "64x48"), ("--pixels", "64"), ("--rounds", "2"), ("--frames", "1")]),
    (
        "ledger",
        &[
            ("--size", "64x48"),
            ("--pixels", "64"),
            ("--rounds", "2"),
            ("--frames", "1"),
            ("--reflections", "2"),
        ],
    ),
    ("inspect", &[("--size", "64x48")]),
    ("view", &[("--size", "64x48"), ("--frames", "3")]),
    ("farm plan", &[("--size", "64x48")]),
];

/// The arguments of a command, with its small options in place of those that the page shows.
fn shrink(mut args: Vec<String>) -> Vec<String> {
    let name = args.iter().take_while(|a| !a.starts_with('-')).take(2).cloned().collect::<Vec<_>>();
    let is_named = |command: &str| {
        let words: Vec<&str> = command.split(' ').collect();
        name.len() >= words.len() && words.iter().zip(&name).all(|(word, arg)| word == arg)
    };
    if is_named("stress") {
        args.push("functions/division".to_owned());
    }
    const LARGE: [&str; 3] = ["study-both", "study-cloud", "cubes-554"];
    let is_large = |arg: &str| LARGE.iter().any(|name| arg.contains(name));
    if is_named("ledger") && args.iter().any(|arg| is_large(arg)) {
        args.retain(|arg| !is_large(arg) && arg != "--plain");
        args.extend(["scenes/hello.toml", "--plain"].map(str::to_owned));
    }
    for arg in &mut args {
        // Sizes of a sweep over particles.
        for many in ["500,1000,2000,5000,10000,20000,50000", "500,5000,50000"] {
            *arg = arg.replace(many, "500,600,700");
        }
    }
    // Its game step moves 100 000 particles.
    let is_busy = args.iter().any(|arg| arg == "scenes/threads.toml");
    if is_named("bench") && is_busy && !args.iter().any(|arg| arg.contains("particles")) {
        args.extend(["--set", "draw.particles=2000"].map(str::to_owned));
    }
    let Some((command, options)) = SMALL.iter().find(|(command, _)| is_named(command)) else {
        return args;
    };
    // A sweep over sizes, and arguments behind `--`, have values of their own.
    let sweeps_size = args.iter().any(|a| a.starts_with("size="));
    // A precision decides the number of blocks.
    let has_precision = args.iter().any(|a| a == "--precision");
    let is_left_out = |option: &str| {
        (sweeps_size && option == "--size") || (has_precision && option == "--repeat")
    };
    // A narrow one takes minutes on a busy machine.
    if let Some(i) = args.iter().position(|a| a == "--precision") {
        args[i + 1] = "50%".to_owned();
    }
    for (option, value) in options.iter().filter(|(option, _)| !is_left_out(option)) {
        match args.iter().position(|a| a == option) {
            Some(i) => args[i + 1] = (*value).to_owned(),
            None => {
                let at = command.split(' ').count();
                args.splice(at..at, [(*option).to_owned(), (*value).to_owned()]);
            }
        }
    }
    args
}

/// The words that a shell makes of `text`.
fn words(text: &str) -> Vec<String> {
    let output = Command::new("bash")
        .args(["-c", &format!("printf '%s\\0' {text}")])
        .current_dir(ROOT)
        .output()
        .expect("bash runs");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    text.split_terminator('\0').map(str::to_owned).collect()
}

/// Runs the commands of one page, in order, in a folder of their own.
fn run_page(page: &Path) -> Vec<String> {
    run_lines(&page.display().to_string(), markdown::shell_lines(&read(page)))
}

/// A command of several pages that takes half a minute. It needs no file, and runs once.
const ROOF: &str = "tools/nimbus devices --roof";
static ROOF_RAN: AtomicBool = AtomicBool::new(false);

/// Runs lines of a shell in a folder of their own. Returns what failed.
fn run_lines(page: &str, lines: Vec<String>) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["scenes", "shaders"] {
        std::os::unix::fs::symlink(Path::new(ROOT).join(name), folder.path().join(name))
            .expect("a link");
    }
    // A checkout, as the project's folder is.
    let git = Command::new("git").args(["init", "-q"]).current_dir(folder.path()).status();
    assert!(git.expect("git runs").success());
    #[cfg(feature = "window")]
    let display = display::Display::open();
    let mut failures = Vec::new();
    for line in lines {
        if line == ROOF && ROOF_RAN.swap(true, Ordering::Relaxed) {
            continue;
        }
        let mut command = match line.strip_prefix("tools/nimbus ") {
            Some(rest) => {
                let mut command = Command::new(env!("CARGO_BIN_EXE_nimbus"));
                command.args(shrink(words(rest)));
                command
            }
            None if ["cp ", "mkdir ", "cat > "].iter().any(|name| line.starts_with(name)) => {
                let mut command = Command::new("bash");
                command.args(["-c", &line]);
                command
            }
            None => continue,
        };
        #[cfg(feature = "window")]
        command.envs(display.variables());
        let start = Instant::now();
        let output =
            command.current_dir(folder.path()).stdin(Stdio::null()).output().expect("it runs");
        println!("{page}: {:.1} s: {line}", start.elapsed().as_secs_f64());
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            failures.push(format!("{page}: {line}: {}\n{said}", output.status));
        }
        // Examples compare two things that differ.
        let differs = |args: &[String]| {
            let [a, b] = [&args[1], &args[2]].map(|name| fs::read(folder.path().join(name)).ok());
            let [c, d] = [&args[1], &args[2]].map(|name| conditions(&folder.path().join(name)));
            a.zip(b).is_some_and(|(a, b)| a != b) || c.zip(d).is_some_and(|(c, d)| c != d)
        };
        let args = line.strip_prefix("tools/nimbus ").map(words).unwrap_or_default();
        if args.first().is_some_and(|name| name == "compare") && args.len() > 2 && !differs(&args) {
            failures.push(format!("{page}: {line}: the two do not differ"));
        }
    }
    failures
}

/// Returns the hash of the scene of a bench's results.
fn conditions(folder: &Path) -> Option<[serde_json::Value; 2]> {
    let text = fs::read_to_string(folder.join("run.json")).ok()?;
    let run: serde_json::Value = serde_json::from_str(&text).ok()?;
    Some(["scene_hash", "cold_bytes"].map(|key| run[key].clone()))
}

#[test]
fn commands_of_the_pages_run() {
    let mut failures = Vec::new();
    for page in pages() {
        failures.extend(run_page(&page));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_command_is_made_small_wherever_its_options_stand() {
    let args = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(shrink(args("render a.toml")), args("render --size 64x48 a.toml"));
    assert_eq!(shrink(args("render a.toml --size 9x9")), args("render a.toml --size 64x48"));
    assert_eq!(shrink(args("devices --json")), args("devices --json"));
    let ledger = shrink(args("ledger scenes/study-both.toml --out a"));
    assert!(ledger.ends_with(&args("--out a scenes/hello.toml --plain")), "{ledger:?}");
    let sweep = shrink(args("bench a.toml --sweep size=8x8,9x9"));
    assert!(!sweep.contains(&"--size".to_owned()) && sweep.contains(&"--warmup".to_owned()));
}

#[test]
fn pages_are_read_as_they_are_shown() {
    let text = "# A `b` C\n[x](y.md#z) ![p](q.png)\n```sh\n\
                tools/nimbus render \\\n  a # c\nls\ncat > f <<'END'\n# x\nEND\n```\n\
                ```toml\n[a](b)\n```\n## A `b` C\n";
    assert_eq!(markdown::links(text), ["y.md#z", "q.png"]);
    assert_eq!(markdown::anchors(text), ["a-b-c", "a-b-c-1"]);
    let lines = ["tools/nimbus render a", "ls", "cat > f <<'END'\n# x\nEND"];
    assert_eq!(markdown::shell_lines(text), lines);
}
