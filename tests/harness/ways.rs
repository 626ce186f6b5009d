//! Rays of light to facets, past rectangles and through a density grid, on the device and in f64,
//! with running bounds of the device's results.

#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::DVec3;
use nimbus::gpu::{Buffer, Compiler};
use nimbus::layout::facet::{FacetRecord, NO_LOBE, RegionRecord};
use nimbus::layout::frame::GridRecord;
use nimbus::model::grid::GridSpec;
use nimbus::model::light::Light;
use nimbus::model::material::Brdf;
use nimbus::model::sums::Sums;
use nimbus::model::surface::Surface;
use nimbus::passes::transmit::{Arriving, MarchParams, Transmit, TransmitBuffers};
use nimbus::reference::{Blob, deposit::deposit, occlude::Rectangle, transmit};

use crate::bounded::{Bounded, Random};
use crate::harness::Gpu;
use crate::lights::{self, double, near_light};
use crate::march::March;
use crate::occlusion::{Verdict, verdict};
use crate::sums::PLAIN;
use nimbus::model::cloud::Shape;

/// All inputs are f32 numbers, equal on both sides.
pub struct Case {
    pub spec: GridSpec,
    pub density: Vec<f32>,
    pub surfaces: Vec<Surface>,
    pub facets: Vec<FacetRecord>,
    pub lights: Vec<Light>,
}

/// The region of the clouds' facets, independent of the number of surfaces.
const CLOUD: u32 = 100;

pub fn in_cloud(position: [f32; 3]) -> FacetRecord {
    FacetRecord { position, i_region: CLOUD, ..FacetRecord::default() }
}

/// Returns blobs in a slab of cells that are no power of two, suns from all sides and the sky. The
/// facets are inside the grid.
pub fn case() -> Case {
    case_of_cells(1.0)
}

/// Returns the same with the given aspect of blobs and cells.
pub fn case_of_cells(aspect: f64) -> Case {
    let mut r = Random(21);
    let blobs: Vec<Blob> = (0..25)
        .map(|_| Blob {
            shape: Shape::upright(aspect),
            position: DVec3::new(
                f64::from(r.within(-3.0, 3.0)),
                f64::from(r.within(-1.0, 1.0)),
                f64::from(r.within(-2.0, 2.0)),
            ),
            sigma: f64::from(r.within(0.1, 0.7)),
            kappa: f64::from(r.within(0.1, 2.0)),
        })
        .collect();
    let reach = DVec3::splat(2.1);
    let (low, high) = (DVec3::new(-3.0, -1.0, -2.0) - reach, DVec3::new(3.0, 1.0, 2.0) + reach);
    let fit = GridSpec::fit(low, high, 48, aspect);
    let aspect = f64::from(fit.aspect as f32);
    let spec = GridSpec {
        cell: f64::from(fit.cell as f32),
        low: fit.low.as_vec3().as_dvec3(),
        aspect,
        ..fit
    };
    let density = deposit(&spec, &blobs).iter().map(|&v| v as f32).collect();
    let (low, high) = (spec.low, spec.high());
    let position = |r: &mut Random| [0, 1, 2].map(|i| r.within(low[i] + 1e-4, high[i] - 1e-4));
    let facets = (0..700).map(|_| in_cloud(position(&mut r))).collect();
    let mut lights: Vec<Light> = (0..4).map(|_| sun(double(r.direction()))).collect();
    lights.push(Light::even_sky(DVec3::ONE, 0.5));
    lights.push(sun(DVec3::Z));
    Case { spec, density, surfaces: vec![], facets, lights }
}

pub fn sun(direction: DVec3) -> Light {
    Light::Directional { direction, irradiance: DVec3::ONE }
}

/// Returns a corner of three walls around the cloud, tilted rectangles inside and outside of it,
/// facets on all of them, in the cloud and far away, and lamps and spots among them.
pub fn room() -> Case {
    let mut r = Random(22);
    let mut case = case();
    let f32_of = |v: DVec3| v.as_vec3().as_dvec3();
    let surface = |center, u, v, subdivide| Surface { center, u, v, i_material: 0, subdivide };
    case.surfaces = vec![
        surface(DVec3::new(0.0, -4.5, 0.0), 6.0 * DVec3::Z, 8.0 * DVec3::X, [7, 9]),
        surface(DVec3::new(-8.0, 0.5, 0.0), 5.0 * DVec3::Y, 6.0 * DVec3::Z, [4, 4]),
        surface(DVec3::new(0.0, 0.5, -6.0), 8.0 * DVec3::X, 5.0 * DVec3::Y, [8, 3]),
    ];
    for i in 0..6 {
        let (u, other) = (double(r.direction()), double(r.direction()));
        let v = u.cross(other).normalize();
        // The last one is small and far away: its facets' rounded centres are not in its plane.
        let (scale, reach) =
            if i < 5 { (f64::from(r.within(0.5, 1.5)), 4.0) } else { (0.05, 60.0) };
        let center = double([0; 3].map(|_| r.within(-reach, reach)));
        case.surfaces.push(surface(center, f32_of(scale * u), f32_of(0.7 * scale * v), [3, 2]));
    }
    for (s, i_region) in case.surfaces.iter().zip(0u32..) {
        let record = |i| {
            let position = s.facet_center(i).as_vec3().to_array();
            FacetRecord { position, i_region, ..FacetRecord::default() }
        };
        case.facets.extend((0..s.n_facets() as u32).map(record));
    }
    case.facets.extend((0..300).map(|_| in_cloud([0; 3].map(|_| r.within(-40.0, 40.0)))));
    case.lights.truncate(3);
    case.lights.extend((0..4).map(|i| near_light(&mut r, 5.0, i % 2 == 1)));
    // On the floor, and in the cloud.
    for position in [DVec3::new(7.0, -4.5, 1.0), DVec3::new(0.5, 0.25, -0.5)] {
        case.lights.push(Light::Point { position, intensity: DVec3::ONE, radius: 0.125 });
    }
    case.lights.push(Light::even_sky(DVec3::X, 0.5));
    case.lights.push(Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ZERO });
    case
}

