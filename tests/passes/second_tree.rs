//! second from a tree of clusters: the light that every facet gathers, against the same in f64.

use std::fs;

use crate::bounded::Random;
use crate::gathers::{assert_agrees, is_noticed, reference, truths};
use crate::harness::Gpu;
use crate::rooms::{HEAD, SKY, frame, plates_text, random_plates, sun_and_lamp};
use crate::scene_text::{CLOUD, folder, load_with};
use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::io::scene_file::load;
use nimbus::model::scene::Scene;

/// Plates of 12 × 11 facets that shade each other, half of them with a lobe, one in four with
/// nothing else.
fn room(seed: u64, n: usize, theta: f64) -> Scene {
    let mut r = Random(seed);
    let mut plates = random_plates(&mut r, n, 0.9, 0.1);
    plates.iter_mut().zip(0u32..).for_each(|(p, i)| {
        p.subdivide = [12, 11];
        p.ks *= f64::from(i % 2);
        p.kd *= f64::from(u8::from(i % 4 != 1));
    });
    let lights = sun_and_lamp(&mut r, 2.0) + SKY;
    let head = format!("{HEAD}[lighting]\ngather = 'tree'\ntheta = {theta:?}\n");
    load_with(&(head + &lights + &plates_text(&plates)), &[], None).unwrap().scene
}

/// A cloud of some hundred facets between a ground and two plates.
fn cloud(theta: f64, lighting: &str) -> Scene {
    let plates = &mut random_plates(&mut Random(5), 3, 0.5, 0.1);
    (plates[0].center, plates[0].u, plates[0].v) =
        (DVec3::new(0.0, -2.0, 0.0), 3.0 * DVec3::Z, 3.0 * DVec3::X);
    (plates[1].center, plates[1].u, plates[1].v) =
        (DVec3::new(0.5, 2.0, 0.0), 0.7 * DVec3::X, 0.6 * DVec3::Z);
    // Askew: what lies in other plates' planes is in doubt.
    let u = DVec3::new(0.13, 0.21, 0.97).normalize();
    (plates[2].center, plates[2].u, plates[2].v) =
        (DVec3::new(2.0, 0.3, 0.2), 0.5 * u, 0.6 * u.cross(DVec3::X).normalize());
    plates.iter_mut().for_each(|p| p.subdivide = [8, 8]);
    let head = format!(
        "{HEAD}[lighting]\ngather = 'tree'\ntheta = {theta:?}\n{lighting}\n{CLOUD}optical_depth = \
         2\nradius_scale = 0.5\nmaterial = 'm0'\n"
    );
    let sun = "[[light]]\nkind = 'directional'\ndirection = [0.3, -1.0, 0.2]\nirradiance = \
        [3.0, 2.9, 2.7]\n";
    let (dir, path) = folder(&(head + sun + SKY + &plates_text(plates)));
    fs::write(
        dir.path().join("b.dat"),
        "240\n2\n160, 1.2, 0.8, 1, 0, 0, 0, 0.3\n80, 0.6, 1, 0.8, 0.7, 0.4, 0.2, 0.25\n",
    )
    .unwrap();
    load(&path, &[], None).unwrap().scene
}

#[test]
fn rooms_of_plates_agree_with_the_reference() {
    let gpu = Gpu::new();
    for theta in [0.4, 0.8] {
        for seed in 0..2 {
            assert_agrees(&format!("room {seed} at {theta}"), &frame(&gpu, room(seed, 8, theta)));
        }
    }
}

#[test]
fn a_cloud_between_plates_agrees_with_the_reference() {
    let gpu = Gpu::new();
    for theta in [0.4, 0.8] {
        assert_agrees(&format!("cloud at {theta}"), &frame(&gpu, cloud(theta, "")));
    }
}

