//! A cache of references on disk, by the hash of everything that they depend on. A reference of
//! random paths is refined, and any other is read back.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::kept_paths::{KeptPaths, Traced};
use super::reference_hash::{digest, hash_of};
use crate::error::Result;
use crate::gpu::cache_folder;
use crate::io::atomic::write_atomic;
use crate::io::input_file;
use crate::reference::picture::{
    Grown, MeanPicture, OnProgress, PathLimits, Pixels, Reference, ReferenceRequest, render_paths,
};

/// Largest file of the cache: 32 bytes for each pixel of the largest picture of a study.
const LARGEST_FILE: u64 = 512 << 20;

/// A reference, and whether it was computed now.
#[derive(Debug, Clone, PartialEq)]
pub struct CachedReference {
    /// The picture.
    pub reference: Reference,
    /// SHA-256 of everything that it depends on, in hex.
    pub hash: String,
    /// Whether it was read from the cache.
    pub from_cache: bool,
}

/// The first line of a file, as JSON. Little-endian f64 values follow, four a pixel.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    hash: String,
    own_error: f64,
    accuracy: String,
    seconds: f64,
    pixels_s: f64,
    n_pixels: usize,
    /// SHA-256 of the values, in hex.
    content: String,
}

/// Returns the folder of the cache; none if the system has no folder for caches.
pub fn default_folder() -> Option<PathBuf> {
    cache_folder("references")
}

/// How a reference is made.
#[derive(Clone, Copy)]
pub struct Making<'a> {
    /// Folder of references that are kept.
    pub folder: Option<&'a Path>,
    /// Random paths of a reference that has them.
    pub limits: PathLimits,
    /// Ends random paths early once it is set; they are kept.
    pub stop: &'a AtomicBool,
    /// Gets the random paths while they are traced.
    pub traced: &'a Traced,
}

/// Returns the reference from the cache, or computes it and stores it there. One of random paths
/// goes on from the paths that the cache has.
///
/// # Errors
/// Fails if the scene has no such reference, or computing it fails or was stopped. A cache that
/// cannot be written is not an error.
pub fn reference(
    request: &ReferenceRequest<'_>,
    pixels: &Pixels,
    how: &Making<'_>,
    listener: OnProgress,
) -> Result<CachedReference> {
    let ReferenceRequest { kind, scene, time_s } = *request;
    kind.check(scene, time_s)?;
    if kind.is_random() {
        return refined(request, pixels, how, listener);
    }
    let hash = hash_of(kind, scene, time_s, pixels);
    let path = how.folder.map(|folder| folder.join(format!("{hash}.f64")));
    // A damaged file is computed again.
    if let Some(reference) = path.as_ref().and_then(|path| read(path, &hash, pixels.at.len())) {
        return Ok(CachedReference { reference, hash, from_cache: true });
    }
    let reference = kind.render(scene, time_s, pixels, listener)?;
    if let Some(path) = path {
        // A cache that cannot be written only costs time.
        let _ = path.parent().map(fs::create_dir_all);
        let _ = write(&path, &hash, &reference);
    }
    Ok(CachedReference { reference, hash, from_cache: false })
}

/// Adds random paths to those in the cache until the reference is within its limits.
fn refined(
    request: &ReferenceRequest<'_>,
    pixels: &Pixels,
    how: &Making<'_>,
    listener: OnProgress,
) -> Result<CachedReference> {
    let is_enough = |mean: &MeanPicture| how.limits.hold(mean);
    let enough = how.limits.enough(&is_enough);
    let kept = how.traced.begin(KeptPaths::open_study(how.folder, request, pixels, &enough)?);
    let add = |grown: &Grown<'_>| render_paths(request, pixels, &enough, grown);
    let reference = kept.grow(how.stop, listener, add)?;
    how.traced.end();
    let from_cache = kept.n_samples() == kept.n_before();
    let (hash, seconds) = (kept.hash(), kept.seconds());
    let reference = Reference { seconds, pixels_s: seconds, ..reference };
    Ok(CachedReference { reference, hash, from_cache })
}

fn read(path: &Path, hash: &str, n_pixels: usize) -> Option<Reference> {
    let bytes = input_file::read(path, LARGEST_FILE).ok()?;
    let end = bytes.iter().position(|b| *b == b'\n')?;
    let head: Head = serde_json::from_slice(&bytes[..end]).ok()?;
    let numbers = &bytes[end + 1..];
    let is_whole =
        head.hash == hash && head.n_pixels == n_pixels && head.content == digest(numbers);
    let value = |b: &[u8]| b.try_into().map(f64::from_le_bytes).ok();
    let values: Vec<f64> = numbers.chunks_exact(8).map(value).collect::<Option<_>>()?;
    let rgba: Vec<[f64; 4]> = values.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect();
    let Head { own_error, accuracy, seconds, pixels_s, .. } = head;
    (is_whole && rgba.len() == n_pixels).then_some(Reference {
        rgba,
        own_error,
        variances: vec![],
        accuracy,
        seconds,
        pixels_s,
    })
}

fn write(path: &Path, hash: &str, reference: &Reference) -> Result<()> {
    let numbers: Vec<u8> = reference.rgba.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let Reference { own_error, accuracy, seconds, pixels_s, .. } = reference;
    let head = Head {
        hash: hash.to_owned(),
        own_error: *own_error,
        accuracy: accuracy.clone(),
        seconds: *seconds,
        pixels_s: *pixels_s,
        n_pixels: reference.rgba.len(),
        content: digest(&numbers),
    };
    write_atomic(path, |file| {
        serde_json::to_writer(&mut *file, &head).map_err(std::io::Error::other)?;
        file.write_all(b"\n")?;
        file.write_all(&numbers)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cached_reference_is_read_back_and_a_damaged_one_is_not() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.f64");
        let rgba = vec![[0.1, -2.0, 1e-300, 1.0], [0.0, f64::MAX, 0.3, 0.4]];
        let reference = Reference {
            rgba,
            own_error: 1e-7,
            variances: vec![],
            accuracy: "rounding".into(),
            seconds: 2.5,
            pixels_s: 0.5,
        };
        write(&path, "abc", &reference).unwrap();
        assert_eq!(read(&path, "abc", 2), Some(reference));
        assert_eq!((read(&path, "abd", 2), read(&path, "abc", 3)), (None, None));
        // A flipped bit, and a file that was cut off.
        let mut bytes = fs::read(&path).unwrap();
        let n = bytes.len();
        bytes[n - 3] ^= 1;
        fs::write(&path, &bytes).unwrap();
        assert_eq!(read(&path, "abc", 2), None);
        fs::write(&path, &bytes[..n - 8]).unwrap();
        assert_eq!((read(&path, "abc", 2), read(&dir.path().join("none"), "abc", 2)), (None, None));
    }
}
