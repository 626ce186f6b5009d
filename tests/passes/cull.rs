//! cull: what is kept against the f64 reference, over whole buffers: who, in which order, under
//! which keys, and how many.

mod wrong;

use crate::bounded::{Random, U};
use crate::harness::Gpu;
use glam::{DQuat, DVec3};
use nimbus::gpu::{Compiler, DeviceCount};
use nimbus::layout::cull::KeptRecord;
use nimbus::layout::frame::CameraRecord;
use nimbus::layout::particle::{DrawnRecord, ParticleRecord, PlacedRecord};
use nimbus::model::camera::Pose;
use nimbus::model::cloud::{SQRT_TAU, Turn};
use nimbus::model::edge::Edge;
use nimbus::passes::blobs::{BlobVariant, BlobView, DepthFrom, Depths};
use nimbus::passes::cull::{Cull, CullBuffers, CullView, Order};
use nimbus::passes::sort::{Count, NO_COUNT, Sort, TILE};
use nimbus::reference::Blob;
use nimbus::reference::cull::{CullOutcome, CullTolerance, outcome};
use nimbus::reference::view::View;

type Entry = [u32; 2];

/// A value that no entry has.
const UNTOUCHED: Entry = [7, u32::MAX];
const RADIUS: f64 = 8.0;

/// View depth: a difference and an f32 axis a term, three products and two sums; and the axis' own
/// length.
const DEPTH: f64 = 16.0 * U;

/// Particles, what is drawn of them, and what they are seen with.
#[derive(Clone)]
struct Scene {
    placed: Vec<PlacedRecord>,
    particles: Vec<ParticleRecord>,
    i_group: Vec<u32>,
    drawn: Vec<DrawnRecord>,
    weighted: bool,
    camera: CameraRecord,
    view: View,
    n_bits: u32,
}

/// The device's result.
#[derive(PartialEq, Debug)]
struct Found {
    kept: KeptRecord,
    entries: Vec<Entry>,
}

impl Scene {
    /// From the origin along −z, 53° up, nothing there yet.
    fn new(width: u32, height: u32) -> Scene {
        let pose =
            Pose { position: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z };
        let fov_y_rad = 2.0 * 0.5f64.atan();
        let view = View {
            width,
            height,
            pose,
            fov_y_rad,
            near: 0.5,
            edge: Edge::at(3.0),
            smallest: 0.0,
            slice: 0.0,
            n_parts: 4,
            shift: glam::DVec2::ZERO,
        };
        let group = DrawnRecord { shift: 0, end: u32::MAX, kappa_scale: 1.0, last_weight: 1.0 };
        Scene {
            placed: vec![],
            particles: vec![],
            i_group: vec![],
            drawn: vec![group],
            weighted: false,
            camera: CameraRecord::default(),
            view,
            n_bits: 32,
        }
        .seen()
    }

    /// The device's camera is the reference's view.
    fn seen(mut self) -> Scene {
        let (pose, tan_y) = (self.view.pose, (0.5 * self.view.fov_y_rad).tan());
        let f32s = |v: DVec3| v.as_vec3().to_array();
        self.camera = CameraRecord {
            eye: f32s(pose.position),
            tan_x: (tan_y * f64::from(self.view.width) / f64::from(self.view.height)) as f32,
            right: f32s(pose.right),
            tan_y: tan_y as f32,
            up: f32s(pose.up),
            near: self.view.near as f32,
            forward: f32s(pose.forward),
            unused: 0.0,
        };
        self
    }

    fn with(mut self, position: [f32; 3], sigma: f32, tau: f64) -> Scene {
        self.placed.push(PlacedRecord { position, sigma });
        let kappa = (tau / (SQRT_TAU * f64::from(sigma))) as f32;
        self.particles.push(ParticleRecord {
            kappa,
            aspect: 1.0,
            aspect_z: 1.0,
            ..ParticleRecord::default()
        });
        self.i_group.push(0);
        self
    }

    fn n(&self) -> u32 {
        self.placed.len() as u32
    }

    fn depths(&self) -> Depths {
        Depths { from: DepthFrom::Plane(self.camera.forward), radius: RADIUS, n_bits: self.n_bits }
    }

