//! What a report is made of: results on disk, whole and of this nimbus' schema, or one message that
//! says what is wrong.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::studies::error::records::Study;
use crate::studies::ledger::records::Ledger;
use crate::timing::json::{self, ResultFile};
use crate::timing::results::RUN_FILE;
use crate::timing::results::{BenchResults, read_results};

/// One result.
#[derive(Debug, Clone)]
pub struct Source {
    /// As typed, or with the file's name where a folder holds several results.
    pub name: String,
    /// Where its pictures lie.
    pub folder: PathBuf,
    pub found: Found,
}

#[derive(Debug, Clone)]
pub enum Found {
    Bench(Box<BenchResults>),
    Study(Box<Study>),
    Ledger(Box<Ledger>),
}

const FILES: [&str; 3] = [RUN_FILE, Study::FILE, Ledger::FILE];

/// The results in a folder, or one of its files by name.
pub fn read(path: &Path) -> Result<Vec<Source>> {
    if !path.is_dir() {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let Some(file) = FILES.into_iter().find(|file| *file == name) else {
            let what = format!("expected a results folder, or in one {}", FILES.join(", "));
            return Err(Error::io(
                path,
                if path.exists() { what } else { format!("no such file or folder; {what}") },
            ));
        };
        let folder = path.parent().filter(|p| *p != Path::new("")).unwrap_or(Path::new("."));
        return Ok(vec![source(folder, file, path.display().to_string())?]);
    }
    let there: Vec<&str> = FILES.into_iter().filter(|file| path.join(file).exists()).collect();
    if there.is_empty() {
        let what = format!("holds no results: none of {}", FILES.join(", "));
        return Err(Error::io(
            path,
            format!("{what}; expected a folder that bench, error or ledger wrote with --out"),
        ));
    }
    let name = |file: &str| if there.len() == 1 { path.to_owned() } else { path.join(file) };
    there.iter().map(|file| source(path, file, name(file).display().to_string())).collect()
}

fn source(folder: &Path, file: &str, name: String) -> Result<Source> {
    let path = folder.join(file);
    let found = match file {
        RUN_FILE => Found::Bench(Box::new(read_results(folder)?)),
        Study::FILE => Found::Study(Box::new(json::read(folder)?)),
        _ => Found::Ledger(Box::new(json::read(&path)?)),
    };
    Ok(Source { name, folder: folder.to_owned(), found })
}

/// Later benches and studies, each beside the first of its kind.
pub fn pairs(sources: &[Source]) -> Vec<(&Source, &Source)> {
    let kind = |s: &Source| std::mem::discriminant(&s.found);
    let first = |s: &Source| sources.iter().find(|other| kind(other) == kind(s));
    let comparable = sources.iter().filter(|s| !matches!(s.found, Found::Ledger(_)));
    comparable.filter_map(|s| Some((first(s)?, s))).filter(|(a, b)| !std::ptr::eq(*a, *b)).collect()
}
