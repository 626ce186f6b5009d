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
use crate::model::cloud::Particle;
use crate::model::harmonics::{Coefficients, Harmonics};

/// The element whose rows are particles.
const ELEMENT: &str = "vertex";

/// Particles of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Read {
    /// The particles, in the order of the file.
    pub particles: Vec<Particle>,
    /// How their colours change with the direction of view.
    pub harmonics: Option<Harmonics>,
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
    let of_harmonics = columns.harmonics().map_or(0, |_| size_of::<Coefficients>());
    let n_bytes = element.n.saturating_mul((size_of::<Particle>() + of_harmonics) as u64);
    memory::check(n_bytes, || format!("{}: {} particles", path.display(), element.n))?;
    let particles = rows.map(&columns)?;
    let harmonics = columns.harmonics().map(|of| -> Result<Harmonics> {
        let by_particle = rows.map(of)?;
        Ok(Harmonics { degree: of.degree(), by_particle })
    });
    Ok(Read { particles, harmonics: harmonics.transpose()? })
}

#[cfg(test)]
mod tests;