    fn run_by(&self, gpu: &mut Gpu, compiler: Option<&Compiler>) -> Found {
        let compiler = compiler.unwrap_or(&gpu.compiler);
        let variant = BlobVariant {
            weighted: self.weighted,
            threshold: self.view.edge.has_threshold(),
            shapes: self.particles.iter().map(|p| p.shape().kind()).max().unwrap_or_default(),
            ..BlobVariant::default()
        };
        let pass = Cull::new(&gpu.device, compiler, self.n(), variant).expect("cull");
        let (placed, particles) = (gpu.upload(&self.placed), gpu.upload(&self.particles));
        let (i_group, drawn) = (gpu.upload(&self.i_group), gpu.upload(&self.drawn));
        let entries = gpu.upload(&vec![UNTOUCHED; self.placed.len()]);
        let kept =
            gpu.upload(&[KeptRecord { sort: [9; 4], draw: [9; 4], splat: [9; 4], points: [9; 4] }]);
        let View { width, height, edge, smallest, .. } = self.view;
        let Edge { radius: cutoff, tau: threshold, least } = edge;
        let blobs = BlobView {
            camera: &self.camera,
            cutoff,
            threshold,
            least,
            saturated: 0.0,
            slice: 0.0,
            extents: None,
            cells: None,
        };
        let view = CullView { blobs, size: [width, height], smallest };
        let order = Order { depths: self.depths(), sort_tile: TILE, splat_block: 256 };
        let buffers = CullBuffers {
            placed: &placed,
            particles: &particles,
            i_group: &i_group,
            drawn: &drawn,
            entries: &entries,
            kept: &kept,
        };
        gpu.run(|rec| pass.record(rec, &buffers, &view, &order, self.n()));
        Found {
            kept: gpu.download(&kept, 1)[0],
            entries: gpu.download(&entries, self.placed.len()),
        }
    }

    /// Every particle's key, as `sort` makes it.
    fn keys(&self, gpu: &mut Gpu) -> Vec<u32> {
        let sort = Sort::new(&gpu.device, &gpu.compiler, self.n()).expect("sort");
        let all = DrawnRecord { shift: 0, end: u32::MAX, kappa_scale: 1.0, last_weight: 1.0 };
        let (placed, drawn) = (gpu.upload(&self.placed), gpu.upload(&[all]));
        let i_group = gpu.upload(&vec![0u32; self.placed.len()]);
        let entries = gpu.buffer::<Entry>(self.placed.len());
        let buffers = [&placed, &i_group, &drawn, &entries];
        gpu.run(|rec| sort.record_keys(rec, buffers, &self.depths(), self.n()));
        gpu.download::<Entry>(&entries, self.placed.len()).iter().map(|e| e[0]).collect()
    }

    fn blob(&self, i: usize) -> Blob {
        let (p, q) = (&self.placed[i], &self.particles[i]);
        let group = &self.drawn[self.i_group[i] as usize];
        let last = if i as u32 + 1 == group.end { group.last_weight } else { 1.0 };
        let weight =
            if self.weighted { f64::from(group.kappa_scale) * f64::from(last) } else { 1.0 };
        let position = DVec3::from(p.position.map(f64::from));
        Blob {
            shape: q.shape(),
            position,
            sigma: f64::from(p.sigma),
            kappa: weight * f64::from(q.kappa),
        }
    }

    fn fates(&self) -> Vec<CullOutcome> {
        // ln of a product of four, each rounded, by Vulkan's 3 ulp or 2^-21; what is kept beside
        // the silhouette, and its rounding.
        let slack = CullTolerance {
            depth: DEPTH,
            log: 2f64.powi(-20),
            growth: 1.01e-4,
            pixels: 1.01 / 16.0,
        };
        let of = |i: usize| {
            let drawn = (i as u32) < self.drawn[self.i_group[i] as usize].end;
            if drawn { outcome(&self.view, &self.blob(i), &slack) } else { CullOutcome::Culled }
        };
        (0..self.placed.len()).map(of).collect()
    }
}

