use super::*;
use crate::layout::frame::{CameraRecord, GridRecord};
use crate::layout::particle::{DrawnRecord, GroupRecord, ModeRecord};
use std::sync::Arc;
use std::time::Instant;

const TRAITS: Traits = Traits {
    has_boxes: true,
    has_discs: false,
    n_particles: 7,
    n_facets: 7,
    lit: true,
    two_reflections: false,
    grouped: false,
    textured: false,
    n_surfaces: 0,
    n_terrains: 0,
    glossy: false,
    tensors: Tensors::Needless,
    impostors: false,
    culls: false,
    path: DrawPath::Sprites,
    shrunk: false,
    skip: true,
    keeps_made: false,
    made: false,
};
const KEPT: Traits = Traits { two_reflections: true, tensors: Tensors::Kept, ..TRAITS };
/// With every pass.
const ALL_TRAITS: Traits = Traits {
    has_discs: true,
    grouped: true,
    textured: true,
    n_surfaces: 1,
    n_terrains: 1,
    impostors: true,
    culls: true,
    shrunk: true,
    ..KEPT
};

fn packet() -> Packet {
    Packet {
        i_frame: 0,
        time_s: 0.0,
        begin: Instant::now(),
        game_ms: 0.0,
        camera: CameraRecord { forward: [0.0, 0.0, -1.0], ..CameraRecord::default() },
        groups: vec![GroupRecord::default()],
        drawn: vec![DrawnRecord::default()],
        n_drawn: 0,
        modes: vec![],
        discs: vec![],
        lived: None,
        placed: None,
        bounds: vec![Default::default()],
        regions: vec![RegionRecord::default()],
        table: Arc::new(vec![0.5]),
        coefficients: vec![[0.5; 4]],
        lights: vec![LightRecord { energy: [0.0, 1.0, 0.0], ..LightRecord::default() }],
        grid: GridRecord::default(),
        heaviest: 1.0,
        radius: 1.0,
        sort_bits: 32,
        extents: vec![],
    }
}

fn running(traits: &Traits, last: Option<&Packet>, next: &Packet) -> Vec<&'static str> {
    let plan = plan(traits, last, next);
    Pass::ALL.into_iter().filter(|p| plan.runs(*p)).map(Pass::name).collect()
}

#[test]
fn the_first_frame_runs_everything_and_a_still_one_nothing() {
    let p = packet();
    // Particles are drawn by one of two passes.
    let all = Pass::ALL.len() - 1;
    assert_eq!(running(&ALL_TRAITS, None, &p).len(), all);
    for traits in [TRAITS, KEPT, ALL_TRAITS] {
        assert!(running(&traits, Some(&p), &p).is_empty());
    }
    // Where nothing is skipped no picture is used again.
    assert_eq!(running(&Traits { skip: false, ..ALL_TRAITS }, Some(&p), &p).len(), all - 1);
    // What a run makes once is kept; all else is done as without skipping.
    let moving = Traits { skip: false, keeps_made: true, ..ALL_TRAITS };
    let (whole, kept) = (
        running(&Traits { skip: false, ..ALL_TRAITS }, Some(&p), &p),
        running(&moving, Some(&p), &p),
    );
    assert!(
        whole.iter().filter(|pass| !kept.contains(pass)).eq(["generate", "texture"].iter()),
        "{kept:?}"
    );
    assert_eq!(
        running(&moving, None, &p),
        running(&Traits { skip: false, ..ALL_TRAITS }, None, &p)
    );
    // What lies there from before the first frame is not made again, but where nothing is skipped.
    let there = Traits { made: true, ..ALL_TRAITS };
    let first = running(&there, None, &p);
    assert_eq!(first.len(), all - 2);
    assert!(!first.contains(&"generate") && !first.contains(&"texture"));
    assert!(running(&Traits { skip: false, ..there }, None, &p).contains(&"generate"));
    // Without tensors it is all but `contract`.
    let without = Traits { tensors: Tensors::Needless, ..ALL_TRAITS };
    assert_eq!(running(&without, None, &p).len(), all - 1);
    let tiled = Traits { path: DrawPath::Tiles, ..TRAITS };
    assert_eq!(running(&tiled, None, &p).last(), Some(&"tiles"));
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
    assert_eq!(after(&|p| p.drawn[0].end = 5), ["sort", "sprites"]);
    assert_eq!(after(&|p| p.lights[0].energy[1] = 2.0), ["first", "sprites"]);
    assert_eq!(after(&|p| p.regions[0].kd[1] = 0.5), ["first", "sprites"]);
    let of_rays: [&dyn Fn(&mut Packet); 3] =
        [&|p| p.lights[0].toward[1] = 1.0, &|p| p.lights[0].position[1] = 1.0, &|p| {
            p.lights[0].energy = [0.0; 3]
        }];
    for change in of_rays {
        assert_eq!(after(change), ["transmit", "first", "sprites"]);
    }
    let of_facets: [&dyn Fn(&mut Packet); 2] =
        [&|p| p.regions[0].center[0] = 1.0, &|p| p.regions[0].u[2] = 1.0];
    for change in of_facets {
        assert_eq!(after(change), ["facets", "transmit", "first", "sprites"]);
    }
    let all_but_generate = ["place", "grid", "facets", "transmit", "first", "sort", "sprites"];
    assert_eq!(after(&|p| p.groups[0].offset[2] = 0.5), all_but_generate);
    let gust = |p: &mut Packet| p.modes.push(ModeRecord::default());
    assert_eq!(after(&gust), all_but_generate);
    assert_eq!(after(&|p| p.grid.cell = 0.5), ["grid", "facets", "transmit", "first", "sprites"]);
}

