//! The hash of everything that a reference depends on: the code, the relevant keys of the scene,
//! the time, the pixels and the kind of reference.

use sha2::{Digest, Sha256};

use crate::model::basis::Sampling;
use crate::model::film::{Film, FilmFormat, ToneMap};
use crate::model::scene::{
    Gather, Lighting, LightingMode, Pairs, Scene, Simulate, Threading, Threads,
};
use crate::model::sums::Sums;
use crate::reference::picture::{Pixels, ReferenceKind};

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
    // Paths know no modes.
    let mode = if against.is_random() { LightingMode::First } else { mode };
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

/// Returns the SHA-256 of `bytes` in hex.
pub(super) fn digest(bytes: &[u8]) -> String {
    format!("{:x}", Sha256::digest(bytes))
}
