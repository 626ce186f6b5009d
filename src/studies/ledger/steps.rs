//! The approximations that the device itself can leave out, one after the other: what each is in a
//! scene, and what it stands for.

use crate::frame::{gathers_from_tree, is_glossy};
use crate::model::basis::MAX_BASES;
use crate::model::cutoff::Cutoff;
use crate::model::film::FilmFormat;
use crate::model::resolution::Resolution;
use crate::model::scene::{Chunks, DrawPath, Gather, LightingMode, Scene};
use crate::model::sort_bits::SortBits;

/// An approximation, and the scene without it.
pub struct Step {
    pub name: &'static str,
    pub from: String,
    pub to: String,
    pub without: Scene,
}

/// Nothing of a blob is cut there: e^{−32} of its depth are left.
const UNCUT: f64 = 8.0;

/// Those of `scene`, in which nothing is "auto", each on top of the one before.
pub fn steps(scene: &Scene) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    let mut now = scene.clone();
    for (name, what, describe, lift) in ALL {
        if !what.is_in(scene) {
            continue;
        }
        let mut without = now.clone();
        lift(&mut without);
        if without != now {
            steps.push(Step {
                name,
                from: describe(&now),
                to: describe(&without),
                without: without.clone(),
            });
            now = without;
        }
    }
    steps
}

/// What of a scene an approximation is of.
#[derive(Clone, Copy)]
enum What {
    Picture,
    Particles,
    Second,
    Lobes,
}

impl What {
    fn is_in(self, scene: &Scene) -> bool {
        let second = scene.lighting.mode == LightingMode::TwoReflection;
        match self {
            What::Picture => true,
            What::Particles => scene.n_particles() > 0,
            What::Second => second,
            What::Lobes => second && (0..scene.n_regions()).any(|i| is_glossy(scene, i)),
        }
    }
}

/// How a scene has it, in words.
type Describe = fn(&Scene) -> String;
type Lift = fn(&mut Scene);

/// From what is drawn last up to what light is made of.
const ALL: [(&str, What, Describe, Lift); 10] = [
    (
        "resolution",
        What::Particles,
        |s| s.draw.resolution.name().into(),
        |s| s.draw.resolution = Resolution::Full,
    ),
    (
        "smallest",
        What::Particles,
        |s| format!("{} px", s.draw.smallest.bound()),
        |s| s.draw.smallest = Cutoff::At(0.0),
    ),
    (
        "threshold",
        What::Particles,
        |s| format!("tau {}", s.draw.threshold.bound()),
        |s| s.draw.threshold = Cutoff::At(0.0),
    ),
    ("format", What::Picture, format_of, |s| s.film.format = FilmFormat::Rgba32f),
    (
        "chunks",
        What::Particles,
        |s| if let Chunks::Of(n) = s.draw.chunks { n.to_string() } else { "auto".into() },
        |s| {
            // Of tiles they are nothing.
            if s.draw.path == DrawPath::Sprites {
                s.draw.chunks = Chunks::Of(0);
            }
        },
    ),
    (
        "sort bits",
        What::Particles,
        |s| s.draw.sort_bits.number().map_or("auto".into(), |n| n.to_string()),
        |s| s.draw.sort_bits = SortBits::Wide,
    ),
    (
        "count",
        What::Particles,
        |s| if s.draw.count.is_some() { "by distance" } else { "all" }.into(),
        |s| s.draw.count = None,
    ),
    ("cutoff", What::Particles, |s| format!("{} sigma", s.draw.cutoff), |s| s.draw.cutoff = UNCUT),
    (
        "bases",
        What::Lobes,
        |s| s.lighting.bases.to_string(),
        |s| {
            if s.lighting.mode == LightingMode::TwoReflection {
                s.lighting.bases = MAX_BASES;
            }
        },
    ),
    (
        "tree",
        What::Second,
        |s| if gathers_from_tree(s) { "clusters" } else { "pairs" }.into(),
        |s| {
            if gathers_from_tree(s) {
                s.lighting.gather = Gather::Exact;
            }
        },
    ),
];

fn format_of(scene: &Scene) -> String {
    FilmFormat::NAMES
        .iter()
        .find(|(_, format)| *format == scene.film.format)
        .map_or("", |(name, _)| name)
        .to_owned()
}

/// The step from groups of particles to a facet a particle, where `scene` has such.
pub fn ungrouped(scene: &Scene) -> Option<Step> {
    let lit = scene.lighting.mode != LightingMode::None;
    (lit && scene.groups_facets()).then(|| {
        let mut without = scene.clone();
        without.lighting.facets_per_cloud = None;
        // Whichever light is gathered by, it stays.
        if without.lighting.gather == Gather::Auto {
            without.lighting.gather =
                if gathers_from_tree(scene) { Gather::Tree } else { Gather::Exact };
        }
        let n = |s: &Scene| format!("{} facets", s.n_facets());
        Step { name: "facet groups", from: n(scene), to: n(&without), without }
    })
}
