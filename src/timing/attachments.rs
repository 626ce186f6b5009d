//! Files beside `run.json`: a picture of every case, and charts.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::state::STATE_FILE;
use crate::error::{Error, Result};
use crate::io::atomic::write_atomic;
use crate::io::image::write_bytes;
use crate::io::input_file::{self, PICTURE_LIMIT};

/// File name of the chart of the passes' times.
pub const PASSES_CHART: &str = "passes.svg";
const FRAMES_CHART: &str = "frames.svg";

/// The last frame of a case as it is displayed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CasePicture {
    /// Number of the case.
    pub i_case: usize,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// 8-bit sRGB, three bytes a pixel, rows from the top.
    pub rgb: Vec<u8>,
}

/// A picture of a part, and its file name in the joined results.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PictureCopy {
    /// Number of the part.
    pub i_part: usize,
    /// File name in the part's folder.
    pub from: String,
    /// File name in the folder of the joined results.
    pub to: String,
}

/// Files that are written into a results folder together with `run.json`.
#[derive(Debug, Clone, Default)]
pub struct Attachments {
    /// Pictures of cases.
    pub pictures: Vec<CasePicture>,
    /// File names and SVG documents.
    pub charts: Vec<(String, String)>,
    /// File names and texts of tables.
    pub tables: Vec<(String, String)>,
    /// File names, and the finished pictures that are copied to them.
    pub copies: Vec<(String, PathBuf)>,
}

/// Returns the file name of the picture of a case.
pub fn picture_file(i_case: usize) -> String {
    format!("case-{i_case}.png")
}

/// Returns the file name of the chart of frame times at point `i` of the `n` points of a sweep.
pub fn frames_chart(i: usize, n: usize) -> String {
    if n == 1 { FRAMES_CHART.to_owned() } else { format!("frames-{i}.svg") }
}

/// Returns the names of the files that a bench of `n_cases` may write beside its record.
pub fn planned(n_cases: usize, has_charts: bool) -> Vec<String> {
    let mut names: Vec<String> = (0..n_cases).map(picture_file).collect();
    names.push(STATE_FILE.to_owned());
    if has_charts {
        names.extend((0..n_cases).map(|i| frames_chart(i, n_cases)));
        names.extend([FRAMES_CHART, PASSES_CHART].map(str::to_owned));
    }
    names
}

impl Attachments {
    /// Returns the names of all files.
    pub(super) fn names(&self) -> Vec<String> {
        let pictures = self.pictures.iter().map(|p| picture_file(p.i_case));
        let texts = self.charts.iter().chain(&self.tables).map(|(name, _)| name.clone());
        pictures.chain(texts).chain(self.copies.iter().map(|(name, _)| name.clone())).collect()
    }

    /// Writes all files into `folder`.
    ///
    /// # Errors
    /// Fails if a file cannot be read or written.
    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        for CasePicture { i_case, width, height, rgb } in &self.pictures {
            write_bytes(&folder.join(picture_file(*i_case)), *width, *height, rgb)?;
        }
        for (name, from) in &self.copies {
            let bytes =
                input_file::read(from, PICTURE_LIMIT).map_err(|cause| Error::io(from, cause))?;
            write_atomic(&folder.join(name), |file| file.write_all(&bytes))?;
        }
        for (name, text) in self.charts.iter().chain(&self.tables) {
            write_atomic(&folder.join(name), |file| file.write_all(text.as_bytes()))?;
        }
        Ok(())
    }
}
