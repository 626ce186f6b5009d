//! Particles in PLY files, which are read where they lie, and written.
//!
//! A file has particles as CSV has them (`x`, `y`, `z`, `sigma`, `kappa`, `r`, `g`, `b`), or splats
//! of 3D Gaussian splatting (`scale_0`…, `rot_0`…, `opacity`, `f_dc_0`…), or a mixture of both:
//! model.md §14 says what the latter mean in optical depth.

mod header;
mod rows;
mod splats;
mod write;

use std::mem::size_of;
use std::path::Path;

use header::Header;
use rows::Rows;
use splats::Columns;
pub use write::{ENDING, write};

use sha2::{Digest, Sha256};

use super::mapped_file::MappedFile;
use super::memory;
use crate::error::{Error, Place, Result};
use crate::model::cloud::Particle;

/// The element whose rows are particles.
const ELEMENT: &str = "vertex";

/// Particles of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Read {
    /// The particles, in the order of the file.
    pub particles: Vec<Particle>,
    /// What the user should know of them.
    pub notes: Vec<String>,
}

/// Returns whether a file is named as a PLY file.
pub fn is_named(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(ENDING))
}

/// Reads the particles of a file.
///
/// # Errors
/// As [`parse`].
pub fn read(file: &MappedFile, path: &Path) -> Result<Read> {
    parse(file.bytes(), path)
}

/// Returns the SHA-256 of particles, which stands in a scene's hash for their file.
pub fn digest(particles: &[Particle]) -> [u8; 32] {
    let mut hash = Sha256::new();
    for p in particles {
        let ([x, y, z], [r, g, b]) = (p.position.to_array(), p.color.to_array());
        let all = [x, y, z, p.sigma, p.aspect, p.kappa, r, g, b];
        hash.update(bytemuck::cast::<[f64; 9], [u8; 72]>(all));
    }
    hash.finalize().into()
}

/// Reads particles from the bytes of a PLY file; `path` is its name in messages.
///
/// # Errors
/// When the bytes hold a fault, with line and column or the number of the row, and when the
/// particles do not fit in memory.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Read> {
    let header = Header::parse(bytes, path)?;
    let Some(i) = header.elements.iter().position(|e| e.name == ELEMENT) else {
        let what = format!("expected an element `{ELEMENT}`, whose rows are particles");
        return Err(Error::scene(Place::line(path, header.n_lines, 1), what));
    };
    let element = &header.elements[i];
    let columns = Columns::find(element)
        .map_err(|what| Error::scene(Place::line(path, element.line, 1), what))?;
    let rows = Rows::new(&header, bytes, i, path)?;
    let n_bytes = element.n.saturating_mul(size_of::<Particle>() as u64);
    memory::check(n_bytes, || format!("{}: {} particles", path.display(), element.n))?;
    let blank = Particle { sigma: 0.0, aspect: 1.0, ..Particle::default() };
    let particles = rows.map(blank, &columns)?;
    let notes = columns.notes(particles.len());
    Ok(Read { particles, notes })
}

#[cfg(test)]
mod tests;
