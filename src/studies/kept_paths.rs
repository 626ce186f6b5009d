//! Random paths of a picture on disk, so that another run goes on from them: a more accurate
//! reference refines what is there, and a run that was ended loses a few seconds.
//!
//! The name of a file is the hash of everything that its paths depend on, but for their number.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::reference_hash::{digest, hash_of};
use crate::error::Result;
use crate::io::atomic::write_atomic;
use crate::io::input_file;
use crate::reference::picture::{
    Grown, N_LAYER_VALUES, N_VALUES, OnProgress, PairwiseSum, Pixels, ReferenceRequest, SampleSums,
};

/// Largest file.
const LARGEST_FILE: u64 = 512 << 20;
/// Least time between two writes while paths are added.
const WRITE_STEP: Duration = Duration::from_secs(5);
/// Writing takes at most this share of the time.
const WRITE_SHARE: u32 = 20;

/// Where the paths of a pixel lie, and what is summed of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PathSums {
    /// Through the pixel's centre: what studies compare with.
    Centers,
    /// Spread over the pixel.
    Spread,
    /// Spread over the pixel, by layers.
    Layers,
}

impl PathSums {
    fn n_values(self) -> usize {
        if self == PathSums::Layers { N_LAYER_VALUES } else { N_VALUES }
    }
}

/// The paths of one picture.
pub struct KeptPaths {
    /// The file; none if the system has no folder for caches.
    path: Option<PathBuf>,
    hash: String,
    sum: Arc<Mutex<PairwiseSum>>,
    n_before: u32,
    begin: Instant,
    before_s: f64,
    written: Mutex<Written>,
}

/// What is in the file.
struct Written {
    n_samples: u32,
    at: Instant,
    took: Duration,
}

/// The first line of a file, as JSON. Little-endian f64 values follow, part by part.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    hash: String,
    /// Number of samples of each part.
    parts: Vec<u32>,
    n_values: usize,
    /// Time that the paths took.
    seconds: f64,
    /// SHA-256 of the numbers of samples and the values, in hex.
    content: String,
}

impl KeptPaths {
    /// Reads the paths that `folder` has, unless there are more than `at_most`, which cannot be
    /// taken out of a sum.
    pub fn open(
        folder: Option<&Path>,
        request: &ReferenceRequest<'_>,
        pixels: &Pixels,
        of: PathSums,
        at_most: Option<u32>,
    ) -> KeptPaths {
        let ReferenceRequest { kind, scene, time_s } = *request;
        let hash = digest(format!("{}\n{of:?}", hash_of(kind, scene, time_s, pixels)).as_bytes());
        let path = folder.map(|folder| folder.join(format!("{hash}.paths")));
        let n_values = of.n_values() * pixels.at.len();
        let found = path.as_ref().and_then(|path| read(path, &hash, n_values));
        let n_written = found.as_ref().map_or(0, |(sum, _)| sum.n_samples());
        let found = found.filter(|_| at_most.is_none_or(|most| n_written <= most));
        let (sum, before_s) = found.unwrap_or_default();
        let now = Instant::now();
        KeptPaths {
            path,
            hash,
            n_before: sum.n_samples(),
            sum: Arc::new(Mutex::new(sum)),
            begin: now,
            before_s,
            written: Mutex::new(Written { n_samples: n_written, at: now, took: Duration::ZERO }),
        }
    }

    /// SHA-256 of everything that the paths depend on but for their number, in hex.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// Number of paths of a pixel that an earlier run kept.
    pub fn n_before(&self) -> u32 {
        self.n_before
    }

    /// Number of paths of a pixel.
    pub fn n_samples(&self) -> u32 {
        self.sum.lock().unwrap_or_else(PoisonError::into_inner).n_samples()
    }

    /// Seconds that all paths took, in this run and before.
    pub fn seconds(&self) -> f64 {
        self.before_s + self.begin.elapsed().as_secs_f64()
    }

