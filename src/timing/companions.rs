//! What lies beside `run.json`: a picture of every case, and charts where they were asked for.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::io::atomic::write_atomic;
use crate::io::image::write_bytes;
use crate::timing::bench::Shown;

/// Of the passes' times (study/plot/passes.rs).
pub const PASSES_CHART: &str = "passes.svg";

#[derive(Debug, Clone, Default)]
pub struct Beside {
    pub pictures: Vec<Shown>,
    /// File names and SVG documents.
    pub charts: Vec<(String, String)>,
    /// File names, and the finished pictures that are copied to them.
    pub copies: Vec<(String, PathBuf)>,
}

/// The last frame of a case.
pub fn picture_file(i_case: usize) -> String {
    format!("case-{i_case}.png")
}

/// The frame times of the i-th of `n` points of a sweep (study/plot/frames.rs).
pub fn frames_chart(i: usize, n: usize) -> String {
    if n == 1 { "frames.svg".to_owned() } else { format!("frames-{i}.svg") }
}

impl Beside {
    pub fn names(&self) -> Vec<String> {
        let pictures = self.pictures.iter().map(|p| picture_file(p.i_case));
        let charts = self.charts.iter().map(|(name, _)| name.clone());
        pictures.chain(charts).chain(self.copies.iter().map(|(name, _)| name.clone())).collect()
    }

    pub fn write(&self, folder: &Path) -> Result<()> {
        for Shown { i_case, width, height, rgb } in &self.pictures {
            write_bytes(&folder.join(picture_file(*i_case)), *width, *height, rgb)?;
        }
        for (name, from) in &self.copies {
            let bytes = fs::read(from).map_err(|cause| Error::io(from, cause))?;
            write_atomic(&folder.join(name), |file| file.write_all(&bytes))?;
        }
        for (name, text) in &self.charts {
            write_atomic(&folder.join(name), |file| file.write_all(text.as_bytes()))?;
        }
        Ok(())
    }
}

/// Files in a folder that have such a name.
pub fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| is_ours(name))
        .collect()
}

fn is_ours(name: &str) -> bool {
    let numbered = |before: &str, after: &str| {
        let number = name.strip_prefix(before).and_then(|rest| rest.strip_suffix(after));
        number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    name == PASSES_CHART
        || name == "frames.svg"
        || numbered("frames-", ".svg")
        || numbered("case-", ".png")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_our_own_names_are_ours() {
        for name in [
            PASSES_CHART,
            &frames_chart(0, 1),
            &frames_chart(12, 20),
            &picture_file(0),
            &picture_file(137),
        ] {
            assert!(is_ours(name), "{name}");
        }
        for name in [
            "case-.png",
            "case-a.png",
            "case-1.png.bak",
            "picture-1.png",
            "my-frames.svg",
            "frames-1x.svg",
            "a.png",
        ] {
            assert!(!is_ours(name), "{name}");
        }
    }
}
