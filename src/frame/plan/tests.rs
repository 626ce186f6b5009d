use super::Plan;
use super::{Pass, Skipping};
use crate::frame::features::{SceneFeatures, Tensors};
use crate::frame::packet::Packet;
use crate::layout::facet::RegionRecord;
use crate::layout::frame::{CameraRecord, GridRecord, LightRecord};
use crate::layout::medium::MediumRecord;
use crate::layout::particle::{DrawnRecord, GroupRecord, ModeRecord};
use crate::model::scene::DrawPath;
use std::sync::Arc;
use std::time::Instant;

const FEATURES: SceneFeatures = SceneFeatures {
    is_medium: false,
    has_diffusion: false,
    has_boxes: true,
    has_live: false,
    n_particles: 7,
    n_facets: 7,
    is_lit: true,
    has_second: false,
    is_grouped: false,
    is_textured: false,
    has_harmonics: false,
    has_haze: false,
    has_lod: false,
    n_surfaces: 0,
    n_terrains: 0,
    has_relief: false,
    has_lamps: false,
    is_glossy: false,
    tensors: Tensors::Needless,
    has_impostors: false,
    culls: false,
    path: DrawPath::Sprites,
    is_low_res: false,
    is_sliced: false,
};
const KEPT: SceneFeatures = SceneFeatures { has_second: true, tensors: Tensors::Kept, ..FEATURES };
/// The features of a scene that needs every pass.
const ALL_FEATURES: SceneFeatures = SceneFeatures {
    has_live: true,
    is_grouped: true,
    is_textured: true,
    has_harmonics: true,
    has_haze: true,
    has_lod: true,
    n_surfaces: 1,
    n_terrains: 1,
    has_relief: true,
    has_impostors: true,
    culls: true,
    is_low_res: true,
    ..KEPT
};
const ON: Skipping = Skipping { is_on: true, keeps_made: false, is_made: false };
const OFF: Skipping = Skipping { is_on: false, ..ON };

fn packet() -> Packet {
    Packet {
        media: vec![],
        diffusion: None,
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
        live: None,
        sky: None,
        placed: None,
        bounds: vec![Default::default()],
        regions: vec![RegionRecord::default()],
        table: Arc::new(vec![0.5]),
        coefficients: vec![[0.5; 4]],
        lights: vec![LightRecord { energy: [0.0, 1.0, 0.0], ..LightRecord::default() }],
        grid: GridRecord::default(),
        heaviest: 1.0,
        sigma_max: 1.0,
        n_levels: 1,
        n_blurs: 0,
        radius: 1.0,
        sort_bits: 32,
        slice: 1.0,
        extents: vec![],
    }
}

fn plan(features: &SceneFeatures, last: Option<&Packet>, next: &Packet) -> Plan {
    super::plan(features, ON, last, next)
}

fn running_with(
    skipping: Skipping,
    features: &SceneFeatures,
    last: Option<&Packet>,
    next: &Packet,
) -> Vec<&'static str> {
    let plan = super::plan(features, skipping, last, next);
    Pass::ALL.into_iter().filter(|p| plan.runs(*p)).map(Pass::name).collect()
}

fn running(features: &SceneFeatures, last: Option<&Packet>, next: &Packet) -> Vec<&'static str> {
    running_with(ON, features, last, next)
}

