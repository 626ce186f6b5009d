//! Light by the tensors.
//!
//! T1 has the right values, contraction gives the light of a direct gather, a frame with edits
//! equals the frame from scratch, and scenes whose tensors do not fit are refused.

#[path = "harness/bounded.rs"]
mod bounded;
mod harness;
#[path = "tensor/t1.rs"]
mod t1;

use std::path::Path;
use std::sync::Arc;

use bounded::{Random, U};
use glam::DVec3;
use harness::{Gpu, assert_within_and_say, check_within};
use nimbus::frame::Game;
use nimbus::frame::Renderer;
use nimbus::frame::Tensors;
use nimbus::frame::plan::{Pass, Plan};
use nimbus::frame::{Shape, basis_of};
use nimbus::gpu::Compiler;
use nimbus::io::scene_file;
use nimbus::layout::facet::{FacetRecord, LitRecord, NO_LOBE, RegionRecord};
use nimbus::layout::frame::LightRecord;
use nimbus::model::basis::{Basis, N_NODES, Sampling};
use nimbus::model::light::Light;
use nimbus::model::material::MaterialKey;
use nimbus::model::scene::Scene;
use nimbus::passes::first::{FirstBuffers, FirstTensor, TensorPush};
use nimbus::reference::first;

fn scene(overrides: &[&str]) -> Scene {
    let all: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    scene_file::load(Path::new("tests/data/edited.toml"), &all, None)
        .expect("the scene loads")
        .scene
}

struct Frames {
    facets: Vec<FacetRecord>,
    lit: Vec<Vec<LitRecord>>,
    images: Vec<Vec<u8>>,
    plans: Vec<Plan>,
}

/// Consecutive frames of one renderer.
fn run(
    gpu: &Gpu,
    compiler: Option<&Compiler>,
    scene: &Scene,
    frames: &[u32],
    skip: bool,
) -> Frames {
    let scene = Arc::new(scene.clone());
    let compiler = compiler.unwrap_or(&gpu.compiler);
    let mut renderer = Renderer::new(&gpu.device, compiler, &scene, skip).expect("a renderer");
    let mut game = Game::new(scene.clone(), None);
    let mut out = Frames { facets: vec![], lit: vec![], images: vec![], plans: vec![] };
    for i_frame in frames {
        out.plans
            .push(renderer.step(game.step(*i_frame).expect("a packet")).expect("a frame").plan);
        out.images.push(renderer.image_bytes().expect("bytes"));
        let (facets, lit) = renderer.facets(&gpu.device).expect("facets");
        out.facets = facets;
        out.lit.push(lit);
    }
    out
}

fn running(plan: &Plan) -> Vec<&'static str> {
    Pass::ALL.into_iter().filter(|p| plan.runs(*p)).map(Pass::name).collect()
}

#[test]
fn an_edit_is_contracted_alone_and_its_frame_is_the_frame_from_scratch() {
    let gpu = Gpu::new();
    for overrides in [&[][..], &["lighting.mode=\"first\""], &["lighting.bases=1"]] {
        let scene = scene(overrides);
        let edited = run(&gpu, None, &scene, &[0, 2, 4], true);
        assert_eq!(running(&edited.plans[1]), ["contract", "surfaces", "tiles"], "{overrides:?}");
        assert_eq!(running(&edited.plans[2]), ["contract", "surfaces", "tiles"], "{overrides:?}");
        let anew = run(&gpu, None, &scene, &[0, 2, 4], false);
        let alone = run(&gpu, None, &scene, &[4], true);
        assert!(edited.lit == anew.lit && edited.images == anew.images, "{overrides:?}: no skip");
        assert!(
            edited.lit[2] == alone.lit[0] && edited.images[2] == alone.images[0],
            "{overrides:?}: alone"
        );
        // The comparison is not vacuous: an edit changes light and picture.
        assert!(edited.lit[0] != edited.lit[1] && edited.images[0] != edited.images[1]);
        assert!(edited.lit[1] != edited.lit[2] && edited.images[1] != edited.images[2]);
    }
}

