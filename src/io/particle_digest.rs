//! The hash of particles.

use sha2::{Digest, Sha256};

use crate::model::cloud::Particle;

/// Returns the SHA-256 of particles. It stands in a scene's hash for a file of which they are all
/// that is drawn.
pub fn digest(particles: &[Particle]) -> [u8; 32] {
    let mut hash = Sha256::new();
    for p in particles {
        let ([x, y, z], [r, g, b]) = (p.position.to_array(), p.color.to_array());
        let all = [x, y, z, p.sigma, p.shape.aspect, p.kappa, r, g, b].map(f64::to_le_bytes);
        hash.update(all.as_flattened());
        if !p.shape.is_upright() {
            hash.update(p.shape.aspect_z.to_le_bytes());
            hash.update(p.shape.turn.words().map(u32::to_le_bytes).as_flattened());
        }
    }
    hash.finalize().into()
}
