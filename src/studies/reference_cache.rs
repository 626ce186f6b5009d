//! A cache of references on disk. The key is the hash of everything that a reference depends on:
//! the code, the relevant keys of the scene, the time, the pixels and the kind of reference.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::Result;
use crate::gpu::cache_folder;
use crate::io::atomic::write_atomic;
use crate::io::input_file;
use crate::model::basis::Sampling;
use crate::model::film::{Film, FilmFormat, ToneMap};
use crate::model::scene::{Gather, Lighting, Pairs, Scene, Simulate, Threading, Threads};
use crate::model::sums::Sums;
use crate::reference::picture::{OnProgress, Pixels, Reference, ReferenceKind};

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

/// Returns the reference from the cache in `folder`, or computes it and stores it there.
///
/// # Errors
/// Fails if the scene has no such reference, or computing it fails. A cache that cannot be written
/// is not an error.
pub fn reference(
    against: ReferenceKind,
    scene: &Scene,
    time_s: f64,
    pixels: &Pixels,
    folder: Option<&Path>,
    listener: OnProgress,
) -> Result<CachedReference> {
    against.check(scene, time_s)?;
    let hash = hash_of(against, scene, time_s, pixels);
    let path = folder.map(|folder| folder.join(format!("{hash}.f64")));
    // A damaged file is computed again.
    if let Some(reference) = path.as_ref().and_then(|path| read(path, &hash, pixels.at.len())) {
        return Ok(CachedReference { reference, hash, from_cache: true });
    }
    let reference = against.render(scene, time_s, pixels, listener)?;
    if let Some(path) = path {
        // A cache that cannot be written only costs time.
        let _ = path.parent().map(fs::create_dir_all);
        let _ = write(&path, &hash, &reference);
    }
    Ok(CachedReference { reference, hash, from_cache: false })
}

/// Returns whether two scenes have the same reference at every time.
pub fn is_same(against: ReferenceKind, a: &Scene, b: &Scene) -> bool {
    relevant(a, against) == relevant(b, against)
}

/// Returns the hash of everything that a reference depends on.
pub(super) fn hash_of(
    against: ReferenceKind,
    scene: &Scene,
    time_s: f64,
    pixels: &Pixels,
) -> String {
    let mut hasher = Sha256::new();
    let pixels = (pixels.width, pixels.height, pixels.tile, pixels.cell);
    hasher.update(format!(
        "{}\n{against}\n{:x}\n{pixels:?}\n",
        env!("NIMBUS_REFERENCE_CODE"),
        time_s.to_bits()
    ));
    // Debug prints the shortest digits that read back as the same numbers, so that two different
    // scenes have different texts.
    hasher.update(format!("{:?}", relevant(scene, against)));
    format!("{:x}", hasher.finalize())
}

/// Returns `scene` with every setting that this kind of reference ignores at a fixed value.
fn relevant(scene: &Scene, against: ReferenceKind) -> Scene {
    let scene = against.without_approximations(scene);
    let Lighting { mode, grid, step, forward, facets_per_cloud, sun_radius, .. } = scene.lighting;
    let by_model = matches!(
        against,
        ReferenceKind::Model | ReferenceKind::Reflections(_) | ReferenceKind::Transport
    );
    let (grid, step, facets_per_cloud) =
        if by_model { (1, 1.0, None) } else { (grid, step, facets_per_cloud) };
    let lighting = Lighting {
        mode,
        grid,
        step,
        forward,
        facets_per_cloud,
        bases: 1,
        sampling: Sampling::Log,
        exponents: [1.0, 1.0],
        gather: Gather::Exact,
        theta: 0.0,
        pairs: Pairs { size: 1.0, levels: 0, steps: 1 },
        sums: Sums::default(),
        sun_radius,
    };
    let film = Film {
        format: FilmFormat::Rgba32f,
        background: glam::DVec3::ZERO,
        exposure: 1.0,
        tone_map: ToneMap::Clip,
        ..scene.film
    };
    let threads = Threads { mode: Threading::Serial, simulate: Simulate::Gpu };
    let mut relevant = Scene { title: String::new(), film, lighting, threads, ..scene.clone() };
    if by_model {
        relevant.surfaces.iter_mut().for_each(|s| s.subdivide = [1, 1]);
    }
    relevant
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

/// Returns the SHA-256 of `bytes` in hex.
pub(super) fn digest(bytes: &[u8]) -> String {
    format!("{:x}", Sha256::digest(bytes))
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
