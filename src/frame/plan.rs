//! What a frame can leave out: a pure function of the last packet and the next. Skipping never
//! changes a pixel: a pass is left out only where all that it reads is what it read the last time,
//! to the bit.

use std::fmt;

use super::culling::culls;
use super::exchange::is_glossy;
use super::grouping::is_grouped;
use super::lives::lives;
use super::packet::Packet;
use crate::error::Result;
use crate::gpu::Recorder;
use crate::layout::facet::RegionRecord;
use crate::layout::frame::LightRecord;
use crate::model::cloud::CloudSource;
use crate::model::resolution::Resolution;
use crate::model::scene::{DrawPath, Impostors, LightingMode, Scene};

/// The passes in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pass {
    Generate,
    Live,
    Place,
    Grid,
    Morton,
    Facets,
    Transmit,
    First,
    Second,
    Contract,
    Cull,
    Sort,
    Texture,
    Surfaces,
    Terrain,
    Impostors,
    Sprites,
    Tiles,
    Upsample,
}

impl Pass {
    pub const ALL: [Pass; 19] = [
        Pass::Generate,
        Pass::Live,
        Pass::Place,
        Pass::Grid,
        Pass::Morton,
        Pass::Facets,
        Pass::Transmit,
        Pass::First,
        Pass::Second,
        Pass::Contract,
        Pass::Cull,
        Pass::Sort,
        Pass::Texture,
        Pass::Surfaces,
        Pass::Terrain,
        Pass::Impostors,
        Pass::Sprites,
        Pass::Tiles,
        Pass::Upsample,
    ];

    /// The room's name: timer label and column in the results.
    pub fn name(self) -> &'static str {
        let names = [
            "generate",
            "live",
            "place",
            "grid",
            "morton",
            "facets",
            "transmit",
            "first",
            "second",
            "contract",
            "cull",
            "sort",
            "texture",
            "surfaces",
            "terrain",
            "impostors",
            "sprites",
            "tiles",
            "upsample",
        ];
        names[self as usize]
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decision {
    pub run: bool,
    pub reason: Reason,
}

/// Why a pass runs or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    Of(&'static str),
    /// T2 would take `bytes`, and the device has `most` for it.
    TooLarge {
        bytes: u64,
        most: u64,
    },
    /// A shell is made.
    Made(&'static str),
    /// The shell is shown again, and is off by so many thousandths of a pixel at most.
    Reused {
        milli_px: u32,
    },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Of(text) => f.write_str(text),
            Reason::Made(why) => write!(f, "made anew: {why}"),
            Reason::Reused { milli_px } => {
                write!(f, "used again: off by {:.3} pixels at most", f64::from(*milli_px) * 1e-3)
            }
            Reason::TooLarge { bytes, most } => write!(
                f,
                "T2 would take {bytes} bytes and this device has {most} for it: light is gathered \
                 at once, anew at every edit"
            ),
        }
    }
}

/// Whether the tensors are kept that let a material's edit do with `contract`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tensors {
    Kept,
    /// No material is edited.
    Needless,
    TooLarge {
        bytes: u64,
        most: u64,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    decisions: [Decision; Pass::ALL.len()],
    view_only: bool,
    changed: Option<&'static str>,
}

impl Plan {
    pub fn decision(&self, pass: Pass) -> Decision {
        self.decisions[pass as usize]
    }

    /// Of the light nothing changed but where it is seen from: receivers without a lobe keep what
    /// they have.
    pub fn view_only(&self) -> bool {
        self.view_only
    }

    /// What of the picture changed but for where it is seen from; none where nothing did.
    pub fn changed(&self) -> Option<&'static str> {
        self.changed
    }

    /// In which nothing runs.
    #[cfg(test)]
    pub fn of_nothing() -> Plan {
        Plan {
            decisions: [skip("nothing is there"); Pass::ALL.len()],
            view_only: false,
            changed: None,
        }
    }

    /// The same plan with another decision for `impostors`, which depends on more frames than the
    /// last.
    pub fn with_impostors(mut self, decision: Decision) -> Plan {
        self.decisions[Pass::Impostors as usize] = decision;
        self
    }

    pub fn runs(&self, pass: Pass) -> bool {
        self.decision(pass).run
    }
}

/// What of a scene the plan depends on, constant over a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Traits {
    /// Some particles come from boxes.
    pub has_boxes: bool,
    /// Some come from discs.
    pub has_discs: bool,
    pub n_particles: u32,
    pub n_facets: u32,
    /// `lighting.mode` is not "none".
    pub lit: bool,
    /// `lighting.mode` is "two-reflection".
    pub two_reflections: bool,
    /// Facets stand for several particles.
    pub grouped: bool,
    /// Some cloud has a texture.
    pub textured: bool,
    /// Surfaces to draw.
    pub n_surfaces: u32,
    /// And grounds.
    pub n_terrains: u32,
    /// Some region has a lobe, and so what is seen of it depends on the eye.
    pub glossy: bool,
    pub tensors: Tensors,
    /// What is far may be shown from a picture of it.
    pub impostors: bool,
    /// Particles that can show in no pixel are left out.
    pub culls: bool,
    /// What draws the particles.
    pub path: DrawPath,
    /// Blobs are drawn into a smaller picture.
    pub shrunk: bool,
    /// False with `--no-skip`: all that a frame is made of is done anew.
    pub skip: bool,
    /// Without `skip`: but not what no frame of a run can change, the particles of boxes and the
    /// pool of textures.
    pub keeps_made: bool,
    /// The particles of boxes and the pool of textures are there before the first frame.
    pub made: bool,
}

