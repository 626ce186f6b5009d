//! The pass grid against its f64 reference: every cell within a bound derived from its own
//! deposits.

mod blobs;
#[path = "grid/narrowed.rs"]
mod of_narrowed;
#[path = "grid/turned.rs"]
mod of_turned;

use glam::{DVec3, UVec3, Vec3};

use blobs::{
    at_the_cut, ellipsoids, medium, paper, scattered, turned, wide, wide_ellipsoids, wide_turned,
};

use crate::harness::{Gpu, assert_within_and_say, check_within};
use nimbus::gpu::Compiler;
use nimbus::layout::frame::GridRecord;
use nimbus::layout::particle::{ParticleRecord, PlacedRecord};
use nimbus::model::cloud::{Shape, Shapes};
use nimbus::model::grid::{DEPOSIT_CUT_SIGMA, GridSpec};
use nimbus::passes::grid::{Deposit, Grid, Room};
use nimbus::reference::Blob;
use nimbus::reference::deposit::{
    axis_weights, deposit, deposit_on, is_narrowed, level_of, spread,
};
use nimbus::reference::rounding::{DIVISION_ERROR, U_F32, erf_bound};

const U: f64 = U_F32;

/// The input of the pass, and the f64 numbers that its f32 records stand for.
struct Scene {
    spec: GridSpec,
    record: GridRecord,
    blobs: Vec<Blob>,
    heaviest: f64,
}

impl Scene {
    fn new(spec: &GridSpec, blobs: &[Blob]) -> Scene {
        let record = GridRecord::from(spec);
        let low = Vec3::from_array(record.low).as_dvec3();
        let (cell, aspect) = (f64::from(record.cell), f64::from(record.aspect));
        let spec = GridSpec { n_cells: spec.n_cells, cell, aspect, low };
        let f32 = |b: &Blob| Blob {
            position: b.position.as_vec3().as_dvec3(),
            shape: Shape {
                aspect: f64::from(b.shape.aspect as f32),
                aspect_z: f64::from(b.shape.aspect_z as f32),
                ..b.shape
            },
            sigma: f64::from(b.sigma as f32),
            kappa: f64::from(b.kappa as f32),
        };
        let blobs: Vec<Blob> = blobs.iter().map(f32).collect();
        let heaviest = blobs.iter().map(Blob::mass).fold(0.0, f64::max);
        Scene { spec, record, blobs, heaviest }
    }

    fn fitted(blobs: &[Blob], n: u32) -> Scene {
        let reach = |b: &Blob| DEPOSIT_CUT_SIGMA * b.extents();
        let low = blobs.iter().map(|b| b.position - reach(b)).reduce(DVec3::min).unwrap();
        let high = blobs.iter().map(|b| b.position + reach(b)).reduce(DVec3::max).unwrap();
        let of = blobs.iter().map(|b| b.shape.aspect_upright());
        let aspect = of.sum::<f64>() / blobs.len() as f64;
        Scene::new(&GridSpec::fit(low, high, n, aspect), blobs)
    }

    /// Leaves out blobs whose law rounding decides, and turned ellipsoids that extend over as many
    /// cells along two axes, but for rounding: which axis comes first is open.
    fn decided(self) -> Scene {
        let n_levels = self.n_levels();
        let of = |b: &&Blob| {
            of_narrowed::is_decided(&self.spec, b)
                && of_turned::is_decided(&self.spec, b, level_of(&self.spec, b, n_levels))
        };
        let blobs = self.blobs.iter().filter(of).copied().collect();
        Scene { blobs, ..self }
    }

    fn shapes(&self) -> Shapes {
        self.blobs.iter().map(|b| b.shape.kind()).max().unwrap()
    }

    fn run(&self, gpu: &mut Gpu, compiler: &Compiler) -> Vec<f64> {
        let (has_levels, has_narrow) = (self.n_levels() > 1, self.n_blurs() > 0);
        let room = Room { n_cells: self.spec.n_total(), has_levels, has_narrow };
        self.run_on(gpu, &Grid::new(&gpu.device, compiler, room, self.shapes()).unwrap())
    }