#[test]
fn the_first_frame_runs_everything_and_a_still_one_nothing() {
    let p = packet();
    // Particles are drawn by one of two passes, and two more are for clouds as a medium.
    let all = Pass::ALL.len() - 3;
    assert_eq!(running(&ALL_FEATURES, None, &p).len(), all);
    for features in [FEATURES, KEPT, ALL_FEATURES] {
        assert!(running(&features, Some(&p), &p).is_empty());
    }
    // With skipping off, impostor layers are not used.
    let whole = running_with(OFF, &ALL_FEATURES, Some(&p), &p);
    assert_eq!(whole.len(), all - 1);
    let reason = super::plan(&ALL_FEATURES, OFF, None, &p).decision(Pass::Impostors).reason;
    assert_eq!(reason.to_string(), "nothing is used again with --no-skip");
    // Particles of boxes and the pool of textures may be kept.
    let moving = Skipping { keeps_made: true, ..OFF };
    let kept = running_with(moving, &ALL_FEATURES, Some(&p), &p);
    let left_out = whole.iter().filter(|pass| !kept.contains(pass));
    assert!(left_out.eq(["generate", "texture"].iter()), "{kept:?}");
    assert_eq!(
        running_with(moving, &ALL_FEATURES, None, &p),
        running_with(OFF, &ALL_FEATURES, None, &p)
    );
    // Particles and textures that exist before the first frame are made again only with skipping
    // off.
    let first = running_with(Skipping { is_made: true, ..ON }, &ALL_FEATURES, None, &p);
    assert_eq!(first.len(), all - 2);
    assert!(!first.contains(&"generate") && !first.contains(&"texture"));
    let made_off = Skipping { is_made: true, ..OFF };
    assert!(running_with(made_off, &ALL_FEATURES, None, &p).contains(&"generate"));
    // Without tensors, only `contract` does not run.
    let without = SceneFeatures { tensors: Tensors::Needless, ..ALL_FEATURES };
    assert_eq!(running(&without, None, &p).len(), all - 1);
    let tiled = SceneFeatures { path: DrawPath::Tiles, ..FEATURES };
    assert_eq!(running(&tiled, None, &p).last(), Some(&"tiles"));
}

