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
        let turned = particles.iter().any(|p| !p.shape.is_upright());
        let of_turned: &[&str] = match turned {
            true => &["sigma_z", "rot_0", "rot_1", "rot_2", "rot_3"],
            false => &[],
        };
        for name in
            ["x", "y", "z", "sigma", "sigma_y", "kappa", "r", "g", "b"].iter().chain(of_turned)
        {
            writeln!(out, "property double {name}")?;
        }
        writeln!(out, "end_header")?;
        for p in particles {
            let ([x, y, z], [r, g, b]) = (p.position.to_array(), p.color.to_array());
            for v in [x, y, z, p.sigma, p.sigma * p.shape.aspect, p.kappa, r, g, b] {
                out.write_all(&v.to_le_bytes())?;
            }
            if turned {
                let [x, y, z, w] = p.shape.turn.rotation().to_array();
                for v in [p.sigma * p.shape.aspect_z, w, x, y, z] {
                    out.write_all(&v.to_le_bytes())?;
                }
            }
        }
        Ok(())
    })
}