    fn run_on(&self, gpu: &mut Gpu, pass: &Grid) -> Vec<f64> {
        let n_cells = self.spec.n_total() as usize;
        let (n_levels, n_blurs) = (self.n_levels(), self.n_blurs());
        let placed = |b: &Blob| PlacedRecord {
            position: b.position.as_vec3().to_array(),
            sigma: b.sigma as f32,
        };
        let particle = |b: &Blob| ParticleRecord {
            kappa: b.kappa as f32,
            aspect: b.shape.aspect as f32,
            aspect_z: b.shape.aspect_z as f32,
            turn: b.shape.turn.words(),
            ..ParticleRecord::default()
        };
        let placed = gpu.upload(&self.blobs.iter().map(placed).collect::<Vec<_>>());
        let particles = gpu.upload(&self.blobs.iter().map(particle).collect::<Vec<_>>());
        let density = gpu.buffer::<f32>(n_cells);
        let n = self.blobs.len() as u32;
        gpu.run(|rec| {
            pass.record(rec, [&placed, &particles, &density], &self.deposit(n, n_levels, n_blurs))
        });
        gpu.download::<f32>(&density, n_cells).into_iter().map(f64::from).collect()
    }

    fn deposit(&self, n_particles: u32, n_levels: u32, n_blurs: u32) -> Deposit<'_> {
        Deposit { grid: &self.record, n_particles, heaviest: self.heaviest, n_levels, n_blurs }
    }

    /// The grids that a blob of the scene is deposited on.
    fn n_levels(&self) -> u32 {
        let widest = self.blobs.iter().map(Blob::widest).fold(0.0, f64::max);
        self.spec.n_used_levels(self.blobs.len() as u64, widest)
    }

    /// The most blurs that a blob needs.
    fn n_blurs(&self) -> u32 {
        let widest = self.blobs.iter().map(|b| b.sigma).fold(0.0, f64::max);
        let aspects = || self.blobs.iter().map(|b| b.shape.aspect);
        let ends = [aspects().fold(f64::INFINITY, f64::min), aspects().fold(0.0, f64::max)];
        let ends = (self.shapes() < Shapes::Turned).then_some(ends);
        self.spec.n_blurs(self.blobs.len() as u64, widest, ends)
    }

    /// The blobs that are deposited narrower than they are, and the others.
    fn parts(&self) -> [Vec<Blob>; 2] {
        let has_narrow = self.n_blurs() > 0;
        let is_narrow = |b: &Blob| has_narrow && is_narrowed(&self.spec, b);
        let (narrowed, others) = self.blobs.iter().partition(|b| is_narrow(b));
        [narrowed, others]
    }

    /// Bound of every cell's density.
    fn bounds(&self) -> Vec<f64> {
        let [narrowed, others] = self.parts();
        let mut bounds = self.bounds_of_levels(&others);
        if !narrowed.is_empty() {
            let own = of_narrowed::bounds(&self.spec, self.heaviest, self.n_blurs(), &narrowed);
            bounds.iter_mut().zip(own).for_each(|(bound, own)| *bound += own);
            // The last blur adds to what is there.
            let sums = deposit(&self.spec, &self.blobs);
            bounds.iter_mut().zip(sums).for_each(|(bound, sum)| *bound += U * (sum + *bound));
        }
        bounds
    }

    /// Bound of the density of blobs that are deposited as wide as they are.
    fn bounds_of_levels(&self, blobs: &[Blob]) -> Vec<f64> {
        let n_levels = self.n_levels();
        let level_of = |b: &Blob| level_of(&self.spec, b, n_levels);
        let mut wider: Option<[Vec<f64>; 2]> = None;
        for level in (0..n_levels).rev() {
            let of = |b: &&Blob| b.sigma > 0.0 && b.kappa > 0.0 && level_of(b) == level;
            let blobs: Vec<Blob> = blobs.iter().filter(of).copied().collect();
            let mut values = deposit_on(&self.spec, level, &blobs);
            let mut bounds = self.bounds_on(level, &blobs);
            if let Some([of_values, of_bounds]) = &wider {
                let spec = self.spec.level(level);
                let mut given = vec![0.0; values.len()];
                spread(&spec, of_values, &mut given);
                spread(&spec, of_bounds, &mut bounds);
                for (i, given) in given.into_iter().enumerate() {
                    values[i] += given;
                    bounds[i] += SPREAD_ROUNDINGS * U * values[i];
                }
            }
            wider = Some([values, bounds]);
        }
        let [_, bounds] = wider.unwrap();
        bounds
    }

    /// Bound of the density that blobs have in the cells of a level.
    fn bounds_on(&self, level: u32, blobs: &[Blob]) -> Vec<f64> {
        let spec = self.spec.level(level);
        let n = spec.n_cells.as_usizevec3();
        let mut bounds = vec![0.0; n.x * n.y * n.z];
        let volume = spec.cell_volume();
        let quantum = self.heaviest / 2f64.powi(31) / volume;
        for blob in blobs {
            if !blob.shape.is_upright() {
                of_turned::add_bounds(&self.spec, blob, level, quantum, &mut bounds);
                continue;
            }
            let axis = |k: usize| self.axis(blob, level, k, n[k]);
            let (x, y, z) = (axis(0), axis(1), axis(2));
            let density = blob.mass() / volume;
            for &(k, wz, ez) in &z {
                for &(j, wy, ey) in &y {
                    for &(i, wx, ex) in &x {
                        let (exact, most) = (wx * wy * wz, (wx + ex) * (wy + ey) * (wz + ez));
                        // Half a quantum, where there is a deposit at all.
                        let rounded = if most > 0.0 { 0.5 * quantum } else { 0.0 };
                        bounds[i + n.x * (j + n.y * k)] +=
                            density * (most * (1.0 + ROUNDINGS * U) - exact) + rounded;
                    }
                }
            }
        }
        bounds
    }

    /// (cell, weight, its bound) of the cells that a blob can meet along an axis.
    fn axis(&self, blob: &Blob, level: u32, k: usize, n: usize) -> Vec<(usize, f64, f64)> {
        let (p, of) = (blob.position[k], blob.extents());
        let sigma = self.spec.deposited(of, level)[k];
        let (low, cell) = (self.spec.low[k], self.spec.level(level).edges()[k]);
        // On wider cells σ is the root of a difference that is at least 7/9 of σ². The square has a
        // rounding, and the subtrahend four.
        let of_root = if level > 0 { ROOT_ERROR } else { 0.0 };
        let (first, weights) = axis_weights(p, sigma, low, cell, n);
        let x = p - low;
        let face = |i: usize| (cell * i as f64 - x) / sigma;
        // A face in σ: i·cell and x are rounded, their difference, and the quotient errs by a
        // division's error. Of ellipsoids σ and the cell are products themselves.
        let of_shape = if blob.shape != Shape::BALL || self.spec.aspect != 1.0 { 1.0 } else { 0.0 };
        let face_error = |i: usize| {
            let at = cell * i as f64;
            (U * ((1.0 + of_shape) * at.abs() + x.abs() + (at - x).abs()) / sigma
                + (DIVISION_ERROR + of_shape + of_root) * U * face(i).abs())
                * (1.0 + 8.0 * U)
        };
        // The ends of the range: x, 3σ, their sum, 1/h and the product are rounded once each. A
        // cell left out or let in lies that near to the cut, where the density is φ(3).
        let range_error =
            (5.0 + 3.0 * of_shape + of_root) * U * (x.abs() + DEPOSIT_CUT_SIGMA * sigma) / sigma;
        let weight = |i: usize| {
            if (first..first + weights.len()).contains(&i) { weights[i - first] } else { 0.0 }
        };
        let beyond = |v: f64, e: f64| v.abs() - e >= DEPOSIT_CUT_SIGMA;
        let of = |i: usize| {
            let (a, b) = (face(i), face(i + 1));
            let (ea, eb) = (face_error(i), face_error(i + 1));
            if beyond(a, ea) && beyond(b, eb) && a.signum() == b.signum() {
                // Both faces are cut to the same number: erf − erf is 0.
                return (i, weight(i), 0.0);
            }
            let e = SHARE * (erf_error(a, ea) + erf_error(b, eb))
                + 3.0 * U * weight(i)
                + PHI_3 * range_error;
            (i, weight(i), e * (1.0 + 4.0 * U))
        };
        let last = (first + weights.len()).min(n - 1);
        (first.saturating_sub(1)..=last).map(of).collect()
    }
}

