//! Blobs in two clouds with all inputs of their facets, and bounds on the facets.

use glam::{DQuat, DVec3, UVec3, Vec3};
use nimbus::gpu::Compiler;
use nimbus::layout::facet::{FacetRecord, RunRecord};
use nimbus::layout::frame::GridRecord;
use nimbus::layout::particle::{GroupRecord, ParticleRecord, PlacedRecord, Shapes};
use nimbus::model::grid::GridSpec;
use nimbus::passes::facets::{Facets, ParticleBuffers};
use nimbus::passes::grid::{Deposit, Grid, Room};
use nimbus::reference::Blob;
use nimbus::reference::facets::{
    CONDITIONING, Facet, FacetPlace, FacetSources, GRADIENT_RADIUS_SIGMA, SHELL_SIGMA, directions,
    facets, gradient, smoothstep,
};
use nimbus::reference::generate::uniforms;
use nimbus::reference::grid::sample;
use nimbus::reference::rounding::{DIVISION_ERROR, U_F32};

use crate::harness::Gpu;
use nimbus::model::cloud::{Shape, Turn};

pub const U: f64 = U_F32;
/// Error of an axis of a turned ellipsoid, as a vector. A component of its quaternion errs by 6 U:
/// it is the root of what the other three leave. The second and the third axis err by 44 U, and the
/// first is their cross product.
pub const AXIS_ERROR: f64 = 160.0 * U;
/// Mean σ of the groups' particles: some are smaller, some larger.
pub const SIGMA_MEANS: [f32; 4] = [0.15, 0.17, 0.25, 0.29];
/// Two clouds of two groups each, numbers 3 and 1.
pub const REGIONS: [u32; 4] = [3, 3, 1, 1];
pub const N_PER_CLOUD: u32 = 1500;
/// The clouds' facets follow those of the surfaces.
pub const N_SURFACE_FACETS: usize = 5;
/// Relative error of the shader's 1 − e^−t, as checked by tests/passes/functions.rs.
const ONE_MINUS_EXP_ERROR: f64 = 3.5e-7;
/// Relative error of length(v) of three squares: half of 3 + 2 roundings under the root; and the
/// root, which Vulkan derives from inversesqrt (2 ulp = 4 u) and a division (5 u).
pub const LENGTH_ERROR: f64 = 2.5 + 4.0 + DIVISION_ERROR;

/// Relative error of an area: π, 3σ twice, three products, and the argument's four roundings, which
/// 1 − e^−τ passes on at most once.
pub const AREA_ERROR: f64 = ONE_MINUS_EXP_ERROR + (6.0 + 5.0) * U;

pub struct Scene {
    pub spec: GridSpec,
    record: GridRecord,
    pub blobs: Vec<Blob>,
    groups: [GroupRecord; 4],
    pub i_group: Vec<u32>,
}

/// A colour for every blob.
pub fn color(b: &Blob) -> [f32; 3] {
    b.position.as_vec3().to_array()
}

fn f32_of(v: DVec3) -> DVec3 {
    v.as_vec3().as_dvec3()
}

impl Scene {
    /// Returns two balls of blobs, one fine and one coarse, and a few blobs in the empty space
    /// around.
    pub fn new() -> Scene {
        Scene::of_shape(1.0)
    }

    /// Returns the same with ellipsoids of any axes, a fifth to once as long as the longest.
    pub fn turned() -> Scene {
        let mut scene = Scene::new();
        for (blob, i) in scene.blobs.iter_mut().zip(0..) {
            let ([a, b, c, d], [e, f, ..]) = (uniforms(0x7e11, 0, i, 0), uniforms(0x7e11, 1, i, 0));
            let of = |v: f64| f64::from((0.2 + 0.8 * v) as f32);
            let turn = DQuat::from_xyzw(a - 0.5, b - 0.5, c - 0.5, d - 0.5).normalize();
            blob.shape = Shape { aspect: of(e), aspect_z: of(f), turn: Turn::new(turn) };
        }
        scene
    }

