//! The pass facets against its f64 reference, fed with the GPU's own density, so that this stage is measured alone.

mod harness;

use glam::{DVec3, UVec3, Vec3};
use harness::{Gpu, assert_within_and_say, check_within};
use nimbus::gpu::Compiler;
use nimbus::layout::facet::FacetRecord;
use nimbus::layout::frame::GridRecord;
use nimbus::layout::particle::{GroupRecord, ParticleRecord, PlacedRecord};
use nimbus::model::grid::GridSpec;
use nimbus::passes::facets::Facets;
use nimbus::passes::grid::Grid;
use nimbus::reference::Blob;
use nimbus::reference::facets::{
    CONDITIONING, Facet, GRADIENT_RADIUS_SIGMA, SHELL_SIGMA, directions, facets, gradient, smoothstep,
};
use nimbus::reference::generate::uniforms;
use nimbus::reference::grid::mass;
use nimbus::reference::rounding::{DIVISION_ERROR, U_F32};

const U: f64 = U_F32;
/// Mean σ of the two groups' particles: some are smaller, some larger.
const SIGMA_MEANS: [f32; 2] = [0.15, 0.25];
/// Two clouds, numbers 3 and 1.
const REGIONS: [u32; 2] = [3, 1];
/// The clouds' facets come after those of the surfaces.
const N_SURFACE_FACETS: usize = 5;
/// Relative error of the shader's 1 − e^−t; tests/functions.rs holds it to that.
const ONE_MINUS_EXP_ERROR: f64 = 1e-6;
/// Relative error of length(v) of three squares: 3 + 2 roundings under the root halve, and the root, which Vulkan
/// derives from inversesqrt (2 ulp = 4 u) and a division (5 u).
const LENGTH_ERROR: f64 = 2.5 + 4.0 + DIVISION_ERROR;

struct Scene {
    spec: GridSpec,
    record: GridRecord,
    blobs: Vec<Blob>,
    groups: [GroupRecord; 2],
    i_group: Vec<u32>,
}

/// A colour that no two blobs share.
fn color(b: &Blob) -> [f32; 3] {
    b.position.as_vec3().to_array()
}

fn f32_of(v: DVec3) -> DVec3 {
    v.as_vec3().as_dvec3()
}

impl Scene {
    /// Two balls of blobs, one fine and one coarse, and a few blobs in the empty space around.
    fn new() -> Scene {
        let spec = GridSpec { n_cells: UVec3::new(60, 40, 44), cell: 0.25, low: DVec3::new(-7.0, -5.0, -5.5) };
        let record = GridRecord::from(&spec);
        let spec = GridSpec { low: Vec3::from_array(record.low).as_dvec3(), cell: f64::from(record.cell), ..spec };
        let centers = [DVec3::new(-3.0, 0.1, 0.0), DVec3::new(3.2, -0.3, 0.2)];
        let blob = |i: u32| {
            let [a, b, c, d] = uniforms(0xface, 0, i, 0);
            let spread = if i.is_multiple_of(50) { 4.5 } else { 2.0 };
            let position = centers[(i / 1500) as usize] + spread * (DVec3::new(a, b, c) * 2.0 - 1.0);
            let sigma = f64::from((0.05 + 0.5 * d * d) as f32);
            Blob { position: f32_of(position), sigma, kappa: f64::from((0.02 + d) as f32) }
        };
        let mut blobs: Vec<Blob> = (0..3000).map(blob).collect();
        // In the middle of their cloud, without size, without extinction, far outside.
        blobs[10].position = f32_of(centers[0]);
        blobs[11].sigma = 0.0;
        blobs[12].kappa = 0.0;
        blobs[13].position = DVec3::splat(90.0);
        let group = |k: usize| GroupRecord {
            cloud_center: centers[k].as_vec3().to_array(),
            i_region: REGIONS[k],
            sigma_mean: SIGMA_MEANS[k],
            ..GroupRecord::default()
        };
        let i_group = (0..3000).map(|i| i / 1500).collect();
        Scene { spec, record, blobs, groups: [group(0), group(1)], i_group }
    }

