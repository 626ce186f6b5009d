//! `Player::reshape`: after a change of boxes a player holds and draws what a new one does, and
//! generates only the particles that have changed.

#[path = "harness/bounded.rs"]
mod bounded;

use std::path::Path;
use std::sync::Arc;

use bounded::Random;
use glam::DVec3;
use nimbus::error::Error;
use nimbus::frame::Reshaped;
use nimbus::frame::n_cells;
use nimbus::frame::plan::Pass;
use nimbus::frame::serial;
use nimbus::frame::{DeviceChoice, GpuContext, Player};
use nimbus::io::scene_file;
use nimbus::layout::particle::ParticleRecord;
use nimbus::model::boxes::CloudBox;
use nimbus::model::cloud::CloudSource;
use nimbus::model::scene::Scene;
use nimbus::viewer::editor::Document;

/// Returns a scene of two clouds. The first one is edited.
fn scene(more: &str, of_cloud: &str) -> Scene {
    let text = format!(
        "[film]\nwidth = 40\nheight = 30\nformat = 'rgba32f'\n[camera]\nposition = [0, 0, \
         18]\ntarget = [0, 0, 0]\n\
         [draw]\nparticles = 150\n{more}\n[[light]]\nkind = 'directional'\ndirection = [-0.5, \
         -0.8, -0.3]\n\
         irradiance = [3, 3, 3]\n[[cloud]]\nfrom = 'boxes'\nfile = 'cubes-554.dat'\n{of_cloud}\n\
         [[cloud]]\nfrom = 'boxes'\nfile = 'cubes-615.dat'\nposition = [0, 5, -3]\nseed = 4\n"
    );
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/reshaped.toml");
    scene_file::parse(text, &path, &[], None).expect("the scene loads").scene
}

fn document(scene: &Scene) -> Document {
    let CloudSource::Boxes { boxes, .. } = &scene.clouds[0].source else {
        unreachable!("a cloud of boxes")
    };
    Document { boxes: boxes.clone(), seed: scene.clouds[0].seed }
}

fn with(scene: &Scene, document: &Document) -> Arc<Scene> {
    let mut scene = scene.clone();
    let CloudSource::Boxes { boxes, .. } = &mut scene.clouds[0].source else {
        unreachable!("a cloud of boxes")
    };
    *boxes = document.boxes.clone();
    scene.clouds[0].seed = document.seed;
    scene.into()
}

fn bed() -> GpuContext {
    GpuContext::open(&DeviceChoice { validation: true, ..DeviceChoice::default() })
        .expect("a device")
}

/// Particles and picture of a player.
#[derive(Debug, PartialEq)]
struct Contents {
    particles: Vec<ParticleRecord>,
    status: Vec<u32>,
    picture: Vec<u8>,
}

/// Draws a frame. Returns the contents, and whether particles were generated.
fn contents(bed: &GpuContext, player: &mut Player) -> (Contents, bool) {
    let mut generates = false;
    serial::run(&mut player.game, &mut player.renderer, 0..1, &mut |times, _| {
        generates = times.plan.runs(Pass::Generate);
        Ok(true)
    })
    .expect("a frame");
    let particles = player.renderer.particles(&bed.device).expect("particles");
    let status = player.renderer.status(&bed.device).expect("statuses");
    let picture = player.renderer.image_bytes().expect("pixels");
    (Contents { particles, status, picture }, generates)
}

fn fresh(bed: &GpuContext, scene: &Arc<Scene>) -> Contents {
    contents(bed, &mut bed.player(scene.clone(), true).expect("a player")).0
}

/// Applies an edit of one kind. Returns whether every box keeps its number of particles.
fn edit(document: &mut Document, kind: usize, random: &mut Random) -> bool {
    let n = document.boxes.len();
    let i = (random.word() % n as u64) as usize;
    let mut within = |low: f64, high: f64| f64::from(random.within(low, high));
    let b = &mut document.boxes[i];
    match kind {
        0 => b.center += DVec3::new(within(-3.0, 3.0), within(-2.0, 2.0), within(-1.0, 1.0)),
        1 => b.extent *= DVec3::new(within(0.3, 2.0), within(0.3, 2.0), within(0.3, 2.0)),
        2 => b.radius_max *= within(0.5, 1.5),
        3 => document.seed += 1,
        // A distant box changes the proportions of the density grid.
        4 => b.center.x += 30.0,
        5 => b.center.x -= 30.0,
        6 => b.n_particles = (b.n_particles + 3) % 17,
        7 => {
            let added = CloudBox { center: DVec3::new(within(-5.0, 5.0), 1.0, 0.0), ..*b };
            document.boxes.push(added);
        }
        _ => drop(document.boxes.remove(i)),
    }
    kind < 6
}

const N_KINDS: usize = 9;