#[test]
fn each_change_runs_what_depends_on_it_and_no_more() {
    let last = packet();
    let after = |change: &dyn Fn(&mut Packet)| {
        let mut next = packet();
        change(&mut next);
        running(&FEATURES, Some(&last), &next)
    };
    assert_eq!(after(&|p| p.camera.eye[0] = 1.0), ["sprites"]);
    assert_eq!(after(&|p| p.camera.forward = [1.0, 0.0, 0.0]), ["sort", "sprites"]);
    // Slices are shells about the eye.
    let sliced = SceneFeatures { path: DrawPath::Tiles, is_sliced: true, ..FEATURES };
    let [mut moved, mut turned] = [packet(), packet()];
    moved.camera.eye[0] = 1.0;
    turned.camera.forward = [1.0, 0.0, 0.0];
    assert_eq!(running(&sliced, Some(&last), &moved), ["sort", "tiles"]);
    assert_eq!(running(&sliced, Some(&last), &turned), ["tiles"]);
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
fn a_change_of_camera_or_density_culls_and_sorts_again() {
    let last = packet();
    let culls = SceneFeatures { culls: true, ..FEATURES };
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
    assert_eq!(
        running(&SceneFeatures { n_particles: 0, n_facets: 0, ..culls }, None, &last),
        ["sprites"]
    );
    let reason = plan(&FEATURES, None, &last).decision(Pass::Cull).reason.to_string();
    assert_eq!(reason, "draw.cull is \"off\"");
}

#[test]
fn with_tensors_an_edit_or_an_energy_runs_contract_alone() {
    let last = packet();
    let after = |features: &SceneFeatures, change: &dyn Fn(&mut Packet)| {
        let mut next = packet();
        change(&mut next);
        running(features, Some(&last), &next)
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
    let both = SceneFeatures { tensors: Tensors::Needless, ..KEPT };
    let too_large = SceneFeatures { tensors: Tensors::TooLarge { bytes: 9, most: 8 }, ..KEPT };
    for features in [both, too_large] {
        assert_eq!(after(&features, edits[0]), ["first", "second", "sprites"]);
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
    // A dark light has left no tensor behind.
    let mut dark = packet();
    dark.lights[0].energy = [0.0; 3];
    assert_eq!(running(&KEPT, Some(&dark), &last), [&["transmit"], &anew[..]].concat());
    // Only lobes depend on the eye.
    let eye = |p: &mut Packet| p.camera.eye[0] = 1.0;
    assert_eq!(after(&KEPT, &eye), ["sprites"]);
    assert_eq!(after(&SceneFeatures { is_glossy: true, ..KEPT }, &eye), anew);
}

#[test]
fn facets_of_several_particles_depend_on_the_morton_order() {
    let last = packet();
    let grouped = SceneFeatures { is_grouped: true, ..FEATURES };
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
fn unlit_empty_and_cpu_scenes_skip_passes_that_they_do_not_need() {
    let p = packet();
    assert_eq!(
        running(&SceneFeatures { is_lit: false, ..FEATURES }, None, &p),
        ["generate", "place", "sort", "sprites"]
    );
    assert_eq!(
        running(&SceneFeatures { n_particles: 0, n_facets: 0, ..FEATURES }, None, &p),
        ["sprites"]
    );
    // If the game thread places the particles, their places count instead of the groups' offsets.
    let (mut last, mut next) = (packet(), packet());
    (last.placed, next.placed) = (Some(vec![]), Some(vec![]));
    assert!(running(&FEATURES, Some(&last), &next).is_empty());
    next.placed = Some(vec![Default::default()]);
    assert!(running(&FEATURES, Some(&last), &next).contains(&"place"));
}

#[test]
fn a_medium_runs_what_its_light_depends_on() {
    let p = packet();
    let features = SceneFeatures { is_medium: true, has_diffusion: true, ..FEATURES };
    let after = |change: fn(&mut Packet)| {
        let mut next = p.clone();
        change(&mut next);
        running(&features, Some(&p), &next)
    };
    let lit = ["diffusion", "scatter", "sprites"];
    assert_eq!(after(|p| p.lights[0].energy[1] = 2.0), lit);
    assert_eq!(after(|p| p.media.push(MediumRecord::default())), lit);
    let marched = ["transmit", "diffusion", "scatter", "sprites"];
    assert_eq!(after(|p| p.lights[0].toward[1] = 0.5), marched);
    // Without diffusion the same passes but one.
    let once = SceneFeatures { has_diffusion: false, ..features };
    let mut next = p.clone();
    next.lights[0].energy[1] = 2.0;
    assert_eq!(running(&once, Some(&p), &next), ["scatter", "sprites"]);
    // The material of ground changes what it sends into clouds.
    let over_ground = SceneFeatures { n_terrains: 1, ..features };
    let repainted = |features: &SceneFeatures| {
        let mut next = p.clone();
        next.regions[0].kd = [0.1; 3];
        let all = running(features, Some(&p), &next);
        ["diffusion", "scatter"].map(|pass| all.contains(&pass))
    };
    assert_eq!([&over_ground, &features].map(repainted), [[true, true], [false, true]]);
}

#[test]
fn shadows_of_ground_follow_lights_and_not_clouds() {
    let hills = SceneFeatures { n_terrains: 1, has_relief: true, ..FEATURES };
    let last = packet();
    let runs = |features: &SceneFeatures, change: &dyn Fn(&mut Packet)| {
        let mut next = packet();
        change(&mut next);
        running(features, Some(&last), &next).contains(&"relief")
    };
    assert!(runs(&hills, &|p| p.lights[0].toward[1] = 0.5));
    assert!(runs(&hills, &|p| p.lights[0].energy = [0.0; 3]));
    assert!(runs(&hills, &|p| p.lights[0].kind = 2));
    // Clouds that move take the lighting origin along.
    let moved = |p: &mut Packet| {
        p.groups[0].offset[2] = 0.5;
        p.regions[0].center[0] = 1.0;
        p.lights[0].position[0] = 1.0;
    };
    assert!(!runs(&hills, &moved) && !runs(&hills, &|p| p.lights[0].energy[1] = 2.0));
    assert!(runs(&SceneFeatures { has_lamps: true, ..hills }, &moved));
    assert!(runs(&SceneFeatures { n_terrains: 2, ..hills }, &moved));
}