/// The same scene at frame 3 with its materials then, without edits. n_s, and so the cells, do not
/// differ.
fn unedited(scene: &Scene) -> Scene {
    let mut fixed = scene.clone();
    for material in &mut fixed.materials {
        let brdf = material.at(scene.time.at(3));
        material.keys = vec![MaterialKey { time_s: 0.0, brdf }];
    }
    fixed
}

/// Cells of a facet at the comparison's pair_levels = 1.
const MAX_CELLS: f64 = 4.0;
/// Roundings of both methods together in the factors of one term: position, offset, form factor and
/// share some ten each, energy, area, colour, coefficients and table.
const FACTORS: f64 = 40.0;
/// Units of round-off by which a compiler's choices may turn a unit half vector: a position some
/// four units from its facet within a scene of eight, and two normalisations.
const TURN: f64 = 32.0;

#[test]
fn contracted_light_is_light_gathered_at_once() {
    let gpu = Gpu::new();
    let mut scene = scene(&["lighting.pair_levels=1"]);
    for material in &mut scene.materials {
        let ns = material.keys[0].brdf.ns;
        material.keys.iter_mut().for_each(|k| k.brdf.ns = ns);
    }
    let tensors = run(&gpu, None, &scene, &[3], true);
    assert!(tensors.plans[0].runs(Pass::Contract));
    let fused = run(&gpu, None, &unedited(&scene), &[3], true);
    assert!(!fused.plans[0].runs(Pass::Contract));
    let (truths, bounds) = (numbers(&fused.lit[0]), bounds(&scene, &fused));
    assert_within_and_say("tensors against fused", &numbers(&tensors.lit[0]), &truths, &bounds);
    let counts = |lit: &[LitRecord]| lit.iter().map(|l| l.n_unresolved).collect::<Vec<_>>();
    assert_eq!(counts(&tensors.lit[0]), counts(&fused.lit[0]));
    // The bound is not vacuous: it is below 1 % of the scene's mean second reflection.
    let mean = |of: fn(&[f64]) -> f64, v: &[f64]| {
        v.chunks(12).map(of).sum::<f64>() / (v.len() / 12) as f64
    };
    let second = |c: &[f64]| c[9] + c[10] + c[11];
    println!("mean L2 {:.3e}, mean bound {:.3e}", mean(second, &truths), mean(second, &bounds));
    assert!(mean(second, &bounds) < 0.01 * mean(second, &truths));
    for (file, from, to) in [
        (
            "second_tensor.comp",
            "plain[r] += response[r] * diffuse",
            "plain[r] += response[0] * diffuse",
        ),
        (
            "second_tensor.comp",
            "shiny[b * N_RESPONSES + r] += response[r] * e",
            "shiny[b * N_RESPONSES + r] += response[0] * e",
        ),
        ("second_tensor.comp", "(n_plain + b) * TILE", "b * TILE"),
        (
            "second_tensor.comp",
            "emitter.kind == REGION_COLORED ? share.rgb",
            "emitter.kind == REGION_COLORED ? share.www",
        ),
        (
            "include/cells.glsl",
            "float excess = view.width / (broad",
            "float excess = 0.5 * view.width / (broad",
        ),
        ("second_tensor.comp", "front * value_at", "value_at"),
    ] {
        let compiler = Gpu::wrong_compiler(file, from, to);
        let wrong = run(&gpu, Some(&compiler), &scene, &[3], true);
        assert!(
            check_within(from, &numbers(&wrong.lit[0]), &truths, &bounds).is_err(),
            "{from} as {to}"
        );
    }
}

fn numbers(lit: &[LitRecord]) -> Vec<f64> {
    lit.iter()
        .flat_map(|l| [l.direct, l.indirect, l.first, l.second].concat())
        .map(f64::from)
        .collect()
}