/// The first thing that is wrong with what was found.
fn complaint(scene: &Scene, keys: &[u32], found: &Found) -> Option<String> {
    let Found { kept, entries } = found;
    let n = kept.sort[3] as usize;
    let expected = KeptRecord {
        sort: [n.div_ceil(1024) as u32, 1, 1, n as u32],
        draw: [4, n as u32, 0, 0],
        splat: [n.div_ceil(256) as u32, 1, 1, 0],
        points: [n as u32, 1, 0, 0],
    };
    if *kept != expected || n > entries.len() {
        return Some(format!("counts {kept:?}"));
    }
    if entries[n..].iter().any(|e| *e != UNTOUCHED) {
        return Some("an entry beyond the kept ones".to_owned());
    }
    if let Some(w) = entries[..n].windows(2).find(|w| w[0][1] >= w[1][1]) {
        return Some(format!("order: {w:?}"));
    }
    if let Some(e) = entries[..n].iter().find(|e| keys.get(e[1] as usize) != Some(&e[0])) {
        return Some(format!("key of {e:?}"));
    }
    let mut is_kept = vec![false; keys.len()];
    entries[..n].iter().for_each(|e| is_kept[e[1] as usize] = true);
    let wrong = |(i, outcome): (usize, CullOutcome)| match (outcome, is_kept[i]) {
        (CullOutcome::Kept, false) | (CullOutcome::Culled, true) => {
            Some(format!("{i}: {:?} {outcome:?}", scene.placed[i]))
        }
        _ => None,
    };
    scene.fates().into_iter().enumerate().find_map(wrong)
}

/// Particles all around the eye, of widths from a tenth of a pixel to the whole picture; in part
/// weighted.
fn random(seed: u64, n: usize) -> Scene {
    let mut random = Random(seed);
    let mut within = |low: f64, high: f64| random.within(low, high);
    let (width, height) = (within(1.0, 90.0) as u32, within(1.0, 70.0) as u32);
    let eye = DVec3::from([0; 3].map(|_| f64::from(within(-2.0, 2.0))));
    let toward = DVec3::from([0; 3].map(|_| f64::from(within(-1.0, 1.0)))).normalize();
    let right = toward.cross(DVec3::Y).normalize();
    let pose = Pose { position: eye, right, up: right.cross(toward), forward: toward };
    let mut scene = Scene::new(width, height);
    let tau = if seed.is_multiple_of(2) { f64::from(within(0.001, 0.2)) } else { 0.0 };
    let smallest = if seed.is_multiple_of(3) { f64::from(within(0.1, 2.0)) } else { 0.0 };
    let least = if seed.is_multiple_of(4) { f64::from(within(0.5, 1.0)) } else { 0.0 };
    let edge = Edge { tau, least, radius: f64::from(within(1.0, 5.0)) };
    let fov_y_rad = f64::from(within(0.3, 2.3));
    let near = f64::from(within(0.01, 0.5));
    scene.view = View { pose, edge, smallest, fov_y_rad, near, ..scene.view };
    scene.n_bits = if seed.is_multiple_of(2) { 16 } else { 32 };
    for i in 0..n {
        let at = [0; 3].map(|_| within(-4.0, 4.0));
        // Every seventh where the one before is.
        let at = if i % 7 == 6 { scene.placed[i - 1].position } else { at };
        let (sigma, tau) =
            (10f64.powf(f64::from(within(-4.0, 0.0))), 10f64.powf(f64::from(within(-4.0, 0.5))));
        scene = scene.with(at, sigma as f32, tau);
    }
    if seed.is_multiple_of(4) {
        let part =
            |k: u32| DrawnRecord { shift: 0, end: 10 * k + 7, kappa_scale: 1.2, last_weight: 0.1 };
        scene.weighted = true;
        scene.drawn = (0..n.div_ceil(10) as u32).map(part).collect();
        scene.i_group = (0..n as u32).map(|i| i / 10).collect();
    }
    scene.seen()
}

