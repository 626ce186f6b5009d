//! The pass lod against its f64 reference: keys, and all merged blobs on the device's own runs.

use std::path::Path;
use std::sync::Arc;

use crate::harness::{Gpu, assert_within_and_say, check_within};
use glam::DVec3;
use nimbus::frame::{Game, Renderer};
use nimbus::gpu::Compiler;
use nimbus::io::scene_file;
use nimbus::layout::particle::{GroupRecord, ParticleRecord, PlacedRecord, TexturedRecord};
use nimbus::model::lod::{RUN, class_of, edge_of};
use nimbus::model::philox::philox4x32_10;
use nimbus::model::shape::Shape;
use nimbus::passes::lod::{Lod, LodInput};
use nimbus::passes::sort::{Count, Sort};
use nimbus::reference::Blob;
use nimbus::reference::lod::{Merged, keys, merge, order};
use nimbus::reference::picture::{BlobModel, drawn_as_set};
use nimbus::reference::rounding::U_F32;

const N: usize = 6000;
const LOD: f64 = 0.5;

/// Particles of two clouds and three groups, the last one with a texture.
struct Scene {
    placed: Vec<PlacedRecord>,
    particles: Vec<ParticleRecord>,
    i_group: Vec<u32>,
    groups: Vec<GroupRecord>,
    textured: Vec<TexturedRecord>,
}

/// Returns numbers from 0 to 1.
fn some(i: u32, k: u32) -> [f32; 4] {
    philox4x32_10([7, 9], [i, k, 0, 0]).map(|word| (word >> 8) as f32 / (1u32 << 24) as f32)
}

fn scene() -> Scene {
    let of = |i: u32| {
        let ([x, y, z, size], [r, g, b, k]) = (some(i, 0), some(i, 1));
        // Some are far away, some small, some without extinction, some no balls.
        let far = if i.is_multiple_of(101) { 4000.0 } else { 1.0 };
        let sigma = if i.is_multiple_of(89) { 1e-3 } else { 0.5 + size };
        let aspect = if i.is_multiple_of(97) { 2.0 } else { 1.0 };
        let placed = PlacedRecord { position: [x, y, z].map(|v| far * (2.0 * v - 1.0)), sigma };
        let particle = ParticleRecord {
            position: [r, g, b],
            sigma: 9.0,
            color: [g, b, r],
            kappa: if i.is_multiple_of(83) { 0.0 } else { 0.1 + k },
            aspect,
            aspect_z: 1.0,
            turn: [0; 2],
        };
        (placed, particle)
    };
    let (placed, particles) = (0..N as u32).map(of).unzip();
    let group = |i_region| GroupRecord { i_region, ..GroupRecord::default() };
    let texture = |strength| TexturedRecord { strength, ..TexturedRecord::default() };
    Scene {
        placed,
        particles,
        i_group: (0..N as u32).map(|i| u32::from(i >= 2000) + u32::from(i >= 5000)).collect(),
        groups: vec![group(3), group(4), group(4)],
        textured: vec![texture(0.0), texture(0.0), texture(0.5)],
    }
}

impl Scene {
    fn blobs(&self) -> Vec<Blob> {
        let of = |(b, p): (&PlacedRecord, &ParticleRecord)| Blob {
            position: DVec3::from(b.position.map(f64::from)),
            sigma: f64::from(b.sigma),
            shape: Shape::upright(f64::from(p.aspect)),
            kappa: f64::from(p.kappa),
        };
        self.placed.iter().zip(&self.particles).map(of).collect()
    }

    fn sigma_max(&self) -> f64 {
        self.placed.iter().map(|b| f64::from(b.sigma)).fold(0.0, f64::max)
    }

    fn region(&self, i: u32) -> u32 {
        self.groups[self.i_group[i as usize] as usize].i_region
    }

