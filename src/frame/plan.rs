//! What a frame can leave out: a pure function of the last packet and the next. Skipping never changes a pixel: a pass
//! is left out only where all that it reads is what it read the last time, to the bit.

use super::packet::Packet;
use crate::layout::facet::RegionRecord;
use crate::layout::frame::LightRecord;

/// The passes in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pass {
    Generate,
    Place,
    Grid,
    Morton,
    Facets,
    Transmit,
    First,
    Second,
    Sort,
    Surfaces,
    Sprites,
}

impl Pass {
    pub const ALL: [Pass; 11] = [
        Pass::Generate,
        Pass::Place,
        Pass::Grid,
        Pass::Morton,
        Pass::Facets,
        Pass::Transmit,
        Pass::First,
        Pass::Second,
        Pass::Sort,
        Pass::Surfaces,
        Pass::Sprites,
    ];

    /// The room's name: timer label and column in the results.
    pub fn name(self) -> &'static str {
        ["generate", "place", "grid", "morton", "facets", "transmit", "first", "second", "sort", "surfaces", "sprites"]
            [self as usize]
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decision {
    pub run: bool,
    pub reason: &'static str,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    decisions: [Decision; Pass::ALL.len()],
    view_only: bool,
}

impl Plan {
    pub fn decision(&self, pass: Pass) -> Decision {
        self.decisions[pass as usize]
    }

    /// Of the light nothing changed but where it is seen from: receivers without a lobe keep what they have.
    pub fn view_only(&self) -> bool {
        self.view_only
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
    /// Facets stand for several particles.
    pub grouped: bool,
    /// Some facets have a lobe, and look different from elsewhere.
    pub glossy: bool,
    /// Surfaces to draw.
    pub n_surfaces: u32,
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
    let same_places = still && same(&|a, b| a.bounds == b.bounds);
    let same_facets = same_grid && same(&|a, b| a.groups == b.groups) && (same_places || !traits.grouped);
    let same_rays = same_facets && same(&|a, b| has_same_rays(a, b));
    let same_light = same_facets && same(&|a, b| a.lights == b.lights && a.regions == b.regions);
    let same_order = still && same(&|a, b| a.camera.forward == b.camera.forward && a.radius == b.radius);
    let same_view = same(&|a, b| a.camera == b.camera);
    // What has no lobe looks the same from everywhere.
    let same_shine = same_light && (!traits.glossy || same(&|a, b| a.camera.eye == b.camera.eye));
    let same_picture = same_order && same_view && (same_light || !traits.lit);

    let unless = |same: bool, reason| if same { skip(reason) } else { RUN };
    let lighting =
        |same: bool, reason| if traits.lit { unless(same, reason) } else { skip("lighting.mode is \"none\"") };
    let mut decisions = [
        if traits.has_boxes { unless(last.is_some(), "the boxes are the same") } else { skip("no boxes to fill") },
        unless(still, "nothing moved"),
        lighting(same_grid, "nothing moved"),
        if traits.grouped { unless(same_places, "nothing moved") } else { skip("a facet a particle") },
        lighting(same_facets, "nothing moved"),
        lighting(same_rays, "facets and lights stand still"),
        lighting(same_shine, "facets and lights are the same"),
        if traits.two_reflections {
            unless(same_shine, "facets and lights are the same")
        } else {
            skip("lighting.mode is not \"two-reflection\"")
        },
        unless(same_order, "the order cannot have changed"),
        if traits.n_surfaces > 0 { unless(same_picture, "the picture is the same") } else { skip("no surfaces") },
        unless(same_picture, "the picture is the same"),
    ];
    if traits.n_particles == 0 {
        for pass in [Pass::Generate, Pass::Place, Pass::Grid, Pass::Morton, Pass::Sort] {
            decisions[pass as usize] = skip("no particles");
        }
    }
    if traits.n_facets == 0 {
        for pass in [Pass::Facets, Pass::Transmit, Pass::First, Pass::Second] {
            decisions[pass as usize] = skip("no facets");
        }
    }
    Plan { decisions, view_only: same_light }
}

/// Whether the ways from the facets to the lights, and what hides them, are the same; a light without energy has none.
fn has_same_rays(a: &Packet, b: &Packet) -> bool {
    let way = |l: &LightRecord| (l.toward, l.position, l.kind, l.energy != [0.0; 3]);
    let rectangle = |r: &RegionRecord| (r.kind, r.center, r.u, r.v, r.normal, r.n_u, r.n_v);
    a.lights.iter().map(way).eq(b.lights.iter().map(way))
        && a.regions.iter().map(rectangle).eq(b.regions.iter().map(rectangle))
}

const RUN: Decision = Decision { run: true, reason: "needed" };

fn skip(reason: &'static str) -> Decision {
    Decision { run: false, reason }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::frame::{CameraRecord, GridRecord};
    use crate::layout::particle::{GroupRecord, ModeRecord};
    use std::time::Instant;

    const TRAITS: Traits = Traits {
        has_boxes: true,
        n_particles: 7,
        n_facets: 7,
        lit: true,
        two_reflections: false,
        grouped: false,
        glossy: false,
        n_surfaces: 1,
        skip: true,
    };
    /// With every pass.
    const ALL_TRAITS: Traits = Traits { two_reflections: true, grouped: true, ..TRAITS };

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
            bounds: vec![Default::default()],
            table: Default::default(),
            regions: vec![RegionRecord::default()],
            lights: vec![LightRecord { energy: [0.0, 1.0, 0.0], ..LightRecord::default() }],
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
        assert_eq!(running(&ALL_TRAITS, None, &p).len(), Pass::ALL.len());
        assert!(running(&ALL_TRAITS, Some(&p), &p).is_empty());
        assert_eq!(running(&Traits { skip: false, ..ALL_TRAITS }, Some(&p), &p).len(), Pass::ALL.len());
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
        assert_eq!(after(&|p| p.lights[0].energy[1] = 2.0), ["first", "sprites"]);
        assert_eq!(after(&|p| p.regions[0].kd[1] = 0.5), ["first", "sprites"]);
        let of_rays: [&dyn Fn(&mut Packet); 5] = [
            &|p| p.lights[0].toward[1] = 1.0,
            &|p| p.lights[0].position[1] = 1.0,
            &|p| p.lights[0].energy = [0.0; 3],
            &|p| p.regions[0].center[0] = 1.0,
            &|p| p.regions[0].u[2] = 1.0,
        ];
        for change in of_rays {
            assert_eq!(after(change), ["transmit", "first", "sprites"]);
        }
        let all_but_generate = ["place", "grid", "facets", "transmit", "first", "sort", "sprites"];
        assert_eq!(after(&|p| p.groups[0].offset[2] = 0.5), all_but_generate);
        let gust = |p: &mut Packet| p.modes.push(ModeRecord::default());
        assert_eq!(after(&gust), ["place", "grid", "facets", "transmit", "first", "sort", "sprites"]);
        assert_eq!(after(&|p| p.grid.cell = 0.5), ["grid", "facets", "transmit", "first", "sprites"]);
    }