/// Roundings of a cell's density that wider cells are spread to: 13 of the sum of 27 terms, and one
/// of the sum with its own.
const SPREAD_ROUNDINGS: f64 = 14.0;
/// Error of σ on wider cells: (1 + 4·2/9)·9/7/2 + 1/2, and 3 of a root that is made of an inverse
/// one (2 ulp and a product).
const ROOT_ERROR: f64 = 6.0;

/// ½/erf(3/√2): what a weight makes of the difference of two erf.
const SHARE: f64 = 0.5 / 0.997_300_203_936_739_8;
/// The normal density at 3σ over erf(3/√2).
const PHI_3: f64 = 4.44e-3;
/// Roundings of a deposit that are relative: the mass 6 (5 products, a constant), quanta a mass 2,
/// the product with the share and the share's two 3, adding ½ before the cut to whole quanta 1; and
/// of the sum: two words to f32, their sum, the density of a quantum (one more for the cells'
/// shape) and its product 6.
const ROUNDINGS: f64 = 18.0;

/// Error of erf(c/√2), c the face `a` cut to ±3 that is itself off by `e`.
fn erf_error(a: f64, e: f64) -> f64 {
    let cut = a.clamp(-DEPOSIT_CUT_SIGMA, DEPOSIT_CUT_SIGMA);
    let e = if a.abs() - e >= DEPOSIT_CUT_SIGMA { 0.0 } else { e };
    let t = cut.abs() * std::f64::consts::FRAC_1_SQRT_2;
    // The constant's and the product's rounding.
    let e = e * std::f64::consts::FRAC_1_SQRT_2 + 2.0 * U * t;
    let slope = std::f64::consts::FRAC_2_SQRT_PI * (-(t - e).max(0.0).powi(2)).exp();
    slope * e + erf_bound((t - e).max(0.0)).max(erf_bound(t + e))
}

