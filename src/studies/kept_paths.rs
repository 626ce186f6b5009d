//! Random paths of a picture on disk, which another run goes on from. A more accurate reference
//! refines what is there. A run that was ended loses a few seconds.
//!
//! The name of a file is the hash of everything that its paths depend on, but for their number. A
//! study's pictures also have a file for each number that is a power of two: a reference may end
//! at any of them, whatever other runs have added since.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::reference_hash::{digest, hash_of_paths};
use crate::error::Result;
use crate::io::atomic::write_atomic;
use crate::io::input_file;
use crate::reference::picture::{
    Enough, Grown, N_LAYER_VALUES, N_VALUES, OnProgress, PairwiseSum, Pixels, ReferenceRequest,
    SampleSums,
};

/// Most bytes of values in a file. After Ctrl-C they are written within half a second.
const MOST_VALUES: u64 = 256 << 20;
/// Most bytes of a head.
const MOST_HEAD: u64 = 64 << 10;
/// Values that are converted at once.
const N_AT_ONCE: usize = 8 << 10;
/// Least time between two writes while paths are added.
const WRITE_STEP: Duration = Duration::from_secs(5);
/// Paths are added for at least this many times as long as the last write took.
const TIMES_A_WRITE: u32 = 20;
/// Least number of paths that has a file of its own: no reference ends before.
const FIRST_STEP: u32 = 32;

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

/// How many of a picture's paths are on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnDisk {
    /// Nothing.
    Nothing,
    /// This number of paths a pixel, of this run.
    These(u32),
    /// This greater number, of another run; those of this run are not on disk.
    Others(u32),
}

/// The paths of one picture.
pub struct KeptPaths {
    /// The folder; none if the system has none for caches.
    folder: Option<PathBuf>,
    hash: String,
    has_steps: bool,
    sum: Arc<Mutex<PairwiseSum>>,
    n_before: u32,
    begin: Instant,
    before_s: f64,
    written: Mutex<Written>,
}

/// When this run wrote the file.
struct Written {
    at: Instant,
    took: Duration,
}

/// The first line of a file, as JSON. Little-endian f64 values follow, part by part, and the
/// SHA-256 of all that.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    hash: String,
    /// Number of samples of each part.
    parts: Vec<u32>,
    /// Number of values of each part.
    n_values: usize,
    /// Time that the paths took.
    seconds: f64,
}

impl KeptPaths {
    /// Takes up the paths of a picture in `folder`, unless there are more than `at_most`: a path
    /// cannot be taken out of a sum.
    ///
    /// # Errors
    /// The frame cannot be computed.
    pub fn open(
        folder: Option<&Path>,
        request: &ReferenceRequest<'_>,
        pixels: &Pixels,
        of: PathSums,
        at_most: Option<u32>,
    ) -> Result<KeptPaths> {
        let mut kept = KeptPaths::new(folder, request, pixels, of)?;
        let found = kept.read(None, of.n_values() * pixels.at.len());
        kept.begin_with(found.filter(|(sum, _)| at_most.is_none_or(|n| sum.n_samples() <= n)));
        Ok(kept)
    }

    /// Takes up the paths through the centres of a study's pixels: the first number that is
    /// `enough`, else all. Paths that are added then end as they would without a file.
    ///
    /// # Errors
    /// The frame cannot be computed.
    pub fn open_study(
        folder: Option<&Path>,
        request: &ReferenceRequest<'_>,
        pixels: &Pixels,
        enough: &Enough<'_>,
    ) -> Result<KeptPaths> {
        let mut kept = KeptPaths::new(folder, request, pixels, PathSums::Centers)?;
        kept.has_steps = true;
        let n_values = N_VALUES * pixels.at.len();
        let mut found = None;
        let steps = (FIRST_STEP.ilog2()..32).map(|k| 1 << k).take_while(|n| *n <= enough.most);
        for n in steps {
            let Some(step) = kept.read(Some(n), n_values) else { break };
            let is_enough = step.0.whole().is_some_and(|sum| enough.holds(sum));
            found = Some(step);
            if is_enough {
                kept.begin_with(found);
                return Ok(kept);
            }
        }
        let n_steps = found.as_ref().map_or(0, |(sum, _)| sum.n_samples());
        let all = kept.read(None, n_values).filter(|(sum, _)| {
            (n_steps.max(1)..2 * n_steps.max(FIRST_STEP / 2)).contains(&sum.n_samples())
                && sum.n_samples() <= enough.most
        });
        kept.begin_with(all.or(found));
        Ok(kept)
    }

