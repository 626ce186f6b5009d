//! Results read from disk.

use std::mem::discriminant;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::studies::error::records::Study;
use crate::studies::ledger::records::Ledger;
use crate::timing::json::{self, ResultFile};
use crate::timing::results::{BenchResults, RUN_FILE, read_results};

/// The results of one command.
#[derive(Debug, Clone)]
pub struct Source {
    /// The path as typed, with the file's name if the folder holds several results.
    pub name: String,
    /// The folder of the results and their pictures.
    pub folder: PathBuf,
    /// The records.
    pub results: Results,
}

/// The records of one command.
#[derive(Debug, Clone)]
pub enum Results {
    /// Records of `nimbus bench`.
    Bench(Box<BenchResults>),
    /// Records of `nimbus error`.
    Study(Box<Study>),
    /// Records of `nimbus ledger`.
    Ledger(Box<Ledger>),
}

/// Names of result files, in the order in which those of one folder are shown.
const FILES: [&str; 3] = [RUN_FILE, Study::FILE, Ledger::FILE];

/// Reads the results of a folder, or a single file of results.
///
/// # Errors
/// Fails if there are no results, or they are incomplete or of another schema version.
pub fn read(path: &Path) -> Result<Vec<Source>> {
    if !path.is_dir() {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let Some(file) = FILES.into_iter().find(|file| *file == name) else {
            let what = format!("expected a results folder, or in one {}", FILES.join(", "));
            let missing = if path.exists() { "" } else { "no such file or folder; " };
            return Err(Error::io(path, format!("{missing}{what}")));
        };
        let folder = path.parent().filter(|p| *p != Path::new("")).unwrap_or(Path::new("."));
        return Ok(vec![read_source(folder, file, path)?]);
    }
    let found: Vec<&str> = FILES.into_iter().filter(|file| path.join(file).exists()).collect();
    match found[..] {
        [] => Err(Error::io(
            path,
            format!(
                "holds no results: none of {}; expected a folder that bench, error or ledger \
                 wrote with --out",
                FILES.join(", ")
            ),
        )),
        [file] => Ok(vec![read_source(path, file, path)?]),
        _ => found.iter().map(|file| read_source(path, file, &path.join(file))).collect(),
    }
}

fn read_source(folder: &Path, file: &str, name: &Path) -> Result<Source> {
    let results = match file {
        RUN_FILE => Results::Bench(Box::new(read_results(folder)?)),
        Study::FILE => Results::Study(Box::new(json::read(folder)?)),
        _ => Results::Ledger(Box::new(json::read(folder)?)),
    };
    Ok(Source { name: name.display().to_string(), folder: folder.to_owned(), results })
}

/// Pairs every further bench and study with the first of its kind.
pub(super) fn comparable_pairs(sources: &[Source]) -> Vec<(&Source, &Source)> {
    let kind = |s: &Source| discriminant(&s.results);
    let first = |s: &Source| sources.iter().find(|other| kind(other) == kind(s));
    let comparable = sources.iter().filter(|s| !matches!(s.results, Results::Ledger(_)));
    comparable.filter_map(|s| Some((first(s)?, s))).filter(|(a, b)| !std::ptr::eq(*a, *b)).collect()
}