fn compiler() -> Compiler {
    Compiler::new(nimbus::passes::sources(), Compiler::default_cache()).unwrap()
}

fn scenes() -> Vec<(&'static str, Scene)> {
    let at =
        |x: f64, sigma, kappa| Blob { shape: Shape::BALL, position: DVec3::splat(x), sigma, kappa };
    let cells = GridSpec { aspect: 1.0, n_cells: UVec3::splat(9), cell: 1.0, low: DVec3::ZERO };
    vec![
        ("scattered", Scene::fitted(&scattered(3000), 48)),
        ("wide", Scene::fitted(&wide(3000), 64)),
        ("wide, of 45 cells", Scene::fitted(&wide(1000), 45)),
        ("wide ellipsoids", Scene::fitted(&wide_ellipsoids(3000), 64)),
        ("ellipsoids", Scene::fitted(&ellipsoids(3000), 48)),
        ("turned", Scene::fitted(&turned(3000), 48).decided()),
        ("wide turned ones", Scene::fitted(&wide_turned(3000), 64).decided()),
        ("of some cells", Scene::fitted(&medium(42_000, 1.0), 24).decided()),
        ("of some flat cells", Scene::fitted(&medium(42_000, 0.3), 24).decided()),
        ("the paper's 554", Scene::fitted(&paper(), 64)),
        ("at the cut", Scene::new(&cells, &at_the_cut())),
        ("a speck", Scene::new(&cells, &[at(4.5, 1e-4, 3.0)])),
        (
            "no size, no extinction",
            Scene::new(&cells, &[at(4.2, 0.0, 3.0), at(4.2, 0.5, 0.0), at(4.4, 0.5, 1.0)]),
        ),
        (
            "cut by the border and outside",
            Scene::new(&cells, &[at(0.2, 0.9, 1.0), at(-20.0, 1.0, 1.0), at(8.9, 0.3, 2.0)]),
        ),
        ("one cell", Scene::new(&GridSpec { n_cells: UVec3::ONE, ..cells }, &[at(0.4, 0.05, 1.0)])),
    ]
}

