//! Particles in PLY files, which are read where they lie, and written.
//!
//! A file has the properties that CSV has as columns, or those of 3D Gaussian splatting
//! (`scale_0`…, `rot_0`…, `opacity`, `f_dc_0`…). A file may mix both. Model.md §14 says what the
//! properties of splats mean in optical depth.

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

use super::memory;
use crate::error::{Error, Place, Result};
use crate::model::cloud::{Particle, Shape};

/// The element whose rows are particles.
const ELEMENT: &str = "vertex";

/// Particles of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Read {
    /// The particles, in the order of the file.
    pub particles: Vec<Particle>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Returns whether a file is named as a PLY file.
pub fn is_named(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(ENDING))
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
    let blank = Particle { sigma: 0.0, shape: Shape::BALL, ..Particle::default() };
    let particles = rows.map(blank, &columns)?;
    let notes = columns.notes();
    Ok(Read { particles, notes })
}

#[cfg(test)]
mod tests;
