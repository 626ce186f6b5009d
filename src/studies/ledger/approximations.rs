//! The approximations that the device itself can do without.

use crate::frame::{gathers_from_tree, is_glossy};
use crate::model::basis::MAX_BASES;
use crate::model::cutoff::Cutoff;
use crate::model::edge::{EDGE, FARTHEST, Reach};
use crate::model::film::FilmFormat;
use crate::model::resolution::Resolution;
use crate::model::scene::{Chunks, DrawPath, FacetCount, Gather, LightingMode, Scene};
use crate::model::sort_bits::SortBits;

/// An approximation of the scene, and the scene without it.
pub struct Approximation {
    /// Short name.
    pub name: &'static str,
    /// The setting in the scene, in words.
    pub from: String,
    /// The setting without the approximation.
    pub to: String,
    /// The scene without it.
    pub without: Scene,
}

/// Returns the approximations of `scene`, in which nothing is "auto". Each scene also lacks the
/// approximations before it.
pub fn approximations(scene: &Scene) -> Vec<Approximation> {
    let mut found: Vec<Approximation> = Vec::new();
    let mut now = scene.clone();
    for (name, part, describe, remove) in ALL {
        let mut without = now.clone();
        remove(&mut without);
        if part.is_in(scene) && without != now {
            let (from, to) = (describe(&now), describe(&without));
            found.push(Approximation { name, from, to, without: without.clone() });
            now = without;
        }
    }
    found.extend(ungrouped(&now));
    found
}

/// The part of a scene that an approximation affects.
#[derive(Clone, Copy)]
enum Part {
    Picture,
    Particles,
    SecondReflection,
    Lobes,
}

impl Part {
    fn is_in(self, scene: &Scene) -> bool {
        let has_second = scene.lighting.mode == LightingMode::TwoReflection;
        match self {
            Part::Picture => true,
            Part::Particles => scene.n_particles() > 0,
            Part::SecondReflection => has_second,
            Part::Lobes => has_second && (0..scene.n_regions()).any(|i| is_glossy(scene, i)),
        }
    }
}

/// Describes the setting of a scene in words.
type Describe = fn(&Scene) -> String;
/// Removes an approximation from a scene.
type Remove = fn(&mut Scene);

/// The approximations in order: drawing first, the sources of light last.
const ALL: [(&str, Part, Describe, Remove); 11] = [
    (
        "resolution",
        Part::Particles,
        |s| s.draw.resolution.name().into(),
        |s| s.draw.resolution = Resolution::Full,
    ),
    (
        "merged blobs",
        Part::Particles,
        |s| format!("cells of {} sigma", s.draw.lod),
        |s| s.draw.lod = 0.0,
    ),
    (
        "smallest",
        Part::Particles,
        |s| format!("{} px", s.draw.smallest.bound()),
        |s| s.draw.smallest = Cutoff::At(0.0),
    ),
    (
        "threshold",
        Part::Particles,
        |s| format!("tau {}", s.draw.threshold.bound()),
        |s| s.draw.threshold = Cutoff::At(0.0),
    ),
    ("format", Part::Picture, format_of, |s| s.film.format = FilmFormat::Rgba32f),
    (
        "chunks",
        Part::Particles,
        |s| if let Chunks::Of(n) = s.draw.chunks { n.to_string() } else { "auto".into() },
        |s| {
            // Tiles have no chunks.
            if s.draw.path == DrawPath::Sprites {
                s.draw.chunks = Chunks::Of(0);
            }
        },
    ),
    (
        "sort bits",
        Part::Particles,
        |s| s.draw.sort_bits.number().map_or("auto".into(), |n| n.to_string()),
        |s| s.draw.sort_bits = SortBits::Wide,
    ),
    (
        "count",
        Part::Particles,
        |s| if s.draw.count.is_some() { "by distance" } else { "all" }.into(),
        |s| s.draw.count = None,
    ),
    ("cutoff", Part::Particles, cutoff_of, |s| s.draw.cutoff = Reach::Sigmas(FARTHEST)),
    (
        "bases",
        Part::Lobes,
        |s| s.lighting.bases.to_string(),
        |s| {
            if s.lighting.mode == LightingMode::TwoReflection {
                s.lighting.bases = MAX_BASES;
            }
        },
    ),
    (
        "tree",
        Part::SecondReflection,
        |s| if gathers_from_tree(s) { "clusters" } else { "pairs" }.into(),
        |s| {
            if gathers_from_tree(s) {
                s.lighting.gather = Gather::Exact;
            }
        },
    ),
];

fn cutoff_of(scene: &Scene) -> String {
    match scene.draw.cutoff {
        Reach::Sigmas(sigmas) => format!("{sigmas} sigma"),
        Reach::Auto => format!("tau {EDGE}"),
    }
}

fn format_of(scene: &Scene) -> String {
    scene.film.format.name().to_owned()
}

/// Returns the approximation of one facet for a group of particles, if the scene has groups.
fn ungrouped(scene: &Scene) -> Option<Approximation> {
    let lit = scene.lighting.mode != LightingMode::None;
    (lit && scene.groups_facets()).then(|| {
        let mut without = scene.clone();
        without.lighting.facets_per_cloud = FacetCount::Every;
        // The choice between tree and pairs stays the same.
        if without.lighting.gather == Gather::Auto {
            without.lighting.gather =
                if gathers_from_tree(scene) { Gather::Tree } else { Gather::Exact };
        }
        let n = |s: &Scene| format!("{} facets", s.n_facets());
        Approximation { name: "facet groups", from: n(scene), to: n(&without), without }
    })
}
