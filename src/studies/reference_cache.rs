//! References kept between runs, by the hash of all that they are computed from: the code, the
//! scene as far as it counts, time, pixels, and what is asked for.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::Result;
use crate::gpu::cache_folder;
use crate::io::atomic::write_atomic;
use crate::model::basis::Sampling;
use crate::model::film::{Film, FilmFormat, ToneMap};
use crate::model::scene::{Gather, Lighting, Pairs, Scene, Simulate, Threading, Threads};
use crate::model::sums::Sums;
use crate::reference::picture::{OnProgress, Pixels, Reference, ReferenceKind};

/// A reference, and where it came from.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    pub reference: Reference,
    /// SHA-256, hex.
    pub hash: String,
    pub from_cache: bool,
}

/// The first line of a file; numbers of f64 in little-endian order follow, four a pixel.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    hash: String,
    own_error: f64,
    accuracy: String,
    seconds: f64,
    pixels_s: f64,
    n_pixels: usize,
    /// SHA-256 of the numbers, hex.
    content: String,
}

/// Where references are kept; none where there is no place for caches.
pub fn default_folder() -> Option<PathBuf> {
    cache_folder("references")
}

/// The reference from `folder`, or computed and put there.
pub fn reference(
    against: ReferenceKind,
    scene: &Scene,
    time_s: f64,
    pixels: &Pixels,
    folder: Option<&Path>,
    listener: OnProgress,
) -> Result<Kept> {
    against.check(scene, time_s)?;
    let hash = hash_of(against, scene, time_s, pixels);
    let path = folder.map(|folder| folder.join(format!("{hash}.f64")));
    // A file that is not whole is made again.
    if let Some(reference) = path.as_ref().and_then(|path| read(path, &hash, pixels.at.len())) {
        return Ok(Kept { reference, hash, from_cache: true });
    }
    let reference = against.render(scene, time_s, pixels, listener)?;
    if let Some(path) = path {
        // A cache that cannot be written costs time and nothing else.
        let _ = path.parent().map(fs::create_dir_all);
        let _ = write(&path, &hash, &reference);
    }
    Ok(Kept { reference, hash, from_cache: false })
}

/// Whether two scenes have one reference at one time.
pub fn is_same(against: ReferenceKind, a: &Scene, b: &Scene) -> bool {
    counted(&ReferenceKind::without_approximations(a), against)
        == counted(&ReferenceKind::without_approximations(b), against)
}

fn hash_of(against: ReferenceKind, scene: &Scene, time_s: f64, pixels: &Pixels) -> String {
    let mut hasher = Sha256::new();
    let counted = counted(&ReferenceKind::without_approximations(scene), against);
    let pixels = (pixels.width, pixels.height, pixels.tile, pixels.cell);
    hasher.update(format!(
        "{}\n{against}\n{:x}\n{pixels:?}\n",
        env!("NIMBUS_REFERENCE_CODE"),
        time_s.to_bits()
    ));
    // Shortest digits that read back as the same numbers: two scenes that differ differ here.
    hasher.update(format!("{counted:?}"));
    format!("{:x}", hasher.finalize())
}

/// `scene` with everything that `against` does not look at made alike.
fn counted(scene: &Scene, against: ReferenceKind) -> Scene {
    let Lighting { mode, grid, step, forward, facets_per_cloud, .. } = scene.lighting;
    let by_model = matches!(against, ReferenceKind::Model | ReferenceKind::Reflections(_));
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
    };
    let film = Film {
        format: FilmFormat::Rgba32f,
        background: glam::DVec3::ZERO,
        exposure: 1.0,
        tone_map: ToneMap::Clip,
        ..scene.film
    };
    let threads = Threads { mode: Threading::Serial, simulate: Simulate::Gpu };
    let mut counted = Scene { title: String::new(), film, lighting, threads, ..scene.clone() };
    if by_model {
        counted.surfaces.iter_mut().for_each(|s| s.subdivide = [1, 1]);
    }
    counted
}

fn read(path: &Path, hash: &str, n_pixels: usize) -> Option<Reference> {
    let bytes = fs::read(path).ok()?;
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

fn digest(bytes: &[u8]) -> String {
    format!("{:x}", Sha256::digest(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_read_back_and_what_is_broken_is_not() {
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
        // A bit that flipped, a file that was cut.
        let mut bytes = fs::read(&path).unwrap();
        let n = bytes.len();
        bytes[n - 3] ^= 1;
        fs::write(&path, &bytes).unwrap();
        assert_eq!(read(&path, "abc", 2), None);
        fs::write(&path, &bytes[..n - 8]).unwrap();
        assert_eq!((read(&path, "abc", 2), read(&dir.path().join("none"), "abc", 2)), (None, None));
    }
}