    #[test]
    fn facets_of_several_particles_follow_their_order() {
        let last = packet();
        let grouped = Traits { grouped: true, ..TRAITS };
        let after = |change: &dyn Fn(&mut Packet)| {
            let mut next = packet();
            change(&mut next);
            running(&grouped, Some(&last), &next)
        };
        let all_but_generate = ["place", "grid", "morton", "facets", "transmit", "first", "sort", "sprites"];
        assert_eq!(after(&|p| p.groups[0].offset[2] = 0.5), all_but_generate);
        assert_eq!(after(&|p| p.bounds[0].low[0] = 0.5), ["morton", "facets", "transmit", "first", "sprites"]);
        assert_eq!(after(&|p| p.camera.eye[0] = 1.0), ["sprites"]);
    }

    #[test]
    fn unlit_empty_and_cpu_scenes_leave_out_what_they_do_not_need() {
        let p = packet();
        assert_eq!(running(&Traits { lit: false, ..TRAITS }, None, &p), ["generate", "place", "sort", "sprites"]);
        assert_eq!(running(&Traits { n_particles: 0, n_facets: 0, ..TRAITS }, None, &p), ["sprites"]);
        // Where the game thread places the particles, its places decide and not the groups' offsets.
        let (mut last, mut next) = (packet(), packet());
        (last.placed, next.placed) = (Some(vec![]), Some(vec![]));
        assert!(running(&TRAITS, Some(&last), &next).is_empty());
        next.placed = Some(vec![Default::default()]);
        assert!(running(&TRAITS, Some(&last), &next).contains(&"place"));
    }
}