#[test]
fn every_cell_is_within_its_bound() {
    let mut gpu = Gpu::new();
    for (name, scene) in scenes() {
        let values = scene.run(&mut gpu, &compiler());
        let (truths, bounds) = (deposit(&scene.spec, &scene.blobs), scene.bounds());
        assert_within_and_say(name, &values, &truths, &bounds);
        let relative = |i: usize| if truths[i] > 0.0 { bounds[i] / truths[i] } else { 0.0 };
        let greatest = (0..truths.len()).max_by(|a, b| truths[*a].total_cmp(&truths[*b])).unwrap();
        println!("{name}: relative bound of the densest cell {:e}", relative(greatest));
        // Weights are some tenth and their bounds 2.5e-6: a bound that said nothing would show
        // here. Parts of turned ellipsoids follow from matrices, whose errors are bounded as a
        // whole.
        let most = if scene.shapes() == Shapes::Turned { 1e-2 } else { 1e-3 };
        assert!(relative(greatest) < most, "{name}");
    }
}

#[test]
fn mass_is_kept() {
    let mut gpu = Gpu::new();
    for (blobs, n) in [
        (scattered(3000), 64),
        (ellipsoids(3000), 64),
        (paper(), 64),
        (wide(3000), 64),
        (medium(42_000, 1.0), 24),
    ] {
        let scene = Scene::fitted(&blobs, n).decided();
        let volume = scene.spec.cell_volume();
        let values = scene.run(&mut gpu, &compiler());
        let (found, expected) =
            (values.iter().sum::<f64>() * volume, scene.blobs.iter().map(Blob::mass).sum::<f64>());
        let bound = scene.bounds().iter().sum::<f64>() * volume;
        println!("mass {found} of {expected}, relative error {:e}", found / expected - 1.0);
        // Every cell's bound at once, and f64's own: the weights of one axis cannot err all to one
        // side, but may.
        assert!((found - expected).abs() <= bound + 1e-12 * expected);
        assert!(bound < 1e-3 * expected);
    }
}

#[test]
fn sums_do_not_depend_on_the_order_nor_on_the_run() {
    let mut gpu = Gpu::new();
    let scene = Scene::fitted(&scattered(3000), 48);
    let values = scene.run(&mut gpu, &compiler());
    assert_eq!(scene.run(&mut gpu, &compiler()), values);
    // 1009 is coprime to 3000: a permutation.
    let blobs = (0..3000).map(|i| scene.blobs[(1009 * i + 17) % 3000]).collect();
    assert_eq!(Scene { blobs, ..scene }.run(&mut gpu, &compiler()), values);
}

#[test]
fn two_words_hold_what_overflows_one() {
    // A hundred times the heaviest particle in one cell: 100·2³¹ quanta.
    let mut gpu = Gpu::new();
    let cells = GridSpec { aspect: 1.0, n_cells: UVec3::splat(3), cell: 1.0, low: DVec3::ZERO };
    let scene = Scene::new(
        &cells,
        &[Blob { shape: Shape::BALL, position: DVec3::splat(1.5), sigma: 0.1, kappa: 2.0 }; 100],
    );
    let values = scene.run(&mut gpu, &compiler());
    let (truths, bounds) = (deposit(&scene.spec, &scene.blobs), scene.bounds());
    assert_within_and_say("overflow", &values, &truths, &bounds);
    for (file, from, to) in [
        ("grid_resolve.comp", "float(sums[c].y) * 4294967296.0 + ", ""),
        ("grid_deposit.comp", "before + quanta < before", "before + quanta < quanta - 2147483648u"),
    ] {
        let values = scene.run(&mut gpu, &Gpu::wrong_compiler(file, from, to));
        assert!(check_within("wrong", &values, &truths, &bounds).is_err(), "{to} was not noticed");
    }
}