    /// Hands the paths on to be added to, until `stop` is set.
    pub fn grow<T>(
        &self,
        stop: &AtomicBool,
        on_progress: OnProgress,
        add: impl FnOnce(&Grown<'_>) -> T,
    ) -> T {
        let on_sample = |sum: &PairwiseSum| self.write_if_due(sum);
        add(&Grown { sum: self.sum.clone(), on_sample: &on_sample, stop, on_progress })
    }

    /// Writes the paths, and returns how many of a pixel the file has; `None` if it cannot be
    /// written.
    pub fn keep(&self) -> Option<u32> {
        let sum = self.sum.lock().unwrap_or_else(PoisonError::into_inner);
        self.write(&sum, &mut self.lock_written())
    }

    fn lock_written(&self) -> MutexGuard<'_, Written> {
        self.written.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write_if_due(&self, sum: &PairwiseSum) {
        let mut written = self.lock_written();
        if written.at.elapsed() >= WRITE_STEP.max(WRITE_SHARE * written.took) {
            self.write(sum, &mut written);
            written.at = Instant::now();
        }
    }

    /// Writes the first paths, as many as a file takes, if they are more than it has.
    fn write(&self, sum: &PairwiseSum, written: &mut Written) -> Option<u32> {
        let path = self.path.as_ref()?;
        let begin = Instant::now();
        let mut bytes = 0;
        let fits = |part: &&SampleSums| {
            bytes += 8 * part.values.len() as u64;
            bytes < LARGEST_FILE
        };
        let parts: Vec<&SampleSums> = sum.parts().iter().take_while(fits).collect();
        let n_samples = parts.iter().map(|part| part.n_samples).sum();
        if n_samples > written.n_samples {
            let _ = path.parent().map(fs::create_dir_all);
            write_file(path, &self.hash, &parts, self.seconds()).ok()?;
            written.n_samples = n_samples;
            written.took = begin.elapsed();
        }
        (written.n_samples > 0).then_some(written.n_samples)
    }
}

fn write_file(path: &Path, hash: &str, parts: &[&SampleSums], seconds: f64) -> Result<()> {
    let numbers: Vec<u8> = parts.iter().flat_map(|part| part.bytes()).collect();
    let n_samples: Vec<u32> = parts.iter().map(|part| part.n_samples).collect();
    let head = Head {
        hash: hash.to_owned(),
        content: content(&n_samples, &numbers),
        parts: n_samples,
        n_values: parts.first().map_or(0, |part| part.values.len()),
        seconds,
    };
    write_atomic(path, |file| {
        serde_json::to_writer(&mut *file, &head).map_err(std::io::Error::other)?;
        file.write_all(b"\n")?;
        file.write_all(&numbers)
    })
}

/// Returns the SHA-256 of the numbers of samples of all parts, and of their values.
fn content(n_samples: &[u32], numbers: &[u8]) -> String {
    let n_samples = n_samples.iter().flat_map(|n| n.to_le_bytes());
    digest(&n_samples.chain(numbers.iter().copied()).collect::<Vec<u8>>())
}

/// Returns the sums of a file and the seconds that they took; `None` if it is not there or damaged.
fn read(path: &Path, hash: &str, n_values: usize) -> Option<(PairwiseSum, f64)> {
    // The head takes less than a hundredth of the values of the largest file.
    let bytes = input_file::read(path, LARGEST_FILE + LARGEST_FILE / 100).ok()?;
    let end = bytes.iter().position(|b| *b == b'\n')?;
    let head: Head = serde_json::from_slice(&bytes[..end]).ok()?;
    let numbers = &bytes[end + 1..];
    let n_bytes = n_values.checked_mul(8).filter(|n| *n > 0)?;
    let is_whole = head.hash == hash
        && head.n_values == n_values
        && head.parts.len().checked_mul(n_bytes) == Some(numbers.len())
        && head.content == content(&head.parts, numbers);
    if !is_whole {
        return None;
    }
    let value = |b: &[u8]| b.try_into().map(f64::from_le_bytes).ok();
    let part = |(bytes, n_samples): (&[u8], &u32)| {
        let values = bytes.chunks_exact(8).map(value).collect::<Option<Vec<f64>>>()?;
        Some(SampleSums { n_samples: *n_samples, values })
    };
    let parts: Option<Vec<SampleSums>> =
        numbers.chunks_exact(n_bytes).zip(&head.parts).map(part).collect();
    Some((PairwiseSum::of_parts(parts?)?, head.seconds))
}
