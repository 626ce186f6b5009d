//! Revisions of a git checkout: their order, and those between two of them.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::error::{Error, Result};

/// A git checkout.
pub struct Repository(PathBuf);

/// A revision and the first line of its message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Revision {
    /// The whole hash.
    pub hash: String,
    /// First line of the message.
    pub subject: String,
}

impl Repository {
    /// Returns the checkout in a folder.
    pub fn new(folder: &Path) -> Repository {
        Repository(folder.to_owned())
    }

    /// Returns whether this is a checkout.
    ///
    /// # Errors
    /// Fails if it is not.
    pub fn check(&self) -> Result<()> {
        self.git(&["rev-parse", "--git-dir"]).map(|_| ())
    }

    /// Returns for each of `revisions` its place among all of them, an ancestor before its
    /// descendants. None if this is no checkout that has them all.
    pub fn places(&self, revisions: &[&str]) -> Option<Vec<usize>> {
        if revisions.iter().any(|revision| !is_hash(revision)) {
            return None;
        }
        let mut words = vec!["rev-list", "--topo-order", "--reverse"];
        words.extend(revisions);
        let all = self.git(&words).ok()?;
        let place = |revision: &&str| all.lines().position(|line| line.starts_with(revision));
        revisions.iter().map(place).collect()
    }

    /// Returns the revisions after `first` up to `last`, the oldest first, along the first parents.
    ///
    /// # Errors
    /// Fails if one of them is not here, or `first` is no ancestor of `last`.
    pub fn between(&self, first: &str, last: &str) -> Result<Vec<Revision>> {
        for revision in [first, last] {
            if !is_hash(revision) {
                let what = "is no revision of git: the build had changes, or no checkout";
                return Err(Error::usage(format!("{revision} {what}; nothing can be bisected")));
            }
        }
        if self.git(&["merge-base", "--is-ancestor", first, last]).is_err() {
            let folder = self.0.display();
            return Err(Error::usage(format!(
                "{folder}: {first} is no ancestor of {last} there; --repo names the checkout that \
                 both were built from"
            )));
        }
        let range = format!("{first}..{last}");
        let words = ["log", "--first-parent", "--reverse", "--format=%H %s", &range];
        let text = self.git(&words)?;
        let revision = |line: &str| {
            let (hash, subject) = line.split_once(' ').unwrap_or((line, ""));
            Revision { hash: hash.to_owned(), subject: subject.to_owned() }
        };
        Ok(text.lines().map(revision).collect())
    }

    fn git(&self, words: &[&str]) -> Result<String> {
        let output = Command::new("git").arg("-C").arg(&self.0).args(words).output();
        let folder = self.0.display();
        let output = output.map_err(|e| {
            Error::usage(format!("{folder}: git cannot be started ({e}); install it"))
        })?;
        if !output.status.success() {
            let text = String::from_utf8_lossy(&output.stderr);
            let first = text.lines().next().unwrap_or("failed").to_owned();
            return Err(Error::usage(format!("{folder}: git: {first}")));
        }
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }
}

/// Returns whether a revision is a hash, or the beginning of one, and nothing that git would take
/// for an option.
fn is_hash(revision: &str) -> bool {
    revision.len() >= 7 && revision.bytes().all(|b| b.is_ascii_hexdigit())
}

/// Returns the revision to measure next: the one in the middle of those between the last revision
/// before a change and the first after it, of which `measured` have results. `Err` has the
/// revision that brought the change, if none is left between.
pub fn next_to_measure<'a>(
    between: &'a [Revision],
    measured: &[&str],
) -> std::result::Result<&'a Revision, Option<&'a Revision>> {
    let is_measured = |r: &Revision| measured.iter().any(|m| r.hash.starts_with(m));
    let last = between.len().saturating_sub(1);
    let open: Vec<&Revision> = between[..last].iter().filter(|r| !is_measured(r)).collect();
    match open.get(open.len() / 2) {
        Some(revision) => Ok(revision),
        None => Err(between.last()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn revisions(n: u32) -> Vec<Revision> {
        let hash = |i: u32| format!("{i:x}").repeat(40);
        let of = |i| Revision { hash: hash(i), subject: format!("change {i}") };
        (1..=n).map(of).collect()
    }

    #[test]
    fn the_middle_is_measured_next_until_one_is_left() {
        // Eight revisions after the last good one; the eighth is known to be slow.
        let all = revisions(8);
        let hash = |i: usize| all[i - 1].hash.as_str();
        assert_eq!(next_to_measure(&all, &[]).map(|r| &*r.subject), Ok("change 4"));
        // The first good is now 4: what is left lies behind it.
        assert_eq!(next_to_measure(&all[4..], &[hash(4)]).map(|r| &*r.subject), Ok("change 6"));
        assert_eq!(
            next_to_measure(&all[5..6], &[]).map_err(|r| &*r.unwrap().subject),
            Err("change 6")
        );
        // Revisions that have results are left out.
        let measured = [hash(4), &hash(3)[..12]];
        assert_eq!(next_to_measure(&all, &measured).map(|r| &*r.subject), Ok("change 5"));
        assert_eq!(next_to_measure(&[], &[]), Err(None));
    }

    #[test]
    fn only_hashes_reach_git() {
        assert!(is_hash("0123456789ab") && !is_hash("0123456789ab-dirty"));
        assert!(!is_hash("unknown") && !is_hash("--exec") && !is_hash("12345"));
    }
}