impl Traits {
    /// Of `scene`, in which nothing is "auto". `skip`: frames leave out what they do not need.
    pub fn of(scene: &Scene, tensors: Tensors, skip: bool) -> Traits {
        let traits = Traits {
            has_boxes: scene.clouds.iter().any(|c| matches!(c.source, CloudSource::Boxes { .. })),
            has_discs: lives(scene),
            n_particles: scene.n_particles() as u32,
            n_facets: scene.n_facets() as u32,
            lit: scene.lighting.mode != LightingMode::None,
            two_reflections: scene.lighting.mode == LightingMode::TwoReflection,
            grouped: is_grouped(scene),
            textured: scene.is_textured(),
            n_surfaces: scene.surfaces.len() as u32,
            n_terrains: scene.terrains.len() as u32,
            glossy: (0..scene.n_regions()).any(|i| is_glossy(scene, i)),
            tensors,
            impostors: scene.draw.impostors != Impostors::Off,
            shrunk: false,
            culls: false,
            path: DrawPath::Sprites,
            skip,
            keeps_made: false,
            made: false,
        };
        traits.drawn_by(scene)
    }

    /// The same where `scene`, in which nothing is "auto", is drawn as its `draw` says.
    pub fn drawn_by(self, scene: &Scene) -> Traits {
        Traits {
            culls: culls(scene),
            path: scene.draw.path,
            shrunk: scene.draw.resolution != Resolution::Full,
            ..self
        }
    }
}