    /// Returns the same with aspects from a third of `aspect` to `aspect`, unless that is 1, in
    /// cells of the same aspect.
    pub fn of_shape(aspect: f64) -> Scene {
        let n_cells = UVec3::new(60, (40.0 / aspect) as u32, 44);
        let spec = GridSpec { aspect, n_cells, cell: 0.25, low: DVec3::new(-7.0, -5.0, -5.5) };
        let record = GridRecord::from(&spec);
        let (cell, low) = (f64::from(record.cell), Vec3::from_array(record.low).as_dvec3());
        let spec = GridSpec { low, cell, aspect: f64::from(record.aspect), ..spec };
        let centers = [DVec3::new(-3.0, 0.1, 0.0), DVec3::new(3.2, -0.3, 0.2)];
        let blob = |i: u32| {
            let [a, b, c, d] = uniforms(0xface, 0, i, 0);
            let spread = if i.is_multiple_of(50) { 4.5 } else { 2.0 };
            let position =
                centers[(i / N_PER_CLOUD) as usize] + spread * (DVec3::new(a, b, c) * 2.0 - 1.0);
            let sigma = f64::from((0.05 + 0.5 * d * d) as f32);
            let aspect = if aspect == 1.0 {
                1.0
            } else {
                f64::from((aspect * (1.0 - 2.0 / 3.0 * c)) as f32)
            };
            Blob {
                shape: Shape::upright(aspect),
                position: f32_of(position),
                sigma,
                kappa: f64::from((0.02 + d) as f32),
            }
        };
        let mut blobs: Vec<Blob> = (0..3000).map(blob).collect();
        // In the middle of their cloud, without size, without extinction, far outside.
        blobs[10].position = f32_of(centers[0]);
        blobs[11].sigma = 0.0;
        blobs[12].kappa = 0.0;
        for (blob, k) in blobs[13..20].iter_mut().zip(0..) {
            blob.position = DVec3::splat(90.0 + f64::from(k));
        }
        let group = |k: usize| GroupRecord {
            cloud_center: centers[k / 2].as_vec3().to_array(),
            i_region: REGIONS[k],
            sigma_mean: SIGMA_MEANS[k],
            ..GroupRecord::default()
        };
        let i_group = (0..3000).map(|i| 2 * i / N_PER_CLOUD).collect();
        Scene { spec, record, blobs, groups: [0, 1, 2, 3].map(group), i_group }
    }

    pub fn shapes(&self) -> Shapes {
        self.blobs.iter().map(|b| b.shape.kind()).max().unwrap_or_default()
    }

    /// The GPU's density and facets.
    pub fn run(&self, gpu: &mut Gpu, compiler: &Compiler) -> (Vec<f64>, Vec<FacetRecord>) {
        let (density, made, _) = self.run_groups(gpu, compiler, &[], &[]);
        (density, made)
    }

    /// Computes facets of the particles, or of `runs` if there are any, and then each particle's
    /// facet.
    pub fn run_groups(
        &self,
        gpu: &mut Gpu,
        compiler: &Compiler,
        order: &[u32],
        runs: &[(u64, u64)],
    ) -> (Vec<f64>, Vec<FacetRecord>, Vec<u32>) {
        let (n, n_cells) = (self.blobs.len(), self.spec.n_total() as usize);
        let room = Room { n_cells: n_cells as u64, has_levels: false, has_narrow: false };
        let grid = Grid::new(&gpu.device, compiler, room, self.shapes()).unwrap();
        let pass = Facets::new(&gpu.device, compiler, self.shapes(), false).unwrap();
        let placed = |b: &Blob| PlacedRecord {
            position: b.position.as_vec3().to_array(),
            sigma: b.sigma as f32,
        };
        let particle = |b: &Blob| ParticleRecord {
            kappa: b.kappa as f32,
            color: color(b),
            aspect: b.shape.aspect as f32,
            aspect_z: b.shape.aspect_z as f32,
            turn: b.shape.turn.words(),
            ..ParticleRecord::default()
        };
        let placed = gpu.upload(&self.blobs.iter().map(placed).collect::<Vec<_>>());
        let particles = gpu.upload(&self.blobs.iter().map(particle).collect::<Vec<_>>());
        let (i_group, groups) = (gpu.upload(&self.i_group), gpu.upload(&self.groups));
        let (density, made) =
            (gpu.buffer::<f32>(n_cells), gpu.buffer::<FacetRecord>(N_SURFACE_FACETS + n));
        let heaviest = self.blobs.iter().map(Blob::mass).fold(0.0, f64::max);
        let run =
            |r: &(u64, u64)| RunRecord { i_first: r.0 as u32, n_particles: (r.1 - r.0) as u32 };
        let records: Vec<RunRecord> = runs.iter().map(run).collect();
        let (order, records, i_facet) =
            (gpu.upload(order), gpu.upload(&records), gpu.buffer::<u32>(n));
        gpu.run(|rec| {
            let grid_of = &self.record;
            let n_particles = n as u32;
            let deposit = Deposit { grid: grid_of, n_particles, heaviest, n_levels: 1, n_blurs: 0 };
            grid.record(rec, [&placed, &particles, &density], &deposit)?;
            let buffers = ParticleBuffers {
                placed: &placed,
                particles: &particles,
                i_group: &i_group,
                groups: &groups,
                density: &density,
                facets: &made,
            };
            if runs.is_empty() {
                return pass.record(rec, &buffers, &self.record, n as u32, N_SURFACE_FACETS as u32);
            }
            pass.record_runs(
                rec,
                &buffers,
                [&order, &records, &i_facet],
                &self.record,
                runs.len() as u32,
                N_SURFACE_FACETS as u32,
            )
        });
        let n = if runs.is_empty() { n } else { runs.len() };
        let density = gpu.download::<f32>(&density, n_cells).into_iter().map(f64::from).collect();
        // The surfaces' facets come first.
        let made = gpu.download(&made, N_SURFACE_FACETS + n).split_off(N_SURFACE_FACETS);
        (density, made, gpu.download(&i_facet, self.blobs.len()))
    }