    /// Returns the device's sorted entries, places and particles.
    fn run(
        &self,
        gpu: &mut Gpu,
        compiler: Option<&Compiler>,
    ) -> (Vec<[u32; 2]>, Vec<PlacedRecord>, Vec<ParticleRecord>) {
        let compiler = compiler.unwrap_or(&gpu.compiler);
        let lod = Lod::new(&gpu.device, compiler, true, true).expect("the pass");
        let sort = Sort::new(&gpu.device, compiler, N as u32).expect("a sort");
        let (placed, particles) = (gpu.upload(&self.placed), gpu.upload(&self.particles));
        let (i_group, groups) = (gpu.upload(&self.i_group), gpu.upload(&self.groups));
        let textured = gpu.upload(&self.textured);
        let input = LodInput {
            placed: &placed,
            particles: &particles,
            i_group: &i_group,
            groups: &groups,
            textured: &textured,
        };
        let law = (class_of(self.sigma_max()), LOD);
        let entries = gpu.buffer::<[u32; 2]>(N);
        let to = (gpu.buffer::<PlacedRecord>(N), gpu.buffer::<ParticleRecord>(N));
        gpu.run(|rec| {
            lod.record_keys(rec, &input, &entries, N as u32, law)?;
            let sorted = sort.record(rec, &entries, 32, Count::Known(N as u32))?;
            lod.record_merge(rec, &input, [sorted, &to.0, &to.1], N as u32)
        });
        (gpu.download(&entries, N), gpu.download(&to.0, N), gpu.download(&to.1, N))
    }
}

/// Returns the numbers of blobs: place, σ, κ and colour; of those that `merged` leaves without
/// extinction κ alone, and 0.
fn values(merged: &Merged, placed: &[PlacedRecord], particles: &[ParticleRecord]) -> Vec<f64> {
    let of = |(of, (b, p)): (&Blob, (&PlacedRecord, &ParticleRecord))| {
        let [x, y, z] = b.position;
        let [red, green, blue] = p.color;
        let all = [p.kappa, x, y, z, b.sigma, red, green, blue].map(f64::from);
        if of.kappa > 0.0 { all } else { [all[0], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0] }
    };
    merged.blobs.iter().zip(placed.iter().zip(particles)).flat_map(of).collect()
}

/// Returns the same of the reference, and their bounds. A sum of n terms has n roundings, of terms
/// that a member's offset from the first one bounds; a quotient has some more. κ = m/σ³.
fn truth(scene: &Scene, blobs: &[Blob], merged: &Merged) -> (Vec<f64>, Vec<f64>) {
    let colors: Vec<DVec3> =
        scene.particles.iter().map(|p| DVec3::from(p.color.map(f64::from))).collect();
    let means = merged.means(&colors);
    let mut roundings = vec![0.0; blobs.len()];
    for (own, members) in &merged.runs {
        roundings[*own as usize] = U_F32 * (16.0 + 2.0 * members.len() as f64);
    }
    let (mut values, mut bounds) = (vec![], vec![]);
    for (k, b) in merged.blobs.iter().enumerate() {
        // Members lie within a cell, which is less than σ wide.
        if b.kappa == 0.0 {
            values.extend([0.0; 8]);
            bounds.extend([0.0; 8]);
            continue;
        }
        let (off, from) = (roundings[k], b.position.abs() + b.sigma);
        values.extend([b.kappa].into_iter().chain(b.position.to_array()).chain([b.sigma]));
        values.extend(means[k].to_array());
        bounds.push(4.0 * off * b.kappa);
        bounds.extend((off * from).to_array().into_iter().chain([off * b.sigma]));
        bounds.extend([off; 3]);
    }
    (values, bounds)
}

/// Returns the reference on the device's order, which need not be that of f64 at the borders.
fn merged_as(scene: &Scene, blobs: &[Blob], entries: &[[u32; 2]]) -> Merged {
    let mut keys = vec![None; blobs.len()];
    for [key, i] in entries {
        keys[*i as usize] = (*key != u32::MAX).then_some([*key as i32, 0, 0, 0]);
    }
    let order: Vec<u32> = entries.iter().map(|[_, i]| *i).collect();
    merge(blobs, &keys, &order, |i| scene.region(i))
}

