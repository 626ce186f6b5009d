//! Keeps the light of a frame in f64 on disk, by the hash of everything that it depends on.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::light::Light;
use crate::io::atomic::write_atomic;
use crate::io::input_file;
use crate::model::scene::Scene;
use crate::model::shade::FacetSlope;
use crate::reference::picture::{Pixels, ReferenceKind};
use crate::studies::reference_hash::{digest, hash_of};

/// Largest file: 72 bytes a facet and 40 a second reflection.
const LARGEST_FILE: u64 = 512 << 20;
/// Bytes of the SHA-256 in hex that a file begins with, of all that follows.
const N_DIGEST: usize = 64;

/// Returns the file of a scene without approximations, at a time.
pub fn path(folder: &Path, scene: &Scene, time_s: f64, pixels: &Pixels) -> PathBuf {
    folder.join(format!("{}.light", hash_of(ReferenceKind::Thin, scene, time_s, pixels)))
}

/// Reads a file; none if it is not there or damaged. *Shape*: little-endian f64, the number of
/// facets, that of slopes, the grid's error, three numbers a facet, six a slope, then five a second
/// reflection.
pub fn read(path: &Path, n_facets: u64) -> Option<Light> {
    let bytes = input_file::read(path, LARGEST_FILE).ok()?;
    let (head, numbers) = bytes.split_at_checked(N_DIGEST)?;
    if digest(numbers).as_bytes() != head {
        return None;
    }
    let value = |b: &[u8]| b.try_into().map(f64::from_le_bytes).ok();
    let values: Vec<f64> = numbers.chunks_exact(8).map(value).collect::<Option<_>>()?;
    let ([n, n_slopes, grid_error], rest) = values.split_first_chunk()?;
    let (n, n_slopes, grid_error) = (*n as usize, *n_slopes as usize, *grid_error);
    if [n, n_slopes].iter().any(|n| *n != 0 && *n as u64 != n_facets) {
        return None;
    }
    let (first, rest) = rest.split_at_checked(3 * n)?;
    let (slopes, second) = rest.split_at_checked(6 * n_slopes)?;
    let slope = |v: &[f64]| FacetSlope {
        relative: DVec3::from_slice(v),
        position: DVec3::from_slice(&v[3..]),
    };
    let slopes = slopes.chunks_exact(6).map(slope).collect();
    let first = first.chunks_exact(3).map(DVec3::from_slice).collect();
    let second: BTreeMap<u32, (DVec3, f64)> = second
        .chunks_exact(5)
        .map(|v| (v[0] as u32, (DVec3::from_slice(&v[1..4]), v[4])))
        .collect();
    Some(Light { first, second, grid_error, slopes })
}

/// Writes a file. One that cannot be written only costs time.
pub fn write(path: &Path, light: &Light) {
    let first = light.first.iter().flat_map(|l| l.to_array());
    let second =
        light.second.iter().flat_map(|(i, (l, error))| [f64::from(*i), l.x, l.y, l.z, *error]);
    let slopes =
        light.slopes.iter().flat_map(|s| [s.relative, s.position]).flat_map(|v| v.to_array());
    let head = [light.first.len() as f64, light.slopes.len() as f64, light.grid_error];
    let numbers = head.into_iter().chain(first).chain(slopes).chain(second);
    let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
    let _ = path.parent().map(fs::create_dir_all);
    let _ = write_atomic(path, |file| {
        file.write_all(digest(&bytes).as_bytes())?;
        file.write_all(&bytes)
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_read_back_and_a_damaged_file_is_not() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.light");
        let second = BTreeMap::from([(1, (DVec3::new(0.1, -2.0, 1e-300), 1e-7))]);
        let first = vec![DVec3::ONE, DVec3::new(f64::MAX, 0.3, 0.4)];
        let slope = FacetSlope { relative: DVec3::X, position: DVec3::new(0.1, 0.2, -0.3) };
        let light = Light { first, second, grid_error: 0.25, slopes: vec![slope; 2] };
        write(&path, &light);
        assert_eq!(read(&path, 2), Some(light));
        // Of another scene, cut off, and with a flipped bit.
        assert_eq!(read(&path, 3), None);
        let mut bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() - 8]).unwrap();
        assert_eq!(read(&path, 2), None);
        let n = bytes.len();
        bytes[n - 3] ^= 1;
        fs::write(&path, &bytes).unwrap();
        assert_eq!((read(&path, 2), read(&dir.path().join("none"), 2)), (None, None));
    }
}