    pub fn centers(&self) -> Vec<DVec3> {
        // By region; regions without a group stay unused.
        let mut centers = vec![DVec3::NAN; 4];
        for g in &self.groups {
            centers[g.i_region as usize] = Vec3::from_array(g.cloud_center).as_dvec3();
        }
        centers
    }

    pub fn reference(&self, cells: &[f64]) -> Vec<Facet> {
        let regions: Vec<u32> = self.i_group.iter().map(|g| REGIONS[*g as usize]).collect();
        let means: Vec<f64> =
            self.i_group.iter().map(|g| f64::from(SIGMA_MEANS[*g as usize])).collect();
        {
            let sources = FacetSources {
                blobs: &self.blobs,
                sigma_means: &means,
                regions: &regions,
                colors: &[],
                place: FacetPlace::Shell,
            };
            facets(&self.spec, cells, &sources, &self.centers())
        }
    }

    /// Returns the bound on the density sampled at `p`. The f32 evaluation has a cell coordinate
    /// off by `e`, and ρ changes by at most the difference of neighbouring cells times that. The
    /// three interpolations then round numbers below the largest cell around, twice each, and a
    /// difference three times.
    fn sample_error(&self, cells: &[f64], p: DVec3, sigma: f64, astray: f64) -> f64 {
        let n = self.spec.n_cells.as_ivec3();
        let edges = self.spec.edges();
        let g = (p - self.spec.low) / edges - 0.5;
        // p + 2√5σd: the product's two roundings and the sum's; minus low; times 1/h, itself
        // rounded, and along y 1/a likewise; minus ½.
        let reach = p.abs() + 3.0 * GRADIENT_RADIUS_SIGMA * sigma;
        let e =
            (U * (reach + (p - self.spec.low).abs() * 5.0) / edges + U * g.abs() + astray / edges)
                * (1.0 + 8.0 * U);
        // All cells that the sample or one beside it can meet.
        let (from, to) = ((g - e).floor().as_ivec3(), (g + e).floor().as_ivec3() + 1);
        let (mut low, mut high) = (f64::INFINITY, 0.0f64);
        for z in from.z..=to.z {
            for y in from.y..=to.y {
                for x in from.x..=to.x {
                    let inside = x >= 0 && y >= 0 && z >= 0 && x < n.x && y < n.y && z < n.z;
                    // Beyond the outermost centres the density is 0.
                    let v = if inside { cells[(x + n.x * (y + n.y * z)) as usize] } else { 0.0 };
                    (low, high) = (low.min(v), high.max(v));
                }
            }
        }
        (high - low) * e.element_sum() + 15.0 * U * high
    }

    /// Relative error of an area. An ellipsoid's mean width takes two more logarithms and two
    /// exponentials: with |log2 a| < 6 and 3 ulp a logarithm, 2⁻²¹ about 1, and 3 + 2|x| an
    /// exponential, 320 roundings in total, including those of its depth.
    pub fn area_error(&self) -> f64 {
        AREA_ERROR + if self.shapes() > Shapes::Balls { 320.0 * U } else { 0.0 }
    }

    /// Returns bounds on normal, position and area of blob `i`.
    pub fn bound(&self, cells: &[f64], i: usize, facet: &Facet) -> (f64, DVec3, f64) {
        let blob = &self.blobs[i];
        let scale = blob.sigma.max(f64::from(SIGMA_MEANS[self.i_group[i] as usize]));
        let around = Around {
            p: blob.position,
            p_error: 0.0,
            scale,
            scale_error: 0.0,
            shape: blob.shape,
            aspect_error: 0.0,
        };
        let normal = self.normal_bound(cells, &around, facet);
        (normal, around.shell_bound(normal, facet), facet.area * self.area_error())
    }