/// Returns how many blobs have another key than the reference, apart from those within rounding of
/// a border.
fn n_wrong_keys(scene: &Scene, blobs: &[Blob], entries: &[[u32; 2]]) -> usize {
    let is_alone = |i: usize| scene.textured[scene.i_group[i] as usize].strength != 0.0;
    let expected = keys(blobs, is_alone, LOD);
    let is_wrong = |[key, i]: &&[u32; 2]| {
        let b = &blobs[*i as usize];
        let found = (*key != u32::MAX)
            .then_some([*key >> 27, *key >> 18 & 511, *key >> 9 & 511, *key & 511])
            .map(|of| of.map(|v| v as i32));
        let class = 4.0 * b.sigma.log2();
        let cell = b.position / edge_of(class_of(b.sigma), LOD);
        let near = |v: f64, by: f64| (v - v.round()).abs() < by;
        let at_border = near(class, 1e-4) || cell.to_array().iter().any(|v| near(*v, 1e-3));
        found != expected[*i as usize] && !at_border
    };
    entries.iter().filter(is_wrong).count()
}

#[test]
fn merged_blobs_equal_those_of_the_reference() {
    let mut gpu = Gpu::new();
    let scene = scene();
    let blobs = scene.blobs();
    let (entries, placed, particles) = scene.run(&mut gpu, None);
    assert_eq!(n_wrong_keys(&scene, &blobs, &entries), 0);
    let is_sorted = |pair: &[[u32; 2]]| pair[0] < pair[1];
    assert!(entries.windows(2).all(is_sorted));
    let merged = merged_as(&scene, &blobs, &entries);
    let (expected, bounds) = truth(&scene, &blobs, &merged);
    assert_within_and_say(
        "merged blobs",
        &values(&merged, &placed, &particles),
        &expected,
        &bounds,
    );
    // Most blobs are merged, many are not, and mass is kept.
    let n_left = merged.blobs.iter().filter(|b| b.kappa > 0.0).count();
    assert!((1000..3000).contains(&n_left), "{n_left}");
    let mass = |of: &[Blob]| of.iter().map(|b| b.kappa * b.sigma.powi(3)).sum::<f64>();
    assert!((mass(&merged.blobs) / mass(&blobs) - 1.0).abs() < 1e-12);
    // The reference's own order makes nearly the same runs.
    let own = keys(&blobs, |i| scene.i_group[i] == 2, LOD);
    let runs = merge(&blobs, &own, &order(&own), |i| scene.region(i)).runs.len();
    assert!(runs.abs_diff(merged.runs.len()) < 20, "{runs} {}", merged.runs.len());
    for (p, q) in particles.iter().zip(&scene.particles).filter(|(p, _)| p.kappa > 0.0) {
        assert_eq!((p.aspect, p.aspect_z, p.turn), (q.aspect, q.aspect_z, q.turn));
    }
}

#[test]
fn many_equal_blobs_make_runs_of_bounded_length() {
    let mut gpu = Gpu::new();
    let mut scene = scene();
    let (one, other) = (scene.placed[1], scene.particles[1]);
    scene.placed.fill(one);
    scene.particles.fill(other);
    scene.groups.iter_mut().for_each(|g| g.i_region = 0);
    scene.textured.iter_mut().for_each(|t| t.strength = 0.0);
    let (_, placed, particles) = scene.run(&mut gpu, None);
    let left: Vec<usize> = (0..N).filter(|i| particles[*i].kappa > 0.0).collect();
    assert_eq!(left.len(), N.div_ceil(RUN as usize));
    let total: f64 = left.iter().map(|i| f64::from(particles[*i].kappa)).sum();
    assert!((total / (N as f64 * f64::from(other.kappa)) - 1.0).abs() < 1e-5);
    assert!(left.iter().all(|i| (placed[*i].sigma / one.sigma - 1.0).abs() < 3e-5));
}