    /// The GPU's density and facets.
    fn run(&self, gpu: &mut Gpu, compiler: &Compiler) -> (Vec<f64>, Vec<FacetRecord>) {
        let (n, n_cells) = (self.blobs.len(), self.spec.n_total() as usize);
        let grid = Grid::new(&gpu.device, compiler, n_cells as u64).unwrap();
        let pass = Facets::new(&gpu.device, compiler).unwrap();
        let placed = |b: &Blob| PlacedRecord { position: b.position.as_vec3().to_array(), sigma: b.sigma as f32 };
        let particle =
            |b: &Blob| ParticleRecord { kappa: b.kappa as f32, color: color(b), ..ParticleRecord::default() };
        let placed = gpu.upload(&self.blobs.iter().map(placed).collect::<Vec<_>>());
        let particles = gpu.upload(&self.blobs.iter().map(particle).collect::<Vec<_>>());
        let (i_group, groups) = (gpu.upload(&self.i_group), gpu.upload(&self.groups));
        let (density, made) = (gpu.buffer::<f32>(n_cells), gpu.buffer::<FacetRecord>(N_SURFACE_FACETS + n));
        let heaviest = self.blobs.iter().map(mass).fold(0.0, f64::max);
        gpu.run(|rec| {
            grid.record(rec, [&placed, &particles, &density], &self.record, n as u32, heaviest)?;
            let buffers = [&placed, &particles, &i_group, &groups, &density, &made];
            pass.record(rec, buffers, &self.record, n as u32, N_SURFACE_FACETS as u32)
        });
        let density = gpu.download::<f32>(&density, n_cells).into_iter().map(f64::from).collect();
        // What lies before is the surfaces'.
        (density, gpu.download(&made, N_SURFACE_FACETS + n).split_off(N_SURFACE_FACETS))
    }

    fn centers(&self) -> Vec<DVec3> {
        // By region; regions without a group stay unused.
        let mut centers = vec![DVec3::NAN; 4];
        for g in &self.groups {
            centers[g.i_region as usize] = Vec3::from_array(g.cloud_center).as_dvec3();
        }
        centers
    }

    fn reference(&self, cells: &[f64]) -> Vec<Facet> {
        let regions: Vec<u32> = self.i_group.iter().map(|g| REGIONS[*g as usize]).collect();
        let means: Vec<f64> = self.i_group.iter().map(|g| f64::from(SIGMA_MEANS[*g as usize])).collect();
        facets(&self.spec, cells, &self.blobs, &means, &regions, &self.centers())
    }

    /// Bound on the sampled density at `p`, where the sample's own position is rounded: its f32 evaluation meets a cell
    /// coordinate off by `e`, and ρ changes by at most the difference of neighbouring cells times that; the three
    /// interpolations then round numbers below the greatest cell around, twice each, and a difference three times.
    fn sample_error(&self, cells: &[f64], p: DVec3, sigma: f64) -> f64 {
        let n = self.spec.n_cells.as_ivec3();
        let g = (p - self.spec.low) / self.spec.cell - 0.5;
        // p + 2√5σd: the product's two and the sum's rounding; less low; times 1/h, itself rounded; less ½.
        let reach = p.abs() + 3.0 * GRADIENT_RADIUS_SIGMA * sigma;
        let e = (U * (reach + (p - self.spec.low).abs() * 3.0) / self.spec.cell + U * g.abs()) * (1.0 + 8.0 * U);
        // All cells that the sample or one beside it can meet.
        let (from, to) = ((g - e).floor().as_ivec3(), (g + e).floor().as_ivec3() + 1);
        let (mut low, mut high) = (f64::INFINITY, 0.0f64);
        for z in from.z..=to.z {
            for y in from.y..=to.y {
                for x in from.x..=to.x {
                    let inside = x >= 0 && y >= 0 && z >= 0 && x < n.x && y < n.y && z < n.z;
                    // Beyond the last centres there is nothing.
                    let v = if inside { cells[(x + n.x * (y + n.y * z)) as usize] } else { 0.0 };
                    (low, high) = (low.min(v), high.max(v));
                }
            }
        }
        (high - low) * e.element_sum() + 15.0 * U * high
    }