/// The same of ellipsoids, from a thousandth to a thousand times as high as wide.
fn random_ellipsoids(seed: u64, n: usize) -> Scene {
    let (mut scene, mut random) = (random(seed, n), Random(seed ^ 0xe11));
    for particle in &mut scene.particles {
        particle.aspect = 1000f32.powf(random.within(-1.0, 1.0));
    }
    scene
}

/// The same with turned axes.
fn random_turned(seed: u64, n: usize) -> Scene {
    let (mut scene, mut random) = (random_ellipsoids(seed, n), Random(seed ^ 0x7e11));
    for particle in &mut scene.particles {
        let mut of = || f64::from(random.within(-1.0, 1.0));
        let turn = DQuat::from_xyzw(of(), of(), of(), of() + 1e-3).normalize();
        let ratio = 1000f64.powf(of()) as f32;
        // No axis is shorter than a thousandth of the longest.
        let [least, most] = [particle.aspect.min(1.0), particle.aspect.max(1.0)];
        particle.aspect_z = ratio.clamp(1e-3 * most, 1e3 * least);
        particle.turn = Turn::new(turn).words();
    }
    scene
}

#[test]
fn of_turned_ones_too() {
    keep_what_the_reference_keeps(random_turned);
}

#[test]
fn random_scenes_keep_what_the_reference_keeps() {
    keep_what_the_reference_keeps(random);
}

#[test]
fn of_ellipsoids_too() {
    keep_what_the_reference_keeps(random_ellipsoids);
}

fn keep_what_the_reference_keeps(scenes: fn(u64, usize) -> Scene) {
    let mut gpu = Gpu::new();
    let mut counts = [0; 3];
    for (seed, n) in
        [0, 1, 2, 31, 33, 255, 256, 257, 511, 1024, 1025, 5000, 20_000].into_iter().enumerate()
    {
        let scene = scenes(seed as u64 + 1, n);
        let (keys, found) = (scene.keys(&mut gpu), scene.run_by(&mut gpu, None));
        assert_eq!(complaint(&scene, &keys, &found), None, "seed {seed}, {n} particles");
        assert_eq!(scene.run_by(&mut gpu, None), found, "again");
        scene.fates().into_iter().for_each(|f| counts[f as usize] += 1);
    }
    println!("kept, left, either: {counts:?}");
    // The reference decides nearly all of it; what is open is mostly narrower than what is kept for
    // rounding's sake.
    assert!(counts[0] > 1000 && counts[1] > 1000 && counts[2] * 8 < counts[0], "{counts:?}");
}

/// No pixel's ray meets a particle that the reference drops: the law's own claim.
#[test]
fn no_ray_meets_what_is_left_out() {
    let (mut n_left, mut n_met) = (0, 0);
    for seed in 1..=16 {
        let scenes = [random, random_ellipsoids, random_turned];
        let mut scene = scenes[seed as usize % 3](seed, 400);
        scene.view.smallest = 0.0;
        for (i, outcome) in scene.fates().into_iter().enumerate() {
            let (blob, view) = (scene.blob(i), &scene.view);
            let c = blob.position - view.pose.position;
            let drawn = (i as u32) < scene.drawn[scene.i_group[i] as usize].end;
            let meets = |d: DVec3| {
                0.5 * blob.along(c, d).off.powi(2) <= view.edge.cut(blob.along(c, d).depth)
            };
            let pixels = (0..view.height).flat_map(|j| (0..view.width).map(move |i| (i, j)));
            let met = drawn
                && c.dot(view.pose.forward) >= view.near
                && view.edge.cut(blob.deepest()) > 0.0
                && pixels.into_iter().any(|(i, j)| meets(view.ray(i, j)));
            assert!(outcome != CullOutcome::Culled || !met, "seed {seed}, {i}");
            n_left += u32::from(outcome == CullOutcome::Culled);
            n_met += u32::from(met);
        }
    }
    println!("{n_left} left, {n_met} met");
    assert!(n_left > 500 && n_met > 50, "{n_left} {n_met}");
}

