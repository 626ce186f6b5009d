//! Hands the git revision to the program as `NIMBUS_GIT_REVISION`, so that every result names the
//! code it came from: twelve digits, with `-dirty` when what is built differs from the commit, or
//! `unknown` outside a git checkout. A digest of all that is built as `NIMBUS_CODE`, which tells
//! such builds apart, and one of all that f64 references are computed by as
//! `NIMBUS_REFERENCE_CODE`, so that none that older code made is taken for new.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The files that the binary is built from. A change of one of them makes a build dirty. This
/// script runs again when one of them or HEAD changes. Staging a file changes nothing that is
/// built.
const BUILT_FROM: [&str; 5] = ["src", "shaders", "Cargo.toml", "Cargo.lock", "build.rs"];

/// The files that f64 references depend on.
const REFERENCES_FROM: [&str; 3] = ["Cargo.lock", "src/model", "src/reference"];

fn main() {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| ".".into()));
    println!(
        "cargo:rustc-env=NIMBUS_GIT_REVISION={}",
        revision(&root).unwrap_or_else(|| "unknown".into())
    );
    println!("cargo:rustc-env=NIMBUS_CODE={:016x}", digest(&root, &BUILT_FROM));
    println!("cargo:rustc-env=NIMBUS_REFERENCE_CODE={:016x}", digest(&root, &REFERENCES_FROM));
    for path in BUILT_FROM.iter().map(|name| root.join(name)).chain(head_files(&root)) {
        // A watched file that does not exist would make cargo run this script every time.
        if path.exists() {
            println!("cargo:rerun-if-changed={}", path.display());
        }
    }
}

/// FNV-1a over the files' names and texts in the order of their names.
fn digest(root: &Path, names: &[&str]) -> u64 {
    let mut files: Vec<PathBuf> =
        names.iter().flat_map(|name| files_under(&root.join(name))).collect();
    files.sort();
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    for file in files {
        let name = file.strip_prefix(root).unwrap_or(&file).to_string_lossy().into_owned();
        for byte in name.into_bytes().into_iter().chain(std::fs::read(&file).unwrap_or_default()) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    hash
}

fn files_under(path: &Path) -> Vec<PathBuf> {
    if path.is_file() {
        return vec![path.to_owned()];
    }
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
    entries.flat_map(|entry| files_under(&entry.path())).collect()
}

fn revision(root: &Path) -> Option<String> {
    if !is_our_checkout(root) {
        return None;
    }
    let commit = git(root, &["rev-parse", "--short=12", "HEAD"])?;
    let mut status = vec!["status", "--porcelain", "--"];
    status.extend(BUILT_FROM);
    let changes = git(root, &status)?;
    Some(if changes.is_empty() { commit } else { format!("{commit}-dirty") })
}

/// Sources unpacked inside somebody else's repository must not carry that repository's revision.
fn is_our_checkout(root: &Path) -> bool {
    let Some(top) = git(root, &["rev-parse", "--show-toplevel"]) else { return false };
    let (top, root) = (Path::new(&top).canonicalize(), root.canonicalize());
    matches!((top, root), (Ok(top), Ok(root)) if top == root)
}

/// HEAD (another branch), its log (a commit, a reset) and the branch itself (where logs are off).
/// `--git-path` finds them in worktrees too, where HEAD and the branches live in different folders.
fn head_files(root: &Path) -> Vec<PathBuf> {
    if !is_our_checkout(root) {
        return Vec::new();
    }
    let branch = git(root, &["symbolic-ref", "-q", "HEAD"]);
    let names = ["HEAD".to_owned(), "logs/HEAD".to_owned()].into_iter().chain(branch);
    names
        .filter_map(|name| git(root, &["rev-parse", "--git-path", &name]))
        .map(|path| root.join(path))
        .collect()
}

/// None when git is missing, refuses, or fails. Without optional locks: `status` would otherwise
/// rewrite the index while another git command may be at work.
fn git(root: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git")
        .arg("--no-optional-locks")
        .arg("-C")
        .arg(root)
        .args(arguments)
        .output()
        .ok()?;
    if !output.status.success() {
        return None;
    }
    Some(String::from_utf8(output.stdout).ok()?.trim_end().to_owned())
}