    fn new(
        folder: Option<&Path>,
        request: &ReferenceRequest<'_>,
        pixels: &Pixels,
        of: PathSums,
    ) -> Result<KeptPaths> {
        let hash = hash_of_paths(request.scene, request.time_s, pixels)?;
        let begin = Instant::now();
        Ok(KeptPaths {
            folder: folder.map(Path::to_owned),
            hash: digest(format!("{hash}\n{of:?}").as_bytes()),
            has_steps: false,
            sum: Arc::default(),
            n_before: 0,
            begin,
            before_s: 0.0,
            written: Mutex::new(Written { at: begin, took: Duration::ZERO }),
        })
    }

    fn begin_with(&mut self, found: Option<(PairwiseSum, f64)>) {
        let (sum, seconds) = found.unwrap_or_default();
        (self.n_before, self.before_s) = (sum.n_samples(), seconds);
        self.sum = Arc::new(Mutex::new(sum));
    }

    /// SHA-256 of everything that the paths depend on, and of their number, in hex.
    pub fn hash(&self) -> String {
        digest(format!("{}\n{}", self.hash, self.n_samples()).as_bytes())
    }

    /// Number of paths of a pixel that an earlier run kept.
    pub fn n_before(&self) -> u32 {
        self.n_before
    }

    /// Number of paths of a pixel.
    pub fn n_samples(&self) -> u32 {
        self.lock_sum().n_samples()
    }

    /// Returns the sum of all paths; `None` if there are none.
    pub fn total(&self) -> Option<SampleSums> {
        self.lock_sum().total()
    }

    /// Seconds that all paths took, in this run and before.
    pub fn seconds(&self) -> f64 {
        let is_new = self.n_samples() > self.n_before;
        self.before_s + if is_new { self.begin.elapsed().as_secs_f64() } else { 0.0 }
    }