/// Asserts that every change of a shader, (file, from, to), leads beyond the bounds.
fn assert_noticed(scene: &Scene, mutations: &[(&str, &str, &str)]) {
    let mut gpu = Gpu::new();
    let (truths, bounds) = (deposit(&scene.spec, &scene.blobs), scene.bounds());
    for (file, from, to) in mutations {
        let values = scene.run(&mut gpu, &Gpu::wrong_compiler(file, from, to));
        assert!(check_within("wrong", &values, &truths, &bounds).is_err(), "{to} was not noticed");
    }
}

#[test]
fn a_wrong_shader_is_noticed() {
    let scene = Scene::fitted(&scattered(500), 32);
    let mutations = [
        ("grid_deposit.comp", "0.9973002039367398", "0.9974"),
        ("grid_deposit.comp", "15.7496099457224", "15.75"),
        ("grid_deposit.comp", "const float CUT_SIGMA = 3.0", "const float CUT_SIGMA = 2.9"),
        ("grid_deposit.comp", "float(i + 1)", "(float(i) + 0.99)"),
        (
            "grid_deposit.comp",
            "begin.x + x + row * (begin.y + y)",
            "begin.x + y + row * (begin.y + x)",
        ),
    ];
    assert_noticed(&scene, &mutations);
}

#[test]
fn a_wrong_deposit_of_turned_ones_is_noticed() {
    let scene = Scene::fitted(&turned(300), 32).decided();
    let mutations = [
        ("grid_turned.comp", "by_a * slab.y / variance_b", "by_a * slab.y"),
        ("grid_turned.comp", "of_a * lag + of_b", "of_b"),
        ("grid_turned.comp", "rest_c + of_a * of_a * slab.y * (rest_b / variance_b)", "rest_c"),
        ("grid_turned.comp", "/ (1.0 + width)", ""),
        ("grid_turned.comp", "lengths.z == 1.0 && turn == uvec2(0)", "false"),
        ("grid_deposit.comp", "is_turned ? 0.0 : mass", "is_turned ? 0.0 : 0.9 * mass"),
        ("grid_deposit.comp", "is_turned ? 0.0 : mass", "mass"),
    ];
    assert_noticed(&scene, &mutations);
}

#[test]
fn a_wrong_grid_of_wide_cells_is_noticed() {
    let scene = Scene::fitted(&wide(1400), 64);
    assert!(scene.n_levels() > 2);
    let mutations = [
        ("grid_deposit.comp", "const float LEVEL_SIGMA = 1.5", "const float LEVEL_SIGMA = 1.6"),
        ("grid_deposit.comp", "0.5 * (edge * edge - 1.0)", "0.5 * edge * edge"),
        ("grid_deposit.comp", "(edge > 1.0) == (push.is_wide != 0u)", "push.is_wide == 0u"),
        ("grid_deposit.comp", "i_first += level > 1u ?", "i_first += level > 0u ?"),
        ("grid_deposit.comp", "n_cells = (n_cells + 1) / 2", "n_cells = n_cells / 2"),
        ("grid_spread.comp", "vec3(5.0, 10.0, 1.0)", "vec3(6.0, 10.0, 0.0)"),
        ("grid_spread.comp", "vec2(6.0, 26.0)", "vec2(5.0, 10.0)"),
        ("grid_spread.comp", "w.y = 16.0", "w.y = 10.0"),
        ("grid_spread.comp", "max(own.x, 1u) - 1u", "own.x"),
        ("grid_spread.comp", "uint first = push.i_first_wider", "uint first = push.i_first"),
    ];
    assert_noticed(&scene, &mutations);
}

