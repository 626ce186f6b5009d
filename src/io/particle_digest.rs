//! The hash of particles.

use sha2::{Digest, Sha256};

use crate::model::cloud::Particle;
use crate::model::parallel::parallel_map;
use crate::model::particle_list::ParticleList;

/// Particles that one thread hashes.
const PART: usize = 1 << 16;

/// Returns the SHA-256 of a list, made of those of its parts where there are several. It stands in
/// a scene's hash for a file of which the list is all that is drawn.
pub fn digest(list: &ParticleList) -> [u8; 32] {
    let part = |i: usize| -> [u8; 32] {
        let part = i * PART..list.len().min((i + 1) * PART);
        let mut hash = Sha256::new();
        list[part.clone()].iter().for_each(|p| add(&mut hash, p));
        if let Some(of) = list.harmonics() {
            let words = of.by_particle[part].as_flattened().as_flattened();
            match cfg!(target_endian = "little") {
                true => hash.update(bytemuck::cast_slice(words)),
                false => words.iter().for_each(|v| hash.update(v.to_le_bytes())),
            }
        }
        hash.finalize().into()
    };
    match list.len().div_ceil(PART) {
        0 | 1 => part(0),
        n => Sha256::digest(parallel_map(n, part).as_flattened()).into(),
    }
}

fn add(hash: &mut Sha256, p: &Particle) {
    let ([x, y, z], [r, g, b]) = (p.position.to_array(), p.color.to_array());
    let all = [x, y, z, p.sigma, p.shape.aspect, p.kappa, r, g, b].map(f64::to_le_bytes);
    hash.update(all.as_flattened());
    if !p.shape.is_upright() {
        hash.update(p.shape.aspect_z.to_le_bytes());
        hash.update(p.shape.turn.words().map(u32::to_le_bytes).as_flattened());
    }
}
