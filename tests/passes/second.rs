//! second: the light that every facet gathers from all others, as a frame has it, against the same
//! in f64.

use crate::bounded;
use crate::bounded::Random;
use crate::gathers::{assert_agrees, is_noticed, reference, truths, values};
use crate::harness::{Gpu, assert_within_and_say};
use crate::rooms::{HEAD, SKY, frame, frame_by, plates_text, random_plates, sun_and_lamp};
use crate::scene_text::load_with;
use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::model::scene::Scene;

/// Six plates that shade each other, about a place far from the origin.
fn room(seed: u64, lighting: &str) -> Scene {
    let mut r = Random(seed);
    let mut plates = random_plates(&mut r, 6, 0.9, 0.1);
    let far = DVec3::new(300.0, -200.0, 100.0);
    plates.iter_mut().zip(0u32..).for_each(|(p, i)| {
        p.center += far;
        p.subdivide = [3 + i % 2, 4];
        // Half of them without lobe.
        p.ks *= f64::from(i % 2);
    });
    let lights = sun_and_lamp(&mut r, 2.0)
        .replace("position = [", "position = [300.0, -198.0, 100.0] # [")
        + SKY;
    let eye = format!(
        "[camera]\nposition = [302.0, -197.0, 105.0]\ntarget = [300.0, -200.0, \
         100.0]\n[lighting]\ngather = 'exact'\n{lighting}\n"
    );
    load_with(&(HEAD.to_owned() + &eye + &lights + &plates_text(&plates)), &[], None).unwrap().scene
}

/// A cloud between a ground and a plate.
fn cloud(lighting: &str) -> Scene {
    let plates = &mut random_plates(&mut Random(5), 2, 0.5, 0.1);
    (plates[0].center, plates[0].u, plates[0].v) =
        (DVec3::new(0.0, -2.0, 0.0), 3.0 * DVec3::Z, 3.0 * DVec3::X);
    (plates[1].center, plates[1].u, plates[1].v) =
        (DVec3::new(0.5, 2.0, 0.0), 0.7 * DVec3::X, 0.6 * DVec3::Z);
    plates.iter_mut().for_each(|p| p.subdivide = [4, 4]);
    let head = format!(
        "{HEAD}[lighting]\ngather = 'exact'\n{lighting}\n[[cloud]]\nfrom = 'boxes'\nfile = \
         'b.dat'\noptical_depth = 2\nradius_scale = 0.5\nmaterial = 'm0'\n"
    );
    let sun = "[[light]]\nkind = 'directional'\ndirection = [0.3, -1.0, 0.2]\nirradiance = \
        [3.0, 2.9, 2.7]\n";
    load_with(&(head + sun + SKY + &plates_text(plates)), &[], None).unwrap().scene
}

#[test]
fn rooms_of_plates_agree_with_the_reference() {
    let gpu = Gpu::new();
    for seed in 0..4 {
        assert_agrees(&format!("room {seed}"), &frame(&gpu, room(seed, "")));
    }
    for levels in [0, 2] {
        assert_agrees(
            &format!("{levels} levels"),
            &frame(&gpu, room(1, &format!("pair_levels = {levels}"))),
        );
    }
    assert_agrees("pair_size 2", &frame(&gpu, room(2, "pair_size = 2")));
    assert_agrees("diffuse", &frame(&gpu, room(3, "bases = 1")));
}

#[test]
fn a_cloud_between_plates_agrees_with_the_reference() {
    let gpu = Gpu::new();
    assert_agrees("cloud", &frame(&gpu, cloud("")));
    assert_agrees("cloud, few steps", &frame(&gpu, cloud("forward = 0\npair_steps = 3")));
}

#[test]
fn a_tree_that_is_opened_whole_is_every_pair_and_two_runs_are_the_same() {
    let gpu = Gpu::new();
    for scene in [room(0, ""), cloud("")] {
        let exact = frame(&gpu, scene.clone());
        assert_eq!(exact.lit, frame(&gpu, scene.clone()).lit);
        let mut opened = scene;
        opened.lighting.gather = nimbus::model::scene::Gather::Tree;
        opened.lighting.theta = 0.0;
        let tree = frame(&gpu, opened);
        let (a, b) = (values(&exact), values(&tree));
        for k in [0, 1] {
            // The same terms in another order: a rounding a term, of which there are some hundreds,
            // of their sum; terms of either sign (lobes) are a few percent of it.
            let bounds: Vec<f64> =
                a[k].iter().map(|v| 1000.0 * bounded::U * v.abs() + 1e-9).collect();
            assert_within_and_say("tree of theta 0", &b[k], &a[k], &bounds);
        }
    }
}