/// Runs `f` under the pass's timer label where the plan has it run.
pub(super) fn pass(
    rec: &mut Recorder<'_>,
    plan: &Plan,
    pass: Pass,
    f: impl FnOnce(&mut Recorder<'_>) -> Result<()>,
) -> Result<()> {
    if plan.runs(pass) { rec.scope(pass.name(), f) } else { Ok(()) }
}

/// The plan for `next` after `last` (`None`: the first frame, nothing is there yet).
pub fn plan(traits: &Traits, last: Option<&Packet>, next: &Packet) -> Plan {
    let is_made = (last.is_some() || traits.made) && (traits.skip || traits.keeps_made);
    let last = last.filter(|_| traits.skip);
    let same = |f: &dyn Fn(&Packet, &Packet) -> bool| last.is_some_and(|l| f(l, next));
    let same_life = same(&|a, b| a.discs == b.discs && a.lived == b.lived);
    let still = same_life
        && same(&|a, b| {
            a.placed == b.placed
                && (b.placed.is_some() || (a.groups == b.groups && a.modes == b.modes))
        });
    let same_grid = still && same(&|a, b| a.grid == b.grid);
    let same_places = still && same(&|a, b| a.bounds == b.bounds);
    let same_geometry = same(&|a, b| {
        a.regions
            .iter()
            .map(RegionRecord::geometry)
            .eq(b.regions.iter().map(RegionRecord::geometry))
    });
    let same_facets = same_grid
        && same_geometry
        && same(&|a, b| a.groups == b.groups)
        && (same_places || !traits.grouped);
    let same_rays = same_facets && same(&|a, b| has_same_rays(a, b));
    // What has no lobe looks the same from everywhere.
    let same_eye = !traits.glossy || same(&|a, b| a.camera.eye == b.camera.eye);
    // A light that goes out leaves its tensors unread.
    let same_tensors = same_facets && same(&|a, b| shine_alike(&a.lights, &b.lights));
    let same_materials = same(&|a, b| {
        a.regions == b.regions && a.table == b.table && a.coefficients == b.coefficients
    });
    let same_light = same_facets && same_materials && same(&|a, b| a.lights == b.lights);
    // With tensors the first two reflections know neither energies nor materials.
    let kept = traits.tensors == Tensors::Kept;
    let same_response = if kept { same_tensors } else { same_light };
    let unchanged =
        if kept { "facets and lights stand still" } else { "facets and lights are the same" };
    let same_drawn = same(&|a, b| a.drawn == b.drawn);
    // How dense they are does not order them.
    let same_names = same(&|a, b| {
        a.drawn.iter().map(|d| (d.shift, d.end)).eq(b.drawn.iter().map(|d| (d.shift, d.end)))
    });
    let same_order = still
        && same_names
        && same(&|a, b| {
            a.camera.forward == b.camera.forward
                && (a.radius, a.sort_bits) == (b.radius, b.sort_bits)
        });
    let same_view = same(&|a, b| a.camera == b.camera);
    // What is kept depends on all of the camera, and on how dense particles are.
    let same_kept = same_order && same_drawn && same_view;
    let same_picture = same_order && same_drawn && same_view && (same_light || !traits.lit);

    let unless = |same: bool, reason| if same { skip(reason) } else { RUN };
    let lighting = |same: bool, reason| {
        if traits.lit { unless(same, reason) } else { skip("lighting.mode is \"none\"") }
    };
    let drawing = |path: DrawPath, other| match traits.path == path {
        true => unless(same_picture, "the picture is the same"),
        false => skip(other),
    };
    let mut decisions = [
        if traits.has_boxes {
            unless(is_made, "the boxes are the same")
        } else {
            skip("no boxes to fill")
        },
        if traits.has_discs { unless(same_life, "no time has passed") } else { skip("no discs") },
        unless(still, "nothing moved"),
        lighting(same_grid, "nothing moved"),
        if traits.grouped {
            unless(same_places, "nothing moved")
        } else {
            skip("a facet a particle")
        },
        lighting(same_facets, "nothing moved"),
        lighting(same_rays, "facets and lights stand still"),
        lighting(same_response && same_eye, unchanged),
        if traits.two_reflections {
            unless(same_response && same_eye, unchanged)
        } else {
            skip("lighting.mode is not \"two-reflection\"")
        },
        match traits.tensors {
            Tensors::Kept => lighting(same_light && same_eye, "light and materials are the same"),
            Tensors::Needless => skip("no material is edited: light is gathered at once"),
            Tensors::TooLarge { bytes, most } => {
                Decision { run: false, reason: Reason::TooLarge { bytes, most } }
            }
        },
        match traits.culls {
            true => unless(same_kept, "the same can be seen"),
            false if traits.impostors => skip("who is in a shell must not depend on the view"),
            false => skip("draw.cull is \"off\""),
        },
        match traits.culls {
            true => unless(same_kept, "the same can be seen"),
            false => unless(same_order, "the order cannot have changed"),
        },
        if traits.textured { unless(is_made, "the pool is the same") } else { skip("no textures") },
        if traits.n_surfaces > 0 {
            unless(same_picture, "the picture is the same")
        } else {
            skip("no surfaces")
        },
        if traits.n_terrains > 0 {
            unless(same_picture, "the picture is the same")
        } else {
            skip("no terrain")
        },
        match traits.impostors {
            false => skip("draw.impostors is \"off\""),
            true if !traits.skip => skip("nothing is used again with --no-skip"),
            true => unless(same_picture, "the picture is the same"),
        },
        drawing(DrawPath::Sprites, "draw.path is \"tiles\""),
        drawing(DrawPath::Tiles, "draw.path is \"sprites\""),
        if traits.shrunk {
            unless(same_picture, "the picture is the same")
        } else {
            skip("draw.resolution is 1")
        },
    ];
    if traits.n_particles == 0 {
        let of_particles = [
            Pass::Generate,
            Pass::Live,
            Pass::Place,
            Pass::Grid,
            Pass::Morton,
            Pass::Cull,
            Pass::Sort,
        ];
        for pass in of_particles.into_iter().chain([Pass::Texture, Pass::Impostors]) {
            decisions[pass as usize] = skip("no particles");
        }
    }
    if traits.n_facets == 0 {
        for pass in [Pass::Facets, Pass::Transmit, Pass::First, Pass::Second, Pass::Contract] {
            decisions[pass as usize] = skip("no facets");
        }
    }
    let changed = [
        (last.is_some(), "there is no frame before"),
        (still, "particles moved"),
        (same_drawn, "other particles are drawn"),
        (same_geometry, "surfaces moved"),
        ((same_light && same_eye) || !traits.lit, "light changed"),
    ];
    let changed = changed.into_iter().find(|(same, _)| !same).map(|(_, what)| what);
    Plan { decisions, view_only: same_response, changed }
}

/// Whether the ways from the facets to the lights, and what hides them, are the same; a light
/// without energy has none.
fn has_same_rays(a: &Packet, b: &Packet) -> bool {
    let way = |l: &LightRecord| (l.toward, l.position, l.kind, l.energy != [0.0; 3]);
    let rectangle = |r: &RegionRecord| (r.kind, r.center, r.u, r.v, r.normal, r.n_u, r.n_v);
    a.lights.iter().map(way).eq(b.lights.iter().map(way))
        && a.regions.iter().map(rectangle).eq(b.regions.iter().map(rectangle))
}

/// Whether `next` reaches facets as `last` did but for its lights' energies. A light without energy
/// may have left no tensor behind, so none may be lit anew.
fn shine_alike(last: &[LightRecord], next: &[LightRecord]) -> bool {
    let geometry = |l: &LightRecord| LightRecord { energy: [0.0; 3], ..*l };
    let dark = |l: &LightRecord| l.energy == [0.0; 3];
    last.iter().map(geometry).eq(next.iter().map(geometry))
        && last.iter().zip(next).all(|(a, b)| !dark(a) || dark(b))
}

const RUN: Decision = Decision { run: true, reason: Reason::Of("needed") };

pub(super) fn skip(reason: &'static str) -> Decision {
    Decision { run: false, reason: Reason::Of(reason) }
}

#[cfg(test)]
mod tests;