    /// Bounds on normal, position and area of blob `i`.
    fn bound(&self, cells: &[f64], i: usize, facet: &Facet) -> (f64, DVec3, f64) {
        let (blob, center) = (&self.blobs[i], self.centers()[facet.region as usize]);
        let scale = blob.sigma.max(f64::from(SIGMA_MEANS[self.i_group[i] as usize]));
        let (g, s) = gradient(&self.spec, cells, blob.position, scale);
        // Σ w δρ over the directions, and 14 sums and a product each of the running total.
        let sampled = |(d, w): &(DVec3, f64)| {
            let p = blob.position + GRADIENT_RADIUS_SIGMA * scale * *d;
            w * self.sample_error(cells, p, scale)
        };
        let dg = directions().iter().map(sampled).sum::<f64>() + 18.0 * U * s;
        let to_center = (blob.position - center).length();
        // p − c rounds once; length and quotient follow. The very centre has no direction, in both.
        let d_away = U * (1.0 + LENGTH_ERROR + DIVISION_ERROR) * 2.0;
        let away = if to_center > 0.0 { (blob.position - center) / to_center } else { DVec3::Y };
        let q = facet.conditioning;
        let normal = if s == 0.0 {
            d_away
        } else {
            // |G| errs by √3 dg, S by dg.
            let dq = (3f64.sqrt() * dg + q * dg) / s + U * q * (LENGTH_ERROR + DIVISION_ERROR);
            let width = CONDITIONING.1 - CONDITIONING.0;
            let dt = if q + dq < CONDITIONING.0 || q - dq > CONDITIONING.1 { 0.0 } else { 1.5 * dq / width + 8.0 * U };
            let t = smoothstep(CONDITIONING, q);
            if t + dt == 0.0 {
                d_away
            } else {
                // The unit gradient turns by 2√3 dg/|G|: the error grows with 1/(q S). Then the blend
                // v = t·down + (1−t)·away, whose own length divides.
                let d_down = 2.0 * 3f64.sqrt() * dg / g.length() + U * (LENGTH_ERROR + DIVISION_ERROR);
                let blend = t * -g.normalize_or_zero() + (1.0 - t) * away;
                let dv = (t + dt) * d_down + dt * 2.0 + (1.0 - t + dt) * d_away + 4.0 * U;
                2.0 * dv / (blend.length() - dv).max(1e-9) + U * (LENGTH_ERROR + DIVISION_ERROR)
            }
        };
        // No two unit vectors are farther apart than 2.
        let normal = normal.min(2.0 + 1e-6);
        let shell = SHELL_SIGMA * scale;
        // 1.5σ, its product with n, and the sum.
        let position = shell * normal * DVec3::ONE + U * (3.0 * shell + facet.position.abs() + blob.position.abs());
        // π, 3σ twice, three products, and the argument's four roundings, which 1 − e^−τ passes on at most once.
        let area = facet.area * (ONE_MINUS_EXP_ERROR + (6.0 + 5.0) * U);
        (normal, position, area)
    }
}

struct Compared {
    values: Vec<Vec<f64>>,
    truths: Vec<Vec<f64>>,
    bounds: Vec<Vec<f64>>,
    /// Regions and colours, which are handed on as they are.
    labels_right: bool,
}

const QUANTITIES: [&str; 4] = ["normal", "position", "area", "length of the normal"];

fn compare(scene: &Scene, cells: &[f64], made: &[FacetRecord]) -> Compared {
    let truth = scene.reference(cells);
    let mut c = Compared {
        values: vec![vec![]; 4],
        truths: vec![vec![]; 4],
        bounds: vec![vec![]; 4],
        labels_right: made.len() == truth.len(),
    };
    for (i, (facet, made)) in truth.iter().zip(made).enumerate() {
        let (normal, position, area) = scene.bound(cells, i, facet);
        let n = Vec3::from_array(made.normal).as_dvec3();
        let p = Vec3::from_array(made.position).as_dvec3();
        c.values[0].extend(n.to_array());
        c.truths[0].extend(facet.normal.to_array());
        c.bounds[0].extend([normal; 3]);
        c.values[1].extend(p.to_array());
        c.truths[1].extend(facet.position.to_array());
        c.bounds[1].extend(position.to_array());
        c.values[2].push(f64::from(made.area));
        c.truths[2].push(facet.area);
        c.bounds[2].push(area);
        c.values[3].push(n.length());
        c.truths[3].push(1.0);
        c.bounds[3].push(U * (LENGTH_ERROR + DIVISION_ERROR + 1.0));
        c.labels_right &= made.i_region == facet.region && made.color == color(&scene.blobs[i]);
    }
    c
}