impl Case {
    /// Transmittances, in total and of clouds alone.
    pub fn run(
        &self,
        gpu: &mut Gpu,
        compiler: Option<&Compiler>,
        step: f64,
        forward: f64,
    ) -> [Vec<f64>; 2] {
        self.run_as(gpu, compiler, [step, forward], PLAIN)
    }

    pub fn run_as(
        &self,
        gpu: &mut Gpu,
        compiler: Option<&Compiler>,
        [step, forward]: [f64; 2],
        sums: Sums,
    ) -> [Vec<f64>; 2] {
        let compiler = compiler.unwrap_or(&gpu.compiler);
        let pass =
            Transmit::new(&gpu.device, compiler, Arriving::ShareAndClouds, &sums.into(), false)
                .expect("transmit");
        let n_total = self.facets.len() * self.lights.len();
        let through = gpu.buffer::<f32>(n_total);
        let transmittance = self.dispatch(gpu, &pass, &through, [step, forward]);
        [transmittance, gpu.download::<f32>(&through, n_total).into_iter().map(f64::from).collect()]
    }

    pub fn dispatch(
        &self,
        gpu: &mut Gpu,
        pass: &Transmit,
        through: &Buffer,
        [step, forward]: [f64; 2],
    ) -> Vec<f64> {
        let brdf = Brdf { kd: DVec3::ONE, ks: DVec3::ZERO, ns: 1.0 };
        let region = |s: &Surface| RegionRecord::surface(s, DVec3::ZERO, &brdf, NO_LOBE, 0);
        let facets = gpu.upload(&self.facets);
        let lights = gpu.upload(&lights::records(&self.lights));
        let regions = gpu.upload(&self.surfaces.iter().map(region).collect::<Vec<_>>());
        let density = gpu.upload(&self.density);
        let n = [self.facets.len(), self.lights.len(), self.surfaces.len()].map(|n| n as u32);
        let n_total = self.facets.len() * self.lights.len();
        let out = gpu.buffer::<f32>(n_total);
        let hidden = gpu.buffer::<u32>(0);
        let grid = GridRecord::from(&self.spec);
        let buffers = TransmitBuffers {
            facets: &facets,
            lights: &lights,
            regions: &regions,
            density: &density,
            transmittance: &out,
            through,
            hidden: &hidden,
        };
        let [n_facets, n_lights, n_surfaces] = n;
        let march = MarchParams {
            n_facets,
            n_lights,
            n_surfaces,
            step_cells: step,
            forward,
            n_under_sky: n_facets,
            i_first_ground: n_facets,
            n_ground: 0,
        };
        gpu.run(|rec| pass.record(rec, &buffers, &grid, &march));
        gpu.download::<f32>(&out, n_total).into_iter().map(f64::from).collect()
    }

    fn cells(&self) -> Vec<f64> {
        self.density.iter().map(|&v| f64::from(v)).collect()
    }

    pub fn truth(&self, step: f64, forward: f64) -> [Vec<f64>; 2] {
        let receiver = |f: &FacetRecord| transmit::Receiver {
            position: double(f.position),
            i_region: f.i_region,
        };
        let receivers: Vec<_> = self.facets.iter().map(receiver).collect();
        let rectangles: Vec<_> =
            self.surfaces.iter().map(|s| Rectangle::new(s, DVec3::ZERO)).collect();
        let cells = self.cells();
        let all = transmit::Obstacles {
            spec: &self.spec,
            cells: &cells,
            rectangles: &rectangles,
            step,
            forward,
        };
        [all.transmittance(&receivers, &self.lights), all.through(&receivers, &self.lights)]
    }

    /// Returns the bounds of both, and the number of decisions that rounding may change; for these
    /// the bound is the effect of the decision.
    pub fn bounds(&self, step: f64, forward: f64) -> ([Vec<f64>; 2], usize) {
        self.bounds_as(step, forward, PLAIN)
    }

    pub fn bounds_as(&self, step: f64, forward: f64, sums: Sums) -> ([Vec<f64>; 2], usize) {
        let cells = self.cells();
        let march = March { spec: &self.spec, cells: &cells };
        let mut n_unsure = 0;
        let (mut of_centers, mut of_clouds) = (vec![], vec![]);
        for (f, l) in self.facets.iter().flat_map(|f| self.lights.iter().map(move |l| (f, l))) {
            if l.energy() == DVec3::ZERO {
                of_centers.push(0.0);
                of_clouds.push(0.0);
                continue;
            }
            let tau = march.depth(f.position, l, step, sums);
            let depth = tau.times(Bounded::once(1.0 - forward));
            // The shader's own test makes transmittance through nothing exact.
            let through = if depth.value + depth.error > 0.0 {
                depth.scaled(-1.0).exp()
            } else {
                Bounded::exact(1.0)
            };
            let at_center = verdict(
                &self.surfaces,
                f.i_region,
                double(f.position).to_array().map(Bounded::exact),
                l,
            );
            n_unsure += usize::from(at_center == Verdict::Unsure);
            of_centers.push(match at_center {
                Verdict::Clear => through.error * (1.0 + 1e-6),
                Verdict::Hidden => 0.0,
                Verdict::Unsure => 1.0,
            });
            of_clouds.push(through.error * (1.0 + 1e-6));
        }
        ([of_centers, of_clouds], n_unsure)
    }
}