#[test]
fn edges() {
    let mut gpu = Gpu::new();
    let mut check = |what: &str, scene: &Scene, n: usize| {
        let (keys, found) = (scene.keys(&mut gpu), scene.run_by(&mut gpu, None));
        assert_eq!(complaint(scene, &keys, &found), None, "{what}");
        assert_eq!(found.kept.sort[3] as usize, n, "{what}");
        found.entries[..n].iter().map(|e| e[1]).collect::<Vec<_>>()
    };
    let empty = || Scene::new(40, 30);
    let many =
        |scene: Scene, n: usize, at: [f32; 3]| (0..n).fold(scene, |s, _| s.with(at, 0.2, 1.0));
    check("none there", &empty(), 0);
    for n in [1, 257, 1500] {
        assert_eq!(
            check("all", &many(empty(), n, [0.1, 0.1, -4.0]), n),
            (0..n as u32).collect::<Vec<_>>()
        );
        check("all behind", &many(empty(), n, [0.1, 0.1, 4.0]), 0);
        check("all before the near plane", &many(empty(), n, [0.0, 0.0, -0.499]), 0);
        check("all beside", &many(empty(), n, [5.0, 0.1, -4.0]), 0);
    }
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let odd = empty()
        .with([nan, 0.0, -4.0], 0.2, 1.0)
        .with([0.0, 0.0, nan], 0.2, 1.0)
        .with([0.1, 0.1, -4.0], nan, 1.0)
        .with([0.1, 0.1, -4.0], 0.0, 1.0)
        .with([0.1, 0.1, -4.0], 0.2, 0.0)
        .with([0.1, 0.1, -4.0], 0.2, -1.0)
        .with([0.1, 0.1, inf], 0.2, 1.0)
        // The eye inside it; so wide that all pixels are; beside the eye and reaching behind it.
        .with([0.0, 0.0, -0.5], 1.0, 1.0)
        .with([9.0, 0.0, -0.6], 1e30, 1.0)
        .with([30.0, 0.0, -1.0], 11.0, 1.0);
    assert_eq!(check("what is no particle", &odd, 3), [7, 8, 9]);
    let mut small = empty().with([0.0, 0.0, -4.0], 0.09, 1.0).with([0.0, 0.0, -4.0], 0.11, 1.0);
    // A pixel at depth 4 is 4/30 wide.
    small.view.smallest = 0.75;
    assert_eq!(check("too small", &small, 1), [1]);
    let mut nothing = many(empty(), 300, [0.1, 0.1, -4.0]);
    nothing.drawn[0].end = 0;
    check("nothing is drawn", &nothing, 0);
}

/// Kept particles of one depth are drawn in ascending index, the others aside, as they are without.
#[test]
fn ties_stay_in_order_through_the_sort() {
    let mut gpu = Gpu::new();
    for n_bits in [16, 32] {
        let mut scene = Scene::new(40, 30);
        for i in 0..3000 {
            // Beside the picture or in it, at one of three depths.
            let at =
                [if i % 5 == 0 { 50.0 } else { 0.01 * (i % 9) as f32 }, 0.0, -3.0 - (i % 3) as f32];
            scene = scene.with(at, 0.3, 1.0);
        }
        scene.n_bits = n_bits;
        let (keys, found) = (scene.keys(&mut gpu), scene.run_by(&mut gpu, None));
        assert_eq!(complaint(&scene, &keys, &found), None);
        let n = found.kept.sort[3];
        assert_eq!(n, 2400);
        let sort = Sort::new(&gpu.device, &gpu.compiler, 3000).expect("sort");
        let (entries, kept) = (gpu.upload(&found.entries), gpu.upload(&[found.kept]));
        assert_ne!(KeptRecord::I_COUNT, NO_COUNT);
        let counts = DeviceCount {
            buffer: &kept,
            i_count: KeptRecord::I_COUNT,
            i_groups: KeptRecord::I_SORT,
        };
        let counted = Count::Counted(counts);
        gpu.run(|rec| sort.record(rec, &entries, n_bits, counted).map(|_| ()));
        let sorted: Vec<Entry> = gpu.download(&entries, 3000);
        let mut expected = found.entries[..n as usize].to_vec();
        expected.sort_by_key(|e| (e[0], e[1]));
        assert!(
            sorted[..n as usize] == expected && sorted[n as usize..] == found.entries[n as usize..]
        );
    }
}