#[test]
fn a_wrong_blur_is_noticed() {
    let scene = Scene::fitted(&medium(42_000, 1.0), 24).decided();
    let [narrowed, others] = scene.parts();
    assert!(narrowed.len() > 5_000 && others.len() > 1_000 && scene.n_blurs() == 17);
    assert_eq!(scene.spec.n_cells, UVec3::new(24, 22, 24));
    let mutations = [
        ("grid_narrow.comp", "0.75 - f * f", "0.76 - f * f"),
        ("grid_narrow.comp", "- 1.0 / 3.0", "- 0.33"),
        ("grid_narrow.comp", "(step + is_more - FIRST_BLUR)", "(step - FIRST_BLUR)"),
        ("grid_narrow.comp", "first + x + row * y", "first + y + row * x"),
        ("grid_narrow.comp", "at - vec3(own) - 0.5", "at - vec3(own) - 0.49"),
        ("grid_narrow.comp", "15.7496099457224", "15.76"),
        ("grid_narrow.comp", "? more : 1.0 - more", "? more : 1.0"),
        ("grid_deposit.comp", "push.has_narrow == 1u &&", "false &&"),
        ("grid_narrow.comp", "layer = row * push.grid.n_cells.y", "layer = row * row"),
        ("grid_blur.comp", "54.0 * value_of(c)", "53.9 * value_of(c)"),
        ("grid_blur.comp", "uvec3(1u, n.x, n.x * n.y)", "uvec3(1u, n.x, n.x * n.x)"),
        ("grid_blur.comp", "k == 1 ? 20.0 : 1.0", "k == 1 ? 21.0 : 0.0"),
        ("grid_blur.comp", "? -1 - i", "? 0"),
        ("grid_blur.comp", "? 2 * n - 1 - i", "? n - 1"),
        ("grid_blur.comp", "push.adds == 1u ? blurred[c] + sum : sum", "sum"),
    ];
    assert_noticed(&scene, &mutations);
}

/// One pass with room to spare: frames with many blurs, with none, with fewer, and after its room
/// has changed.
#[test]
fn frames_with_and_without_blurs_follow_each_other() {
    let mut gpu = Gpu::new();
    let many = Scene::fitted(&medium(42_000, 1.0), 24).decided();
    let few = Scene::fitted(&medium(3_000, 1.0), 24);
    let thin: Vec<Blob> = many.blobs.iter().filter(|b| b.sigma < 1.7).copied().collect();
    let thin = Scene::new(&GridSpec { n_cells: UVec3::splat(18), ..many.spec }, &thin);
    assert_eq!([&many, &few, &thin].map(Scene::n_blurs), [17, 0, 5]);
    let alone = [&many, &few, &thin].map(|scene| scene.run(&mut gpu, &compiler()));
    let room = Room { n_cells: 20_000, has_levels: true, has_narrow: true };
    let mut pass = Grid::new(&gpu.device, &compiler(), room, Shapes::Balls).unwrap();
    for n_cells in [20_000, 24 * 24 * 24] {
        pass.set_capacity(&gpu.device, n_cells).unwrap();
        for i in [0, 1, 2, 0] {
            let scene = [&many, &few, &thin][i];
            assert!(scene.run_on(&mut gpu, &pass) == alone[i], "{n_cells} {i}");
        }
    }
}

#[test]
fn a_grid_without_room_is_refused() {
    let mut gpu = Gpu::new();
    let scene = Scene::fitted(&scattered(10), 24);
    let n_cells = scene.spec.n_total();
    let room = Room { n_cells: n_cells - 1, has_levels: false, has_narrow: false };
    let pass = Grid::new(&gpu.device, &compiler(), room, Shapes::Balls).unwrap();
    let (placed, particles) = (gpu.buffer::<PlacedRecord>(10), gpu.buffer::<ParticleRecord>(10));
    let density = gpu.buffer::<f32>(n_cells as usize);
    let mut what = String::new();
    gpu.run(|rec| {
        let refused = pass.record(rec, [&placed, &particles, &density], &scene.deposit(10, 1, 0));
        what = refused.expect_err("no room").to_string();
        Ok(())
    });
    assert_eq!(
        what,
        format!(
            "limit: a density grid of {n_cells} cells, where there is room for {}",
            n_cells - 1
        )
    );
}