#[test]
fn what_is_kept_is_kept_and_sorted_anew_where_the_camera_or_a_density_changes() {
    let last = packet();
    let culls = Traits { culls: true, ..TRAITS };
    let after = |change: &dyn Fn(&mut Packet)| {
        let mut next = packet();
        change(&mut next);
        running(&culls, Some(&last), &next)
    };
    assert!(after(&|_| {}).is_empty());
    let changes: [&dyn Fn(&mut Packet); 4] =
        [&|p| p.camera.eye[0] = 1.0, &|p| p.camera.tan_x = 2.0, &|p| p.drawn[0].end = 5, &|p| {
            p.drawn[0].kappa_scale = 0.5
        }];
    for change in changes {
        assert_eq!(after(change), ["cull", "sort", "sprites"]);
    }
    assert_eq!(after(&|p| p.lights[0].energy[1] = 2.0), ["first", "sprites"]);
    assert_eq!(running(&Traits { n_particles: 0, n_facets: 0, ..culls }, None, &last), ["sprites"]);
    let reason = plan(&TRAITS, None, &last).decision(Pass::Cull).reason.to_string();
    assert_eq!(reason, "draw.cull is \"off\"");
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
    let edits: [&dyn Fn(&mut Packet); 4] = [
        &|p| p.regions[0].kd[0] = 0.7,
        &|p| p.regions[0].ks[2] = 0.7,
        &|p| p.coefficients[0][1] = 0.7,
        &|p| p.lights[0].energy[1] = 2.0,
    ];
    for edit in edits {
        assert_eq!(after(&KEPT, edit), contracted);
    }
    assert_eq!(
        after(&KEPT, &|p| p.lights[0].energy = [0.0; 3]),
        ["transmit", "contract", "sprites"]
    );
    let both = Traits { tensors: Tensors::Needless, ..KEPT };
    let too_large = Traits { tensors: Tensors::TooLarge { bytes: 9, most: 8 }, ..KEPT };
    for traits in [both, too_large] {
        assert_eq!(after(&traits, edits[0]), ["first", "second", "sprites"]);
    }
    assert_eq!(
        plan(&too_large, Some(&last), &last).decision(Pass::Contract).reason.to_string(),
        "T2 would take 9 bytes and this device has 8 for it: light is gathered at once, anew \
         at every edit"
    );
    let anew = ["first", "second", "contract", "sprites"];
    assert_eq!(after(&KEPT, &|p| p.lights[0].radius = 2.0), anew);
    let facets_too = ["facets", "transmit", "first", "second", "contract", "sprites"];
    assert_eq!(after(&KEPT, &|p| p.regions[0].u[0] = 2.0), facets_too);
    // A light that was dark has left no tensor behind.
    let mut dark = packet();
    dark.lights[0].energy = [0.0; 3];
    assert_eq!(running(&KEPT, Some(&dark), &last), [&["transmit"], &anew[..]].concat());
    // The eye matters to lobes alone.
    let eye = |p: &mut Packet| p.camera.eye[0] = 1.0;
    assert_eq!(after(&KEPT, &eye), ["sprites"]);
    assert_eq!(after(&Traits { glossy: true, ..KEPT }, &eye), anew);
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
    let all_but_generate =
        ["place", "grid", "morton", "facets", "transmit", "first", "sort", "sprites"];
    assert_eq!(after(&|p| p.groups[0].offset[2] = 0.5), all_but_generate);
    assert_eq!(
        after(&|p| p.bounds[0].low[0] = 0.5),
        ["morton", "facets", "transmit", "first", "sprites"]
    );
    assert_eq!(after(&|p| p.camera.eye[0] = 1.0), ["sprites"]);
}

#[test]
fn unlit_empty_and_cpu_scenes_leave_out_what_they_do_not_need() {
    let p = packet();
    assert_eq!(
        running(&Traits { lit: false, ..TRAITS }, None, &p),
        ["generate", "place", "sort", "sprites"]
    );
    assert_eq!(running(&Traits { n_particles: 0, n_facets: 0, ..TRAITS }, None, &p), ["sprites"]);
    // Where the game thread places the particles, its places decide and not the groups' offsets.
    let (mut last, mut next) = (packet(), packet());
    (last.placed, next.placed) = (Some(vec![]), Some(vec![]));
    assert!(running(&TRAITS, Some(&last), &next).is_empty());
    next.placed = Some(vec![Default::default()]);
    assert!(running(&TRAITS, Some(&last), &next).contains(&"place"));
}