impl Compared {
    fn is_right(&self) -> bool {
        self.labels_right && (0..4).all(|k| check_within("", &self.values[k], &self.truths[k], &self.bounds[k]).is_ok())
    }
}

#[test]
fn facets_are_within_bounds_that_grow_as_the_gradient_vanishes() {
    let mut gpu = Gpu::new();
    let compiler = Compiler::new(nimbus::passes::sources(), Compiler::default_cache()).unwrap();
    let scene = Scene::new();
    let (cells, made) = scene.run(&mut gpu, &compiler);
    let compared = compare(&scene, &cells, &made);
    assert!(compared.labels_right);
    for (k, what) in QUANTITIES.into_iter().enumerate() {
        assert_within_and_say(what, &compared.values[k], &compared.truths[k], &compared.bounds[k]);
    }
    let mut bounds = compared.bounds[0].clone();
    bounds.sort_by(f64::total_cmp);
    let truth = scene.reference(&cells);
    let share = |f: &dyn Fn(f64) -> bool| truth.iter().filter(|t| f(t.conditioning)).count();
    let (by_center, by_slope) = (share(&|q| q <= CONDITIONING.0), share(&|q| q >= CONDITIONING.1));
    println!("normals' bounds: median {:e}, greatest {:e}", bounds[bounds.len() / 2], bounds[bounds.len() - 1]);
    println!("by the centre {by_center}, by the gradient {by_slope}, blended {}", 3000 - by_center - by_slope);
    // The bound says something (a twentieth of a degree at the median), and all three branches are met.
    assert!(bounds[bounds.len() / 2] < 1e-3 && by_center > 10 && by_slope > 1000 && by_center + by_slope < 2990);
    assert_eq!((made[11].area, made[12].area), (0.0, 0.0));
    assert_eq!(scene.run(&mut gpu, &compiler), (cells, made));
}

#[test]
fn a_wrong_shader_is_noticed() {
    let mut gpu = Gpu::new();
    let scene = Scene::new();
    let mutations = [
        ("facets.comp", "max(sigma, group.sigma_mean)", "sigma"),
        ("include/shell.glsl", "SHELL_SIGMA = 1.5", "SHELL_SIGMA = 1.501"),
        ("include/shell.glsl", "SMOOTH_SIGMA = 4.47213595499958", "SMOOTH_SIGMA = 4.49"),
        ("include/shell.glsl", "CONDITION_LOW = 0.02", "CONDITION_LOW = 0.03"),
        ("include/shell.glsl", "w = 3.0 / 40.0", "w = 3.1 / 40.0"),
        ("include/shell.glsl", "-gradient / slope", "gradient / slope"),
        ("include/shell.glsl", "float radius = 3.0 * sigma", "float radius = 3.0001 * sigma"),
        ("facets.comp", "group.i_region,", "i_group[i],"),
        ("facets.comp", "particles[i].color", "particles[0].color"),
        ("facets.comp", "push.i_first_facet + i]", "push.i_first_facet + (i + 1) % push.n_particles]"),
        ("include/density.glsl", "mix(low, high, f.x)", "mix(low, high, f.y)"),
    ];
    for (file, from, to) in mutations {
        let (cells, made) = scene.run(&mut gpu, &Gpu::wrong_compiler(file, from, to));
        assert!(!compare(&scene, &cells, &made).is_right(), "{to} was not noticed");
    }
    // One facet of another region.
    let compiler = Compiler::new(nimbus::passes::sources(), Compiler::default_cache()).unwrap();
    let (cells, mut made) = scene.run(&mut gpu, &compiler);
    made[2000].i_region ^= 1;
    assert!(!compare(&scene, &cells, &made).is_right());
}