#[test]
fn after_any_edits_a_player_equals_a_new_one() {
    let cases = [
        ("[lighting]\nmode = 'first'\ngrid = 12", "texture = 'by-box'"),
        (
            "path = 'sprites'\n[lighting]\nmode = 'two-reflection'\ngrid = \
             12\nfacets_per_cloud = 20",
            "gust = 0.3",
        ),
        ("[lighting]\nmode = 'none'\n[threads]\nsimulate = 'cpu'", "form = 'printed'"),
    ];
    let bed = bed();
    for (i_case, (more, of_cloud)) in cases.into_iter().enumerate() {
        let base = scene(more, of_cloud);
        let mut document = document(&base);
        let mut player = bed.player(base.clone(), true).expect("a player");
        assert!(contents(&bed, &mut player).1, "the first frame generates");
        let mut random = Random(7 + i_case as u64);
        for i_edit in 0..2 * N_KINDS {
            let before = document.clone();
            let is_same_size = edit(&mut document, i_edit % N_KINDS, &mut random);
            let boxes = document.regenerated_since(&before);
            let scene = with(&base, &document);
            let reshaped = player.reshape(&bed, scene.clone(), &boxes).expect("reshaped");
            assert_eq!(
                reshaped == Reshaped::InPlace,
                is_same_size,
                "edit {i_edit} of case {i_case}"
            );
            // Some frames follow several edits.
            if i_edit % 3 == 1 {
                continue;
            }
            let (found, generates) = contents(&bed, &mut player);
            assert!(!generates);
            assert!(found == fresh(&bed, &scene), "edit {i_edit} of case {i_case}");
        }
    }
    bed.close().expect("no validation message");
}

/// A changed box that is not listed keeps its old particles, with and without new buffers.
#[test]
fn only_listed_boxes_are_generated() {
    let bed = bed();
    let base = scene("[lighting]\nmode = 'none'", "");
    let mut first = document(&base);
    first.boxes.iter_mut().for_each(|b| b.n_particles = b.n_particles.max(4));
    let base = Scene::clone(&with(&base, &first));
    let mut changed = first.clone();
    for i in [2, 5, 6] {
        changed.boxes[i].extent *= 0.5;
    }
    let mut longer = changed.clone();
    longer.boxes.push(changed.boxes[0]);
    let n_before = |document: &Document, i: usize| -> usize {
        document.boxes[..i].iter().map(|b| b.n_particles as usize).sum()
    };
    let of = |contents: &Contents, document: &Document, i: usize| {
        let begin = n_before(document, i);
        contents.particles[begin..begin + document.boxes[i].n_particles as usize].to_vec()
    };
    let old = fresh(&bed, &with(&base, &first));
    for (document, boxes, way) in [
        (&changed, vec![5], Reshaped::InPlace),
        (&longer, vec![5, first.boxes.len()], Reshaped::Anew),
    ] {
        let mut player = bed.player(base.clone(), true).expect("a player");
        contents(&bed, &mut player);
        let scene = with(&base, document);
        assert_eq!(player.reshape(&bed, scene.clone(), &boxes).expect("reshaped"), way);
        let (found, new) = (contents(&bed, &mut player).0, fresh(&bed, &scene));
        for i in 0..first.boxes.len() {
            let [old, found, new] =
                [of(&old, &first, i), of(&found, document, i), of(&new, document, i)];
            assert!(!old.is_empty());
            assert_eq!(found == old, i != 5, "box {i}, {way:?}");
            assert_eq!(found == new, ![2, 6].contains(&i), "box {i}, {way:?}");
        }
        assert!(found.picture != new.picture);
        // Listing the others completes the change.
        assert_eq!(player.reshape(&bed, scene, &[2, 6]).expect("reshaped"), Reshaped::InPlace);
        assert!(contents(&bed, &mut player).0 == new);
        // A reset generates all particles.
        player.renderer.reset();
        assert!(contents(&bed, &mut player).1);
    }
    bed.close().expect("no validation message");
}

#[test]
fn other_changes_are_refused_and_a_refusal_changes_nothing() {
    let bed = bed();
    let base = scene("[lighting]\nmode = 'none'", "");
    let mut player = bed.player(base.clone(), true).expect("a player");
    let others: [&dyn Fn(&mut Scene); 6] = [
        &|s| s.film.width += 1,
        &|s| s.lighting.grid += 1,
        &|s| s.clouds[0].position.x = 1.0,
        &|s| s.clouds[1].i_material = 1,
        &|s| s.lights.clear(),
        &|s| s.clouds.truncate(1),
    ];
    for change in others {
        let mut scene = base.clone();
        change(&mut scene);
        assert!(matches!(player.reshape(&bed, scene, &[]), Err(Error::Usage { .. })));
    }
    let n = base.groups().len();
    for wrong in [&[n][..], &[3, 2]] {
        assert!(player.reshape(&bed, base.clone(), wrong).is_err());
    }
    let mut huge = document(&base);
    huge.boxes[0].n_particles = u32::MAX;
    assert!(player.reshape(&bed, with(&base, &huge), &[0]).is_err());
    assert!(contents(&bed, &mut player).0 == fresh(&bed, &base.into()));
    drop(player);
    bed.close().expect("no validation message");
}