#[test]
fn wrong_shaders_are_noticed() {
    let mut gpu = Gpu::new();
    let scene = scene();
    let blobs = scene.blobs();
    for (file, from, to) in [
        ("lod_key.comp", "push.first_class - int", "int"),
        ("lod_key.comp", "push.lod * exp2", "exp2"),
        ("lod_key.comp", "particle.aspect == 1.0 &&", ""),
        ("lod_key.comp", "is_ball && textured[i_group[i]].strength == 0.0", "is_ball"),
        ("lod_key.comp", "at.z << 18 | at.y << 9", "at.z << 9 | at.y << 18"),
        ("include/lod.glsl", "CELLS_PER_AXIS = 512", "CELLS_PER_AXIS = 500"),
        ("lod_merge.comp", "&& region_at(k) == region_at(k - 1u)", ""),
        ("lod_merge.comp", "particle.kappa * size * size * size", "particle.kappa * size"),
        ("lod_merge.comp", "dot(d, d) / 3.0);\n        position", "0.0);\n        position"),
        ("lod_merge.comp", "- dot(d, d) / 3.0", ""),
        ("lod_merge.comp", "mass / (size * size * size)", "mass / size"),
        ("lod_merge.comp", "own = square < nearest ? i : own", "own = i"),
        ("lod_merge.comp", "color += color_sum / mass", "color += color_sum"),
        ("lod_merge.comp", "int(3u * i + 1u), uvec4(0u)", "int(3u * i + 1u), uvec4(1u)"),
    ] {
        let compiler = Gpu::wrong_compiler(file, from, to);
        let (entries, placed, particles) = scene.run(&mut gpu, Some(&compiler));
        let merged = merged_as(&scene, &blobs, &entries);
        let (expected, bounds) = truth(&scene, &blobs, &merged);
        let found = values(&merged, &placed, &particles);
        let is_noticed = n_wrong_keys(&scene, &blobs, &entries) > 0
            || check_within("wrong", &found, &expected, &bounds).is_err();
        assert!(is_noticed, "{file}: {to} was not noticed");
    }
}

/// Returns the picture of the first frame of cubes-554 with many particles, without textures.
fn frame(gpu: &Gpu, overrides: &[&str]) -> (Arc<nimbus::model::scene::Scene>, Vec<f64>) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cubes-554.toml");
    let all = [
        "draw.particles=20000",
        "cloud.*.texture='none'",
        "film.format='rgba32f'",
        "film.width=96",
        "film.height=72",
        "lighting.grid=24",
    ];
    let overrides: Vec<String> = all.iter().chain(overrides).map(|o| (*o).to_owned()).collect();
    let scene = Arc::new(scene_file::load(&file, &overrides, None).expect("the scene").scene);
    let mut renderer = Renderer::new(&gpu.device, &gpu.compiler, &scene, true).expect("a renderer");
    let mut game = Game::new(scene.clone(), None);
    renderer.step(game.step(0).expect("a packet")).expect("a frame");
    (scene, renderer.image().expect("pixels").into_iter().map(f64::from).collect())
}

fn rms_apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

/// Whole frames are those of the merged blobs in f64, and near to those of all blobs.
#[test]
fn frames_show_the_merged_blobs() {
    let gpu = Gpu::new();
    let merged = "draw.lod=0.5";
    let (scene, tiles) = frame(&gpu, &[merged, "lighting.mode='none'"]);
    let truth = drawn_as_set(&scene, scene.time.at(0), BlobModel::AsDrawn, &|_, _| ())
        .expect("the reference");
    let truth = truth.rgba.as_flattened();
    let (_, sprites) = frame(&gpu, &[merged, "lighting.mode='none'", "draw.path='sprites'"]);
    // A blob at a border of cells may have another side, which changes some 10⁻⁵ of its depth.
    for (path, found) in [("tiles", &tiles), ("sprites", &sprites)] {
        let off = rms_apart(found, truth);
        assert!(off < 2e-5, "{path}: {off:.1e}");
    }
    let (_, all) = frame(&gpu, &["lighting.mode='none'"]);
    let off = rms_apart(&tiles, &all);
    assert!((1e-4..4e-3).contains(&off), "{off:.1e}");
    // Lit: a blob has the light of the member nearest to its centre.
    let lit = frame(&gpu, &[merged]).1;
    let all_lit = frame(&gpu, &[]).1;
    let brightest = all_lit.iter().copied().fold(0.0, f64::max);
    let off = rms_apart(&lit, &all_lit) / brightest;
    assert!((1e-4..1e-2).contains(&off), "{off:.1e}");
}