    /// Hands the paths on to be added to, until `stop` is set, and keeps them.
    pub fn grow<T>(
        &self,
        stop: &AtomicBool,
        on_progress: OnProgress,
        add: impl FnOnce(&Grown<'_>) -> T,
    ) -> T {
        let on_sample = |sum: &PairwiseSum| self.write_if_due(sum);
        let found = add(&Grown { sum: self.sum.clone(), on_sample: &on_sample, stop, on_progress });
        self.keep();
        found
    }

    /// Writes the paths if the disk has fewer, and returns what it has then.
    pub fn keep(&self) -> OnDisk {
        self.write(&self.lock_sum(), &mut self.lock_written())
    }

    fn lock_sum(&self) -> MutexGuard<'_, PairwiseSum> {
        self.sum.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock_written(&self) -> MutexGuard<'_, Written> {
        self.written.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The file of all paths, or that of a step.
    fn path(&self, step: Option<u32>) -> Option<PathBuf> {
        let name = match step {
            None => format!("{}.paths", self.hash),
            Some(n) => format!("{}-{n}.paths", self.hash),
        };
        Some(self.folder.as_ref()?.join(name))
    }

    fn read(&self, step: Option<u32>, n_values: usize) -> Option<(PairwiseSum, f64)> {
        let path = self.path(step)?;
        let found = read(&path, &self.hash, n_values)
            .filter(|(sum, _)| step.is_none_or(|n| sum.n_samples() == n));
        if found.is_none() && head(&path, &self.hash).is_some() {
            // A damaged file may say to have more paths than this run, which then keeps none.
            let _ = fs::remove_file(&path);
        }
        found
    }

    fn write_if_due(&self, sum: &PairwiseSum) {
        if let Some(whole) = sum.whole().filter(|s| self.has_steps && s.n_samples >= FIRST_STEP) {
            self.write_parts(Some(whole.n_samples), &[whole]);
        }
        let mut written = self.lock_written();
        if written.at.elapsed() >= WRITE_STEP.max(TIMES_A_WRITE * written.took) {
            self.write(sum, &mut written);
            written.at = Instant::now();
        }
    }

    /// Writes the first paths, as many as a file takes, if the disk has fewer.
    fn write(&self, sum: &PairwiseSum, written: &mut Written) -> OnDisk {
        let begin = Instant::now();
        let mut bytes = 0;
        let fits = |part: &&SampleSums| {
            bytes += 8 * part.values.len() as u64;
            bytes <= MOST_VALUES
        };
        let parts: Vec<&SampleSums> = sum.parts().iter().take_while(fits).collect();
        let n = parts.iter().map(|part| part.n_samples).sum();
        // Another run may have written since this one read.
        let on_disk = self.path(None).and_then(|path| head(&path, &self.hash)).unwrap_or(0);
        let on_disk = if n > on_disk && self.write_parts(None, &parts).is_some() {
            written.took = begin.elapsed();
            n
        } else {
            on_disk
        };
        match on_disk {
            0 => OnDisk::Nothing,
            on_disk if on_disk > n => OnDisk::Others(on_disk),
            on_disk => OnDisk::These(on_disk),
        }
    }

    /// Writes a file. One that cannot be written only costs time.
    fn write_parts(&self, step: Option<u32>, parts: &[&SampleSums]) -> Option<()> {
        let path = self.path(step)?;
        let _ = path.parent().map(fs::create_dir_all);
        let head = Head {
            hash: self.hash.clone(),
            parts: parts.iter().map(|part| part.n_samples).collect(),
            n_values: parts.first()?.values.len(),
            seconds: self.before_s + self.begin.elapsed().as_secs_f64(),
        };
        write(&path, &head, parts).ok()
    }
}

impl Drop for KeptPaths {
    /// A panic that ends the paths early, as the viewer's do, leaves those that are finished.
    fn drop(&mut self) {
        self.keep();
    }
}

fn write(path: &Path, head: &Head, parts: &[&SampleSums]) -> Result<()> {
    let mut line = serde_json::to_vec(head).unwrap_or_default();
    line.push(b'\n');
    write_atomic(path, |file| {
        let mut hasher = Sha256::new();
        hasher.update(&line);
        file.write_all(&line)?;
        let values = parts.iter().flat_map(|part| part.values.chunks(N_AT_ONCE));
        for values in values {
            let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            hasher.update(&bytes);
            file.write_all(&bytes)?;
        }
        file.write_all(&hasher.finalize())
    })
}

/// Opens a file and returns the line of its head, with what it says; `None` if it is not there, or
/// of other paths.
fn open(path: &Path, hash: &str) -> Option<(BufReader<fs::File>, Vec<u8>, Head)> {
    let mut file = BufReader::new(input_file::open(path, MOST_VALUES + MOST_HEAD).ok()?);
    let mut line = Vec::new();
    file.by_ref().take(MOST_HEAD).read_until(b'\n', &mut line).ok()?;
    let head: Head = serde_json::from_slice(&line).ok()?;
    (head.hash == hash).then_some((file, line, head))
}

/// Returns the number of samples that a file says to have.
fn head(path: &Path, hash: &str) -> Option<u32> {
    let (_, _, head) = open(path, hash)?;
    head.parts.iter().try_fold(0u32, |sum, n| sum.checked_add(*n))
}

/// Returns the sums of a file and the seconds that they took; `None` if it is not there or damaged.
fn read(path: &Path, hash: &str, n_values: usize) -> Option<(PairwiseSum, f64)> {
    let (mut file, line, head) = open(path, hash)?;
    let n_bytes = head.parts.len().checked_mul(n_values)?.checked_mul(8)?;
    if head.n_values != n_values || n_values == 0 || n_bytes as u64 > MOST_VALUES {
        return None;
    }
    let mut hasher = Sha256::new();
    hasher.update(&line);
    let mut bytes = vec![0; 8 * N_AT_ONCE];
    let mut parts = Vec::new();
    for n_samples in head.parts {
        let mut values = Vec::with_capacity(n_values);
        while values.len() < n_values {
            let bytes = &mut bytes[..8 * N_AT_ONCE.min(n_values - values.len())];
            file.read_exact(bytes).ok()?;
            hasher.update(&*bytes);
            let value = |b: &[u8]| b.try_into().map(f64::from_le_bytes).ok();
            values.extend(bytes.chunks_exact(8).filter_map(value));
        }
        parts.push(SampleSums { n_samples, values });
    }
    let mut end = Vec::new();
    file.read_to_end(&mut end).ok()?;
    let is_whole = end == hasher.finalize().as_slice() && !parts.is_empty();
    let sum = PairwiseSum::of_parts(parts).filter(|_| is_whole)?;
    Some((sum, head.seconds))
}

/// The paths that a command traces at present, which the thread of Ctrl-C keeps.
#[derive(Clone, Default)]
pub struct Traced(Arc<Mutex<Option<Arc<KeptPaths>>>>);

impl Traced {
    /// Takes the paths that the command begins to trace.
    pub fn begin(&self, kept: KeptPaths) -> Arc<KeptPaths> {
        let kept = Arc::new(kept);
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(kept.clone());
        kept
    }

    /// Keeps the paths, and returns what the disk has then; `None` if the command traces none.
    pub fn keep(&self) -> Option<OnDisk> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        kept.map(|kept| kept.keep())
    }

    /// The command traces no paths any more.
    pub fn end(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}