    /// Returns the bound on `facet`'s normal around a point.
    pub fn normal_bound(&self, cells: &[f64], at: &Around, facet: &Facet) -> f64 {
        let center = self.centers()[facet.region as usize];
        let lengths = at.shape.lengths();
        let density = |x| sample(&self.spec, cells, x);
        let (g, s) = gradient(density, at.p, at.scale, &at.shape);
        // The sample's offset.
        let (widest, turned) = (at.shape.widest(), at.axes_error());
        let scale_error = at.scale_error * widest + at.scale * (at.aspect_error + turned * widest);
        let astray = at.p_error + GRADIENT_RADIUS_SIGMA * scale_error;
        // Σ w δρ over the directions, and 14 sums and a product each of the running total.
        let sampled = |(d, w): &(DVec3, f64)| {
            let p = at.p + GRADIENT_RADIUS_SIGMA * at.scale * at.shape.from_ball(*d);
            w * self.sample_error(cells, p, at.scale * widest, astray)
        };
        let dg = directions().iter().map(sampled).sum::<f64>() + 18.0 * U * s;
        let to_center = (at.p - center).length();
        // p − c rounds once; length and quotient follow. The exact centre has no direction on
        // either side.
        let swung = if to_center > 0.0 { 2.0 * at.p_error / to_center } else { 0.0 };
        let d_away = U * (1.0 + LENGTH_ERROR + DIVISION_ERROR) * 2.0 + swung;
        let away = if to_center > 0.0 { (at.p - center) / to_center } else { DVec3::Y };
        let q = facet.conditioning;
        let normal = if s == 0.0 {
            // No density around, and none that a displaced sample would meet.
            if dg > 0.0 { 2.0 } else { d_away }
        } else {
            // |G| errs by √3 dg, S by dg.
            let dq = (3f64.sqrt() * dg + q * dg) / s + U * q * (LENGTH_ERROR + DIVISION_ERROR);
            let width = CONDITIONING.1 - CONDITIONING.0;
            let dt = if q + dq < CONDITIONING.0 || q - dq > CONDITIONING.1 {
                0.0
            } else {
                1.5 * dq / width + 8.0 * U
            };
            let t = smoothstep(CONDITIONING, q);
            if t + dt == 0.0 {
                d_away
            } else {
                // The unit gradient turns by 2√3 dg/|G|: the error grows with 1/(q S). Then the
                // blend v = t·down + (1−t)·away, whose own length divides. For an ellipsoid the
                // error is stretched with it; the quotient by a is rounded, and a may be off.
                let down = -at.shape.gradient_from_ball(g);
                let of_shape = at.aspect_error / at.shape.aspect + DIVISION_ERROR * U;
                let sides = if turned > 0.0 { g.length() } else { g.y.abs() };
                // Axes that are off take a part of every component to the shortest one's.
                let wrong = dg + sides * of_shape + 3.0 * turned * g.length();
                let d_down =
                    2.0 * 3f64.sqrt() * wrong / lengths.min_element().min(1.0) / down.length()
                        + U * (LENGTH_ERROR + DIVISION_ERROR);
                let blend = t * down.normalize_or_zero() + (1.0 - t) * away;
                let dv = (t + dt) * d_down + dt * 2.0 + (1.0 - t + dt) * d_away + 4.0 * U;
                2.0 * dv / (blend.length() - dv).max(1e-9) + U * (LENGTH_ERROR + DIVISION_ERROR)
            }
        };
        // Two unit vectors are at most 2 apart.
        normal.min(2.0 + 1e-6)
    }
}

/// Inputs of a facet, as far as the GPU has them.
pub struct Around {
    pub p: DVec3,
    pub p_error: f64,
    pub scale: f64,
    pub scale_error: f64,
    pub shape: Shape,
    pub aspect_error: f64,
}

impl Around {
    /// Returns the error of an axis.
    fn axes_error(&self) -> f64 {
        if self.shape.is_upright() { 0.0 } else { AXIS_ERROR }
    }

    pub fn shell_bound(&self, normal: f64, facet: &Facet) -> DVec3 {
        // For an ellipsoid Σn/√(nᵀΣn), Σ = diag(1, a², 1), is at most max(1, a) long. It changes by
        // at most 2 max(1, a²)/min(1, a) times the error of n and by 2 max(1, a) times the error of
        // a; eight more roundings, and the root's.
        let (wide, narrow) = (self.shape.widest(), self.shape.narrowest());
        let is_ball = self.shape == Shape::BALL;
        let steep = if is_ball { 1.0 } else { 2.0 * wide.powi(2) / narrow };
        let more = if is_ball { 0.0 } else { 8.0 + LENGTH_ERROR + DIVISION_ERROR };
        // Axes that are off change n along them, and the way back.
        let normal = normal + 2.0 * self.axes_error();
        let shell = SHELL_SIGMA * (self.scale + self.scale_error) * wide;
        // 1.5σ, its product with n, and the sum.
        let inherited = self.p_error
            + SHELL_SIGMA * self.scale_error * wide
            + SHELL_SIGMA * self.scale * (steep * normal + 2.0 * wide * self.aspect_error);
        let rounded = (3.0 + more) * shell + facet.position.abs() + self.p.abs() + 2.0 * inherited;
        inherited * DVec3::ONE + U * rounded
    }
}
