//! What a frame can leave out: a pure function of the last packet and the next. Skipping never changes a pixel: a pass
//! is left out only where all that it reads is what it read the last time, to the bit.

use std::fmt;

use super::packet::Packet;
use crate::layout::facet::RegionRecord;
use crate::layout::frame::LightRecord;

/// The passes in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pass {
    Generate,
    Place,
    Grid,
    Facets,
    Transmit,
    First,
    Second,
    Contract,
    Sort,
    Sprites,
}

impl Pass {
    pub const ALL: [Pass; 10] = [
        Pass::Generate,
        Pass::Place,
        Pass::Grid,
        Pass::Facets,
        Pass::Transmit,
        Pass::First,
        Pass::Second,
        Pass::Contract,
        Pass::Sort,
        Pass::Sprites,
    ];

    /// The room's name: timer label and column in the results.
    pub fn name(self) -> &'static str {
        let names =
            ["generate", "place", "grid", "facets", "transmit", "first", "second", "contract", "sort", "sprites"];
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
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Of(text) => f.write_str(text),
            Reason::TooLarge { bytes, most } => write!(
                f,
                "T2 would take {bytes} bytes and this device has {most} for it: light is gathered at once, anew at every edit"
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
pub struct Plan([Decision; Pass::ALL.len()]);

impl Plan {
    pub fn decision(&self, pass: Pass) -> Decision {
        self.0[pass as usize]
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
    pub n_particles: u32,
    pub n_facets: u32,
    /// `lighting.mode` is not "none".
    pub lit: bool,
    /// `lighting.mode` is "two-reflection".
    pub two_reflections: bool,
    /// Some region has a lobe, and so what is seen of it depends on the eye.
    pub glossy: bool,
    pub tensors: Tensors,
    /// False with `--no-skip`: all that a frame is made of is done anew.
    pub skip: bool,
}

/// The plan for `next` after `last` (`None`: the first frame, nothing is there yet).
pub fn plan(traits: &Traits, last: Option<&Packet>, next: &Packet) -> Plan {
    let last = last.filter(|_| traits.skip);
    let same = |f: &dyn Fn(&Packet, &Packet) -> bool| last.is_some_and(|l| f(l, next));
    let still =
        same(&|a, b| a.placed == b.placed && (b.placed.is_some() || (a.groups == b.groups && a.modes == b.modes)));
    let same_grid = still && same(&|a, b| a.grid == b.grid);
    let same_geometry =
        same(&|a, b| a.regions.iter().map(RegionRecord::geometry).eq(b.regions.iter().map(RegionRecord::geometry)));
    let same_facets = same_grid && same_geometry && same(&|a, b| a.groups == b.groups);
    let same_rays =
        same_facets && same(&|a, b| a.lights.iter().map(|l| l.toward).eq(b.lights.iter().map(|l| l.toward)));
    let same_eye = !traits.glossy || same(&|a, b| a.camera.eye == b.camera.eye);
    let same_tensors = same_facets && same_eye && same(&|a, b| shine_alike(&a.lights, &b.lights));
    let same_materials = same(&|a, b| a.regions == b.regions && a.table == b.table && a.coefficients == b.coefficients);
    let same_light = same_facets && same_eye && same_materials && same(&|a, b| a.lights == b.lights);
    // With tensors the first two reflections know neither energies nor materials.
    let kept = traits.tensors == Tensors::Kept;
    let same_response = if kept { same_tensors } else { same_light };
    let unchanged = if kept { "facets and lights stand still" } else { "facets and lights are the same" };
    let same_order = still && same(&|a, b| a.camera.forward == b.camera.forward && a.radius == b.radius);
    let same_view = same(&|a, b| a.camera == b.camera);
    let same_picture = same_order && same_view && (same_light || !traits.lit);

    let unless = |same: bool, reason| if same { skip(reason) } else { RUN };
    let lighting =
        |same: bool, reason| if traits.lit { unless(same, reason) } else { skip("lighting.mode is \"none\"") };
    let mut decisions = [
        if traits.has_boxes { unless(last.is_some(), "the boxes are the same") } else { skip("no boxes to fill") },
        unless(still, "nothing moved"),
        lighting(same_grid, "nothing moved"),
        lighting(same_facets, "nothing moved"),
        lighting(same_rays, "facets and lights stand still"),
        lighting(same_response, unchanged),
        if traits.two_reflections {
            unless(same_response, unchanged)
        } else {
            skip("lighting.mode is not \"two-reflection\"")
        },
        match traits.tensors {
            Tensors::Kept => lighting(same_light, "light and materials are the same"),
            Tensors::Needless => skip("no material is edited: light is gathered at once"),
            Tensors::TooLarge { bytes, most } => Decision { run: false, reason: Reason::TooLarge { bytes, most } },
        },
        unless(same_order, "the order cannot have changed"),
        unless(same_picture, "the picture is the same"),
    ];
    if traits.n_particles == 0 {
        for pass in [Pass::Generate, Pass::Place, Pass::Grid, Pass::Sort] {
            decisions[pass as usize] = skip("no particles");
        }
    }
    if traits.n_facets == 0 {
        for pass in [Pass::Facets, Pass::Transmit, Pass::First, Pass::Second, Pass::Contract] {
            decisions[pass as usize] = skip("no facets");
        }
    }
    Plan(decisions)
}

/// Whether `next` reaches facets as `last` did but for its lights' energies. A light without energy may have left no
/// tensor behind, so none may be lit anew.
fn shine_alike(last: &[LightRecord], next: &[LightRecord]) -> bool {
    let geometry = |l: &LightRecord| LightRecord { energy: [0.0; 3], ..*l };
    let dark = |l: &LightRecord| l.energy == [0.0; 3];
    last.iter().map(geometry).eq(next.iter().map(geometry)) && last.iter().zip(next).all(|(a, b)| !dark(a) || dark(b))
}

const RUN: Decision = Decision { run: true, reason: Reason::Of("needed") };

fn skip(reason: &'static str) -> Decision {
    Decision { run: false, reason: Reason::Of(reason) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::frame::{CameraRecord, GridRecord};
    use crate::layout::particle::{GroupRecord, ModeRecord};
    use std::sync::Arc;
    use std::time::Instant;

    const TRAITS: Traits = Traits {
        has_boxes: true,
        n_particles: 7,
        n_facets: 9,
        lit: true,
        two_reflections: true,
        glossy: false,
        tensors: Tensors::Needless,
        skip: true,
    };
    const KEPT: Traits = Traits { tensors: Tensors::Kept, ..TRAITS };

    fn packet() -> Packet {
        Packet {
            i_frame: 0,
            time_s: 0.0,
            begin: Instant::now(),
            game_ms: 0.0,
            camera: CameraRecord { forward: [0.0, 0.0, -1.0], ..CameraRecord::default() },
            groups: vec![GroupRecord::default()],
            modes: vec![],
            placed: None,
            regions: vec![RegionRecord::default()],
            table: Arc::new(vec![0.5]),
            coefficients: vec![[0.5; 4]],
            lights: vec![LightRecord { energy: [1.0; 3], ..LightRecord::default() }],
            grid: GridRecord::default(),
            radius: 1.0,
        }
    }

    fn running(traits: &Traits, last: Option<&Packet>, next: &Packet) -> Vec<&'static str> {
        let plan = plan(traits, last, next);
        Pass::ALL.into_iter().filter(|p| plan.runs(*p)).map(Pass::name).collect()
    }

    #[test]
    fn the_first_frame_runs_everything_and_a_still_one_nothing() {
        let p = packet();
        assert_eq!(running(&KEPT, None, &p).len(), Pass::ALL.len());
        for traits in [TRAITS, KEPT] {
            assert!(running(&traits, Some(&p), &p).is_empty());
        }
        assert_eq!(running(&Traits { skip: false, ..KEPT }, Some(&p), &p).len(), Pass::ALL.len());
        // Without tensors it is all but `contract`.
        assert_eq!(running(&TRAITS, None, &p).len(), Pass::ALL.len() - 1);
    }

    #[test]
    fn each_change_runs_what_depends_on_it_and_no_more() {
        let last = packet();
        let after = |change: &dyn Fn(&mut Packet)| {
            let mut next = packet();
            change(&mut next);
            running(&TRAITS, Some(&last), &next)
        };
        assert_eq!(after(&|p| p.camera.eye[0] = 1.0), ["sprites"]);
        assert_eq!(after(&|p| p.camera.forward = [1.0, 0.0, 0.0]), ["sort", "sprites"]);
        assert_eq!(after(&|p| p.lights[0].energy[1] = 2.0), ["first", "second", "sprites"]);
        assert_eq!(after(&|p| p.lights[0].toward[1] = 1.0), ["transmit", "first", "second", "sprites"]);
        let all_but_generate = ["place", "grid", "facets", "transmit", "first", "second", "sort", "sprites"];
        assert_eq!(after(&|p| p.groups[0].offset[2] = 0.5), all_but_generate);
        let gust = |p: &mut Packet| p.modes.push(ModeRecord::default());
        assert_eq!(after(&gust), all_but_generate);
        assert_eq!(after(&|p| p.grid.cell = 0.5), ["grid", "facets", "transmit", "first", "second", "sprites"]);
    }

    #[test]
    fn with_tensors_an_edit_or_an_energy_is_a_contraction_and_nothing_else() {
        let last = packet();
        let after = |traits: &Traits, change: &dyn Fn(&mut Packet)| {
            let mut next = packet();
            change(&mut next);
            running(traits, Some(&last), &next)
        };
        let contracted = ["contract", "sprites"];
        let edits: [&dyn Fn(&mut Packet); 5] = [
            &|p| p.regions[0].kd[0] = 0.7,
            &|p| p.regions[0].ks[2] = 0.7,
            &|p| p.coefficients[0][1] = 0.7,
            &|p| p.lights[0].energy[1] = 2.0,
            &|p| p.lights[0].energy = [0.0; 3],
        ];
        for edit in edits {
            assert_eq!(after(&KEPT, edit), contracted);
        }
        let too_large = Traits { tensors: Tensors::TooLarge { bytes: 9, most: 8 }, ..TRAITS };
        for traits in [TRAITS, too_large] {
            assert_eq!(after(&traits, edits[0]), ["first", "second", "sprites"]);
        }
        assert_eq!(
            plan(&too_large, Some(&last), &last).decision(Pass::Contract).reason.to_string(),
            "T2 would take 9 bytes and this device has 8 for it: light is gathered at once, anew at every edit"
        );
        let anew = ["first", "second", "contract", "sprites"];
        assert_eq!(after(&KEPT, &|p| p.lights[0].radius = 2.0), anew);
        let facets_too = ["facets", "transmit", "first", "second", "contract", "sprites"];
        assert_eq!(after(&KEPT, &|p| p.regions[0].u[0] = 2.0), facets_too);
        // A light that was dark has left no tensor behind.
        let mut dark = packet();
        dark.lights[0].energy = [0.0; 3];
        assert_eq!(running(&KEPT, Some(&dark), &last), anew);
        // The eye matters to lobes alone.
        let eye = |p: &mut Packet| p.camera.eye[0] = 1.0;
        assert_eq!(after(&KEPT, &eye), ["sprites"]);
        assert_eq!(after(&Traits { glossy: true, ..KEPT }, &eye), anew);
    }

    #[test]
    fn unlit_empty_and_cpu_scenes_leave_out_what_they_do_not_need() {
        let p = packet();
        assert_eq!(
            running(&Traits { lit: false, two_reflections: false, ..KEPT }, None, &p),
            ["generate", "place", "sort", "sprites"]
        );
        let empty = Traits { n_particles: 0, n_facets: 0, ..KEPT };
        assert_eq!(running(&empty, None, &p), ["sprites"]);
        // Where the game thread places the particles, its places decide and not the groups' offsets.
        let (mut last, mut next) = (packet(), packet());
        (last.placed, next.placed) = (Some(vec![]), Some(vec![]));
        assert!(running(&TRAITS, Some(&last), &next).is_empty());
        next.placed = Some(vec![Default::default()]);
        assert!(running(&TRAITS, Some(&last), &next).contains(&"place"));
    }
}
