//! The knobs of a study for which none is named: those that can change the scene.

use glam::DVec3;

use crate::model::scene::{DrawPath, LightingMode, Overlap, Scene};
use crate::timing::sweep::Axis;

/// A scene key, the values worth comparing, and the scenes that it can change.
struct Knob {
    key: &'static str,
    values: &'static [&'static str],
    applies: fn(&Scene) -> bool,
}

const KNOBS: &[Knob] = &[
    Knob { key: "draw.path", values: &["sprites", "tiles"], applies: draws_thin },
    Knob { key: "draw.resolution", values: &["1.0", "0.5", "0.25"], applies: has_particles },
    Knob { key: "draw.cutoff", values: &["2.0", "3.0", "4.0", "auto"], applies: has_particles },
    Knob {
        key: "draw.threshold",
        values: &["0.0", "0.001", "0.01", "0.03"],
        applies: has_particles,
    },
    Knob { key: "draw.lod", values: &["0.0", "0.25", "0.5", "1.0"], applies: has_many },
    Knob { key: "draw.overlap", values: &["thin", "slices"], applies: draws_tiles },
    Knob { key: "draw.slice", values: &["0.75", "1.25", "2.0"], applies: draws_slices },
    Knob { key: "draw.sort_bits", values: &["16", "32"], applies: has_particles },
    // A scene with merged blobs draws all particles.
    Knob {
        key: "draw.count",
        values: &["all", "distance"],
        applies: |s| has_particles(s) && !has_many(s) && s.draw.lod == 0.0,
    },
    Knob { key: "film.format", values: &["rgba8", "rgba16f", "rgba32f"], applies: |_| true },
    Knob { key: "lighting.grid", values: &["16", "32", "64", "128"], applies: marches },
    Knob { key: "lighting.step", values: &["0.5", "1.0", "2.0", "4.0"], applies: marches },
    Knob {
        key: "lighting.facets_per_cloud",
        values: &["32", "128", "512", "auto"],
        applies: |s| marches(s) && !s.groups_facets(),
    },
    Knob {
        key: "lighting.facets_per_cloud",
        values: &["32", "128", "512", "2048", "0"],
        applies: |s| marches(s) && s.groups_facets(),
    },
    Knob {
        key: "lighting.mode",
        values: &["first", "two-reflection"],
        applies: |scene| reflections(scene) == 2,
    },
    Knob { key: "lighting.gather", values: &["exact", "tree"], applies: gathers },
    Knob { key: "lighting.theta", values: &["0.2", "0.4", "0.8"], applies: gathers_from_tree },
    Knob {
        key: "lighting.pair_size",
        values: &["0.25", "0.5", "1.0"],
        applies: |s| gathers(s) && has_surfaces(s),
    },
    Knob {
        key: "surface.*.subdivide",
        values: &["[4,4]", "[6,6]", "[8,8]", "[12,12]"],
        applies: is_lit_surface,
    },
    Knob { key: "lighting.bases", values: &["3", "4", "8", "16"], applies: is_glossy },
    Knob { key: "lighting.sampling", values: &["log", "uniform"], applies: is_glossy },
];

/// Returns the knobs that can change `scene`, with their values.
pub fn default_axes(scene: &Scene) -> Vec<Axis> {
    let axis = |knob: &Knob| Axis {
        key: knob.key.to_owned(),
        values: knob.values.iter().map(|value| (*value).to_owned()).collect(),
    };
    KNOBS.iter().filter(|knob| (knob.applies)(scene)).map(axis).collect()
}

fn draws_thin(scene: &Scene) -> bool {
    has_particles(scene) && scene.draw.overlap == Overlap::Thin
}

fn draws_tiles(scene: &Scene) -> bool {
    has_particles(scene) && scene.draw.path == DrawPath::Tiles
}

fn draws_slices(scene: &Scene) -> bool {
    draws_tiles(scene) && scene.draw.overlap == Overlap::Slices
}

/// Returns whether there are so many particles that some may stand for others.
fn has_many(scene: &Scene) -> bool {
    scene.n_particles() >= 1 << 16 && scene.draw.count.is_none() && !scene.is_textured()
}

fn has_particles(scene: &Scene) -> bool {
    scene.n_particles() > 0
}

fn has_surfaces(scene: &Scene) -> bool {
    !scene.surfaces.is_empty()
}

/// Returns the number of reflections; 0 if nothing is lit.
fn reflections(scene: &Scene) -> u32 {
    match scene.lighting.mode {
        LightingMode::None => 0,
        LightingMode::TwoReflection => 2,
        _ => 1,
    }
}

/// Returns whether light is marched through a density grid.
fn marches(scene: &Scene) -> bool {
    reflections(scene) > 0 && has_particles(scene)
}

fn gathers(scene: &Scene) -> bool {
    reflections(scene) == 2 && scene.n_facets() > 1
}

fn gathers_from_tree(scene: &Scene) -> bool {
    gathers(scene) && crate::frame::gathers_from_tree(scene)
}

fn is_lit_surface(scene: &Scene) -> bool {
    has_surfaces(scene) && reflections(scene) > 0
}

/// Returns whether the second reflection has lobes, which the basis represents.
fn is_glossy(scene: &Scene) -> bool {
    let shines =
        |i: usize| scene.region_material(i).keys.iter().any(|key| key.brdf.ks != DVec3::ZERO);
    gathers(scene) && (0..scene.n_regions()).any(shines)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::scene_file::parse;

    /// Returns the keys that a study of a disc of particles goes through.
    fn keys(n_particles: u32, draw: &str) -> Vec<String> {
        let text = format!("[draw]\n{draw}\n[[cloud]]\nfrom = 'disc'\nparticles = {n_particles}\n");
        let scene = parse(text, Path::new("s.toml"), &[], None).unwrap().scene;
        default_axes(&scene).into_iter().map(|axis| axis.key).collect()
    }

    #[test]
    fn merged_blobs_and_fewer_particles_are_not_combined() {
        let has = |keys: &[String], key: &str| keys.iter().any(|k| k == key);
        for (n, draw, count, lod) in [
            (100, "", true, false),
            (100, "lod = 0.5", false, false),
            (70_000, "", false, true),
            (70_000, "count = 'distance'", true, false),
        ] {
            let keys = keys(n, draw);
            let found = [has(&keys, "draw.count"), has(&keys, "draw.lod")];
            assert_eq!(found, [count, lod], "{n} particles, {draw}");
        }
    }
}