#[test]
fn wrong_gathers_are_noticed() {
    let gpu = Gpu::new();
    // With pair_size 4 most facets are taken as wholes.
    let scenes = [room(1, ""), cloud("forward = 0"), room(1, "pair_size = 4")];
    let references = scenes.clone().map(|s| truths(&reference(&frame(&gpu, s))));
    let wrong =
        |compiler: &Compiler, i: usize| is_noticed(&gpu, compiler, &scenes[i], &references[i]);
    assert!((0..3).all(|scene| !wrong(&gpu.compiler, scene)));
    for (scene, file, from, to) in [
        (0, "include/gather.glsl", "2.0 / (3.0 * d2)", "1.0 / (3.0 * d2)"),
        (0, "include/gather.glsl", "6.0 * dot(along, along)", "5.0 * dot(along, along)"),
        (
            0,
            "include/cells.glsl",
            "const float EDGE_WIDTH = 0.125",
            "const float EDGE_WIDTH = 0.25",
        ),
        (
            0,
            "include/cells.glsl",
            "const float SINGLE_EDGE_WIDTH = 0.25",
            "const float SINGLE_EDGE_WIDTH = 0.5",
        ),
        (0, "include/cells.glsl", "const float CELL_WIDTH = 3.0", "const float CELL_WIDTH = 4.0"),
        (0, "include/cells.glsl", "const float LOBE_STEP = 3.0", "const float LOBE_STEP = 4.0"),
        (0, "include/cells.glsl", "const float LOBE_PARTS = 1.5", "const float LOBE_PARTS = 2.0"),
        (0, "include/cell_samples.glsl", "0.5) * cell.u", "0.45) * cell.u"),
        (0, "include/cells.glsl", "walk.at * 2u", "walk.at"),
        (2, "include/occlude.glsl", "const float SOFT = 0.70710678", "const float SOFT = 0.8"),
        (0, "include/cell_samples.glsl", "steep = 2.0", "steep = 1.0"),
        (
            0,
            "include/cell_samples.glsl",
            "inside(e.right, along) - 1.0",
            "inside(e.right, along) - 0.9",
        ),
        (0, "include/cell_samples.glsl", "(2.0 / 3.0)", "(1.0 / 3.0)"),
        (0, "include/cell_samples.glsl", ">> level, v", ">> 0, v"),
        (0, "include/walk.glsl", "by_cells && source.is_partly_shadowed && view.is_split", "false"),
        (0, "include/arriving.glsl", "height * inverse * cone", "height * cone"),
        (
            0,
            "second_sources.comp",
            "0.0625 * total(s)",
            "0.0625 * total(s) * through[from] * 0.999",
        ),
        (1, "include/gather.glsl", "float(k) + 0.5", "float(k)"),
        (1, "include/gather.glsl", "push.pair_steps)", "3u)"),
        (1, "include/gather.glsl", "area * PI_INVERSE)", "area)"),
    ] {
        assert!(wrong(&Gpu::wrong_compiler(file, from, to), scene), "{file}: {from} as {to}");
    }
}

#[test]
fn a_gather_that_does_not_come_to_its_end_says_so() {
    let gpu = Gpu::new();
    assert!(
        frame(&gpu, room(0, "")).lit.iter().all(|l| l.n_lost == 0.0 && l.unresolved.is_finite())
    );
    // Receivers that never begin: all of their sources are counted as lost, and no light has a
    // bound.
    let idle = Gpu::wrong_compiler(
        "include/walk.glsl",
        "while (s < end && n_iterations < BATCH_ITERATIONS",
        "while (s < end && n_iterations < 1u",
    );
    let f = frame_by(&gpu, &idle, room(0, ""));
    let lost = f.lit.iter().filter(|l| l.n_lost > 0.0);
    assert!(lost.clone().count() * 2 > f.lit.len());
    assert!(
        lost.clone().all(|l| l.unresolved == f32::INFINITY)
            && f.lit.iter().all(|l| l.second.iter().all(|v| v.is_finite()))
    );
    // The same where no later round runs: the first one has counted what it left.
    let mut sources = nimbus::passes::sources();
    for (from, to) in [
        (
            "while (s < end && n_iterations < BATCH_ITERATIONS",
            "while (s < end && n_iterations < 1u",
        ),
        ("(push.i_round + 1u)], gl_WorkGroupID.x + 1u)", "(push.i_round + 1u)], 0u)"),
    ] {
        assert!(sources.replace("include/walk.glsl", from, to), "{from}");
    }
    let f = frame_by(&gpu, &Compiler::new(sources, None).expect("shaderc"), room(0, ""));
    assert!(f.lit.iter().filter(|l| l.n_lost > 0.0).count() * 2 > f.lit.len());
}