/// Returns a bound on the difference of the two methods, value by value.
///
/// Both methods add the terms of the same cells, at most n of them, each rounded FACTORS times.
/// Tensors split a lobe into bases of both signs, so a sum of magnitudes is rounded. Gathering at
/// once multiplies a flux φ = Σ E A g/(d² + …) by f_i and f_j; tensors multiply it by at most
/// K_d/π + Σ|C_b| max|v_b| of each. φ is at most I_i over the least of any emitter's diffuse
/// albedo/π less the lobe's negative part.
fn bounds(scene: &Scene, fused: &Frames) -> Vec<f64> {
    let basis = basis_of(scene).expect("a basis");
    let shape = Shape::new(scene, basis.n_bases());
    let n = MAX_CELLS * scene.n_facets() as f64
        + f64::from(shape.n_columns)
        + f64::from(basis.n_bases())
        + FACTORS;
    let n = n + scene.lights.len() as f64;
    let color = |j: usize| DVec3::from(fused.facets[j].color.map(f64::from));
    // By region: K_d and Σ|K_s c_b| max|v_b|, with the angle's roundings in the maximum.
    let region = |i: usize| {
        let brdf = scene.region_material(i).at(scene.time.at(3));
        let coefficients =
            if scene.region_material(i).is_glossy() { basis.coefficients(brdf.ns) } else { vec![] };
        let lobe: f64 =
            coefficients.iter().zip(basis.vectors()).map(|(c, v)| c.abs() * greatest(v, n)).sum();
        let least = basis.lobe(brdf.ns).into_iter().fold(0.0, f64::min);
        (brdf.kd, brdf.ks * lobe, brdf.ks * -least)
    };
    let regions: Vec<_> = (0..scene.n_regions()).map(region).collect();
    let pi = std::f64::consts::PI;
    let most = regions.iter().map(|r| r.0 / pi + r.1).fold(DVec3::ZERO, DVec3::max);
    let albedo = |j: usize| regions[fused.facets[j].i_region as usize].0 * color(j) / pi;
    let sure =
        (0..fused.facets.len()).map(|j| albedo(j) - regions[fused.facets[j].i_region as usize].2);
    let least = sure.fold(DVec3::INFINITY, DVec3::min);
    assert!(least.min_element() > 0.0, "{least}");
    let bound = |(j, lit): (usize, &LitRecord)| {
        let [direct, indirect] = [lit.direct, lit.indirect].map(|v| DVec3::from(v.map(f64::from)));
        let response = albedo(j) + regions[fused.facets[j].i_region as usize].1;
        let sent = indirect / least * most;
        [direct, sent, direct * response, sent * response].map(|v| (n * U * v).to_array()).concat()
    };
    fused.lit[0].iter().enumerate().flat_map(bound).collect()
}

/// Greatest magnitude of a table's values, and their change by the angle's roundings in units of
/// `n` roundings: δw = |chord| δ chord = √2 t² TURN u, and δt = δw/4t³.
fn greatest(table: &[f64], n: f64) -> f64 {
    let at = |i: usize| i as f64 / (table.len() - 1) as f64;
    let moved = |i: usize| {
        (table[i + 1] - table[i]).abs() / at(1) * 2f64.sqrt() * TURN / (4.0 * at(i).max(at(1)))
    };
    let value = table.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    value + (0..table.len() - 1).map(moved).fold(0.0, f64::max) / n
}

