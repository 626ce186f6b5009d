//! Particles to a PLY file.

use std::io::{self, Write};
use std::path::Path;

use crate::error::Result;
use crate::io::atomic::write_atomic;
use crate::model::cloud::Particle;

/// How the names of PLY files end.
pub const ENDING: &str = "ply";

/// Replaces the file at `path` with `particles`, as numbers of 64 bits, the lowest byte first.
/// Reading the file gives the same particles, to the bit if they are balls.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, particles: &[Particle]) -> Result<()> {
    write_atomic(path, |out| -> io::Result<()> {
        write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", particles.len())?;
        for name in ["x", "y", "z", "sigma", "sigma_y", "kappa", "r", "g", "b"] {
            writeln!(out, "property double {name}")?;
        }
        writeln!(out, "end_header")?;
        for p in particles {
            let ([x, y, z], [r, g, b]) = (p.position.to_array(), p.color.to_array());
            for v in [x, y, z, p.sigma, p.sigma * p.shape.aspect, p.kappa, r, g, b] {
                out.write_all(&v.to_le_bytes())?;
            }
        }
        Ok(())
    })
}
