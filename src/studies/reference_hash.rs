//! The hash of everything that a reference depends on: the code, the relevant keys of the scene,
//! the time, the pixels and the kind of reference.

use sha2::{Digest, Sha256};

use crate::error::Result;
use crate::model::basis::Sampling;
use crate::model::cloud::CloudSource;
use crate::model::film::{Film, FilmFormat, ToneMap};
use crate::model::scene::{
    FacetCount, Gather, LightBudget, Lighting, Pairs, Scene, Simulate, Threading, Threads,
};
use crate::model::sums::Sums;
use crate::reference::picture::{Pixels, ReferenceKind, TransportParts};

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
    for cloud in &scene.clouds {
        // The text of an animation does not have its file's particles. One that cannot be read
        // has no reference either.
        if let CloudSource::Animated(moving) = &cloud.source {
            hasher.update(format!("{:?}", moving.animation.at(time_s).map_err(|e| e.to_string())));
        }
    }
    format!("{:x}", hasher.finalize())
}

/// Returns the hash of everything that random paths depend on but their number and places.
///
/// # Errors
/// The frame cannot be computed.
pub(super) fn hash_of_paths(scene: &Scene, time_s: f64, pixels: &Pixels) -> Result<String> {
    let parts = TransportParts::new(scene, time_s)?;
    let pixels = (pixels.width, pixels.height, pixels.tile, pixels.cell);
    let code = env!("NIMBUS_REFERENCE_CODE");
    Ok(digest(format!("{code}\n{pixels:?}\n{parts:?}").as_bytes()))
}

/// Returns `scene` with every setting that this kind of reference ignores at a fixed value.
fn relevant(scene: &Scene, against: ReferenceKind) -> Scene {
    let scene = against.without_approximations(scene);
    let Lighting {
        mode,
        grid,
        layers,
        step,
        forward,
        facets_per_cloud,
        sun_radius,
        octaves,
        diffusion,
        ..
    } = scene.lighting;
    let by_model = matches!(
        against,
        ReferenceKind::Model | ReferenceKind::Reflections(_) | ReferenceKind::Transport
    );
    let (grid, layers, step, facets_per_cloud) = if by_model {
        (1, None, 1.0, FacetCount::Every)
    } else {
        (grid, layers, step, facets_per_cloud)
    };
    let lighting = Lighting {
        mode,
        grid,
        layers,
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
        octaves,
        diffusion,
        budget: LightBudget { ms: None, error: None },
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