/// Tiles draw thin particles by other pipelines, which a change of a radius may require.
#[test]
fn a_radius_that_makes_particles_thin_recreates_the_pipelines() {
    let bed = bed();
    let base = scene("[lighting]\nmode = 'none'", "");
    let mut base = Scene { clouds: base.clouds[..1].to_vec(), ..base };
    let CloudSource::Boxes { law, .. } = &mut base.clouds[0].source else { unreachable!("boxes") };
    law.optical_depth = 0.08;
    // A largest radius of 3 is 1.4 times the mean, one of 0.5 twice.
    let mut wide = document(&base);
    wide.boxes.iter_mut().for_each(|b| b.radius_max = 3.0);
    base = Scene::clone(&with(&base, &wide));
    let mut small = wide.clone();
    small.boxes[3].radius_max = 0.5;
    let mut player = bed.player(base.clone(), true).expect("a player");
    contents(&bed, &mut player);
    for (document, way) in
        [(&small, Reshaped::Anew), (&small, Reshaped::InPlace), (&wide, Reshaped::Anew)]
    {
        let scene = with(&base, document);
        assert_eq!(player.reshape(&bed, scene.clone(), &[3]).expect("reshaped"), way);
        assert!(contents(&bed, &mut player).0 == fresh(&bed, &scene));
    }
    drop(player);
    bed.close().expect("no validation message");
}

/// The grid of a long cloud has few cells across. A compact cloud needs more, which light by
/// diffusion has buffers for that do not grow in place.
#[test]
fn the_density_grid_grows_for_other_proportions() {
    let bed = bed();
    let two = "mode = 'two-reflection'\nfacets_per_cloud = 30";
    for (lighting, way) in
        [(two, Reshaped::InPlace), ("mode = 'diffusion'\nbounces = 1", Reshaped::Anew)]
    {
        grows(&bed, lighting, way);
    }
    bed.close().expect("no validation message");
}

/// Checks a cloud whose grid needs more cells, and then none.
fn grows(bed: &GpuContext, lighting: &str, way: Reshaped) {
    let base = scene(&format!("[lighting]\ngrid = 16\n{lighting}"), "");
    let round = document(&base);
    let mut long = round.clone();
    long.boxes[0].center.x += 80.0;
    let [long, round] = [long, round].map(|document| with(&base, &document));
    assert!(4 * n_cells(&long) < n_cells(&round));
    let mut player = bed.player(long.clone(), true).expect("a player");
    contents(bed, &mut player);
    for (scene, way) in [(&round, way), (&long, Reshaped::InPlace), (&round, Reshaped::InPlace)] {
        assert_eq!(player.reshape(bed, scene.clone(), &[]).expect("reshaped"), way);
        assert!(contents(bed, &mut player).0 == fresh(bed, scene));
    }
}

#[test]
fn a_cloud_may_begin_without_boxes_and_lose_its_last_box() {
    let bed = bed();
    for more in [
        "[lighting]\nmode = 'two-reflection'\ngrid = 8",
        "path = 'sprites'\n[lighting]\nmode = 'first'\ngrid = 8",
    ] {
        let base = scene(more, "");
        let base = Scene { clouds: base.clouds[..1].to_vec(), ..base };
        let [none, no_particles, one] = [vec![], vec![0], vec![40]].map(|counts| {
            let like = document(&base).boxes[0];
            let boxes =
                counts.into_iter().map(|n_particles| CloudBox { n_particles, ..like }).collect();
            Document { boxes, seed: 3 }
        });
        let mut player = bed.player(with(&base, &none), true).expect("a player of nothing");
        let empty = contents(&bed, &mut player).0;
        assert!(empty.particles.is_empty() && empty.picture.iter().all(|byte| *byte == 0));
        for (document, boxes) in [
            (&no_particles, vec![0]),
            (&one, vec![0]),
            (&no_particles, vec![0]),
            (&one, vec![0]),
            (&none, vec![]),
        ] {
            let scene = with(&base, document);
            player.reshape(&bed, scene.clone(), &boxes).expect("reshaped");
            let found = contents(&bed, &mut player).0;
            assert!(found == fresh(&bed, &scene));
            assert_eq!(found.picture != empty.picture, document == &one);
        }
    }
    bed.close().expect("no validation message");
}