#[test]
fn wrong_trees_are_noticed() {
    let gpu = Gpu::new();
    let scenes = [room(0, 8, 0.4), cloud(0.4, ""), room(0, 8, 0.8), cloud(0.8, "")];
    let references = scenes.clone().map(|s| truths(&reference(&frame(&gpu, s))));
    let wrong =
        |compiler: &Compiler, i: usize| is_noticed(&gpu, compiler, &scenes[i], &references[i]);
    assert!((0..4).all(|scene| !wrong(&gpu.compiler, scene)));
    let (cells, merge) = ("include/cells.glsl", "second_merge.comp");
    let mut missed = vec![];
    for (scene, file, from, to) in [
        (0, cells, "12.0 * dot(along, direction)", "11.0 * dot(along, direction)"),
        (1, cells, "12.0 * dot(along, direction)", "11.0 * dot(along, direction)"),
        (0, cells, "- 2.0 * extent", "- 1.9 * extent"),
        (0, cells, "- 4.0 * (at_source", "- 3.9 * (at_source"),
        (
            1,
            cells,
            "- at_receiver * dot(source.normal, along)",
            "+ at_receiver * dot(source.normal, along)",
        ),
        (3, cells, "source.normal)) * inverse;", "source.normal)) * inverse * 0.5;"),
        (0, cells, "s.leaning.x * x.x + s.leaning.z * x.z", "s.leaning.x * x.x"),
        (1, cells, "source.normal), 0.0) / 3.0;", "source.normal), 0.0) / 2.9;"),
        (3, cells, "positive_part(at_receiver, extent / 3.0)", "max(at_receiver, 0.0)"),
        (1, cells, "0.39894228", "0.3985"),
        (0, cells, "nearest * nearest * nearest", "nearest * nearest"),
        (2, cells, "tilt / max(1.0 - tilt, 0.01)", "tilt"),
        (0, cells, "wrong / (allowed * allowed)", "wrong / allowed"),
        (
            0,
            cells,
            "dot(receiver.normal, view.direction) + tilt",
            "dot(receiver.normal, view.direction)",
        ),
        (0, cells, "min(at_receiver, 1.0) * at_source", "min(at_receiver, 1.0)"),
        (1, cells, "0.0) + 1.0 - sqrt(even)", "0.0)"),
        (1, cells, "const float MIXED = 0.5", "const float MIXED = 0.55"),
        (1, cells, "const float CLOUD_THETA = 0.4", "const float CLOUD_THETA = 0.41"),
        (1, cells, "const float EVEN = 0.9999", "const float EVEN = 0.5"),
        (0, cells, "const float CLUSTER_EDGE_WIDTH = 0.5", "const float CLUSTER_EDGE_WIDTH = 0.52"),
        (3, cells, "const float CLUSTER_EDGE_WIDTH = 0.5", "const float CLUSTER_EDGE_WIDTH = 0.6"),
        (0, cells, "cluster ? LOBE_STEP * theta", "cluster ? 1.1 * LOBE_STEP * theta"),
        (1, cells, "const float UNLIT = 1e6", "const float UNLIT = 2.0"),
        (0, cells, "cluster ? 2.0 * source.radius", "cluster ? 1.9 * source.radius"),
        (0, merge, "child.extent.yzw + apart * apart", "apart * apart"),
        (0, merge, "child.extent.yzw + apart * apart", "child.extent.yzw + 0.98 * apart * apart"),
        (0, merge, "child.leaning.xyz + apart.xxy * apart.yzz", "child.leaning.xyz"),
        (0, merge, "length(apart) + child.place.w", "length(apart)"),
        (0, merge, "bool shines = weight > 0.0", "bool shines = true"),
        (0, merge, "bool shines = weight > 0.0", "bool shines = false"),
        (
            1,
            merge,
            "normal_by_flux += w * child.face.xyz",
            "normal_by_flux += w * normalize(child.face.xyz)",
        ),
        (0, merge, "total_area += area", "total_area = area"),
        (0, merge, "flux += child.sent.xyz", "flux += 0.999 * child.sent.xyz"),
        (0, merge, "sum += fluxes[", "sum += 0.99 * fluxes["),
        (0, "second_sources.comp", "(u * u + v * v) / 3.0", "(u * u + v * v) / 2.0"),
        (0, "include/occluders.glsl", "beyond == 4.0 ? 2u", "beyond == 4.0 ? 1u"),
    ] {
        if !wrong(&Gpu::wrong_compiler(file, from, to), scene) {
            missed.push(format!("{scene} {file}: {from} as {to}"));
        }
    }
    assert!(missed.is_empty(), "not noticed:\n{}", missed.join("\n"));
}