#[test]
fn tensors_that_do_not_fit_are_not_kept_and_the_plan_says_so() {
    let gpu = Gpu::new();
    let scene = scene(&[]);
    let shape = Shape::new(&scene, basis_of(&scene).expect("a basis").n_bases());
    // Floor 25, ceiling 16, wall 16 (a lobe), shelf 4 facets, 40 particles with colours and a lobe,
    // 5 vectors. The floor has a lobe, too.
    let n_rows: u64 = 6 * 25 + 16 + 6 * 16 + 4 + 6 * 40;
    assert_eq!(shape.n_rows, n_rows.next_multiple_of(64));
    assert_eq!(shape.n_columns, 6 + 1 + 6 + 1 + 8);
    let bytes = 4 * 3 * shape.n_rows * 22;
    // Floor, ceiling, wall, shelf and cloud begin at columns 0, 6, 7, 13 and 14. Floor and shelf
    // face up and don't see each other; only the cloud sees itself.
    let spans = shape.spans(&scene);
    let of = |i: usize| spans[spans[i][0] as usize..][..spans[i][1] as usize].to_vec();
    assert_eq!(of(0), [[6, 7], [14, 8]]);
    assert_eq!(of(1), [[0, 6], [7, 15]]);
    assert_eq!(of(2), [[0, 7], [13, 9]]);
    assert_eq!(of(3), [[6, 7], [14, 8]]);
    assert_eq!(of(4), [[0, 22]]);
    let mut limits = *gpu.device.limits();
    assert_eq!(shape.fits(&limits, u64::MAX), Tensors::Kept);
    let first = 4 * 3 * shape.n_rows;
    assert_eq!(shape.fits(&limits, bytes + first), Tensors::Kept);
    assert_eq!(
        shape.fits(&limits, bytes + first - 1),
        Tensors::TooLarge { bytes, most: bytes - 1 }
    );
    limits.max_storage_buffer_bytes = bytes - 4;
    assert_eq!(shape.fits(&limits, u64::MAX), Tensors::TooLarge { bytes, most: bytes - 4 });
    limits.max_storage_buffer_bytes = u64::MAX;
    // A device with few texels reads storage buffers instead.
    limits.max_texels = bytes / 4 - 1;
    assert_eq!(shape.fits(&limits, u64::MAX), Tensors::Kept);
    limits.max_texels = 1 << 27;
    let rows = |n_rows| Shape { n_rows, ..shape.clone() };
    let most = 4 << 27;
    let fit = most / (4 * 3 * 22);
    assert_eq!(rows(fit).fits(&limits, u64::MAX), Tensors::Kept);
    let bytes = 4 * 3 * (fit + 1) * 22;
    assert_eq!(rows(fit + 1).fits(&limits, u64::MAX), Tensors::TooLarge { bytes, most });
    // Sizes beyond 64 bits are still only large.
    let huge = Shape { n_rows: u64::MAX / 4, ..shape };
    assert!(matches!(huge.fits(&limits, u64::MAX), Tensors::TooLarge { bytes: u64::MAX, .. }));
}

#[test]
fn a_scene_too_large_for_tensors_is_gathered_at_once() {
    let gpu = Gpu::new();
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("s.toml");
    // Two large rectangles back to back have nothing to gather. 2 · 90 000 · 8 rows of 16 columns
    // take 92 MB a light; two lights take 184 MB.
    let text = r#"
        camera = { path = [{ time_s = 0, position = [0, 1, 9], target = [0, 0, 0] }] }
        film = { width = 8, height = 8 }
        light = [
            { kind = "directional", direction = [0, -1, 0], irradiance = [1, 1, 1] },
            { kind = "directional", direction = [0, 1, 0], irradiance = [1, 1, 1] },
        ]
        [[material]]
        name = "m"
        path = [
            { time_s = 0, kd = [0.5, 0.5, 0.5], ks = [0.1, 0.1, 0.1] },
            { time_s = 1, kd = [0.1, 0.1, 0.1] },
        ]
        [[surface]]
        center = [0, 0, 0]
        u = [0, 0, 1]
        v = [1, 0, 0]
        material = "m"
        subdivide = [300, 300]
        [[surface]]
        center = [0, -1, 0]
        u = [1, 0, 0]
        v = [0, 0, 1]
        material = "m"
        subdivide = [300, 300]
    "#;
    std::fs::write(&path, text).expect("written");
    let scene = scene_file::load(&path, &[], None).expect("the scene loads").scene;
    let frames = run(&gpu, None, &scene, &[0, 1], true);
    let bytes: u64 = 4 * 2 * (2u64 * 90_000 * 8).next_multiple_of(64) * 16;
    let most = gpu.device.limits().max_storage_buffer_bytes;
    let reason = frames.plans[1].decision(Pass::Contract).reason.to_string();
    if bytes > most {
        assert_eq!(running(&frames.plans[1]), ["first", "second", "surfaces", "tiles"]);
        assert!(
            reason.contains(&bytes.to_string()) && reason.contains(&most.to_string()),
            "{reason}"
        );
    } else {
        assert_eq!(running(&frames.plans[1]), ["contract", "surfaces", "tiles"]);
    }
    assert!(frames.lit[0] != frames.lit[1]);
}
