//! first: irradiance and radiance of every facet against the f64 reference, within a running bound.

#[path = "harness/bounded.rs"]
mod bounded;
mod harness;

use std::f64::consts::PI;

use bounded::{Bounded, Random, dot, exact3, greatest_ratio};
use glam::DVec3;
use harness::{Gpu, assert_within};
use nimbus::gpu::Compiler;
use nimbus::layout::facet::{FacetRecord, LitRecord};
use nimbus::layout::frame::LightRecord;
use nimbus::layout::particle::{GroupRecord, ParticleRecord};
use nimbus::model::light::Light;
use nimbus::passes::{self, first::First};
use nimbus::reference::first::{irradiance, radiance};

const N_FACETS: usize = 10_000;
const N_GROUPS: u32 = 7;

/// All inputs are f32 numbers, the same on both sides.
struct Case {
    facets: Vec<FacetRecord>,
    lights: Vec<Light>,
    transmittance: Vec<f32>,
    particles: Vec<ParticleRecord>,
    i_group: Vec<u32>,
    groups: Vec<GroupRecord>,
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

fn case(n_suns: usize, sky: bool) -> Case {
    let mut r = Random(n_suns as u64 + 10 * u64::from(sky));
    let mut lights: Vec<Light> = (0..n_suns)
        .map(|_| Light::Directional {
            direction: double(r.direction()),
            irradiance: double([0; 3].map(|_| r.within(0.0, 5.0))),
        })
        .collect();
    if sky {
        lights.insert(n_suns / 2, Light::Sky { irradiance: DVec3::new(0.25, 0.5, 1.5), constant: 0.125 });
    }
    let facet = |r: &mut Random| FacetRecord { normal: r.direction(), i_region: 0, ..FacetRecord::default() };
    let mut facets: Vec<_> = (0..N_FACETS).map(|_| facet(&mut r)).collect();
    facets[0].normal = [0.0, 1.0, 0.0];
    facets[1].normal = [0.0, -1.0, 0.0];
    let mut transmittance: Vec<f32> = (0..N_FACETS * lights.len()).map(|_| r.within(0.0, 1.0)).collect();
    for (i, v) in transmittance.iter_mut().take(40).enumerate() {
        *v = (i % 2) as f32;
    }
    let color = |r: &mut Random| [0; 3].map(|_| r.within(0.0, 1.0));
    let mut group = |i_region| GroupRecord { i_region, kd: color(&mut r), ..GroupRecord::default() };
    let groups = (0..N_GROUPS).map(&mut group).collect();
    let particle = |i: usize, r: &mut Random| {
        let color = if i.is_multiple_of(3) { [1.0; 3] } else { color(r) };
        ParticleRecord { color, sigma: 1.0, ..ParticleRecord::default() }
    };
    let particles = (0..N_FACETS).map(|i| particle(i, &mut r)).collect();
    let i_group = (0..N_FACETS).map(|_| r.word() as u32 % N_GROUPS).collect();
    Case { facets, lights, transmittance, particles, i_group, groups }
}

impl Case {
    fn run(&self, gpu: &mut Gpu, compiler: Option<&Compiler>) -> Vec<LitRecord> {
        let first = First::new(&gpu.device, compiler.unwrap_or(&gpu.compiler)).expect("first");
        let records: Vec<LightRecord> = self.lights.iter().map(LightRecord::from).collect();
        let buffers = [
            gpu.upload(&self.facets),
            gpu.upload(&records),
            gpu.upload(&self.transmittance),
            gpu.upload(&self.particles),
            gpu.upload(&self.i_group),
            gpu.upload(&self.groups),
            gpu.buffer::<LitRecord>(N_FACETS),
        ];
        let (n, n_lights) = (N_FACETS as u32, self.lights.len() as u32);
        gpu.run(|rec| first.record(rec, buffers.each_ref(), n, n_lights));
        gpu.download(&buffers[6], N_FACETS)
    }

    /// Irradiance and radiance in the order of the records' eight floats.
    fn truth(&self) -> Vec<f64> {
        let normals: Vec<DVec3> = self.facets.iter().map(|f| double(f.normal)).collect();
        let transmittance: Vec<f64> = self.transmittance.iter().map(|&v| f64::from(v)).collect();
        let e = irradiance(&normals, &transmittance, &self.lights);
        // The reference knows regions, the GPU groups: here every group is a region.
        let kd: Vec<DVec3> = self.groups.iter().map(|g| double(g.kd)).collect();
        let colors: Vec<DVec3> = self.particles.iter().map(|p| double(p.color)).collect();
        let l = radiance(&e, &self.i_group, &kd, &colors);
        e.iter().zip(&l).flat_map(|(e, l)| [e.x, e.y, e.z, 0.0, l.x, l.y, l.z, 0.0]).collect()
    }

    fn bounds(&self) -> Vec<f64> {
        (0..N_FACETS).flat_map(|j| self.bound(j)).collect()
    }

    /// Operation by operation as Vulkan bounds them; a sum's order is left open, so that it is taken the longest way.
    fn bound(&self, j: usize) -> [f64; 8] {
        let n = exact3(self.facets[j].normal);
        let mut e = [Bounded::exact(0.0); 3];
        for (l, light) in self.lights.iter().enumerate() {
            let v = Bounded::exact(f64::from(self.transmittance[j * self.lights.len() + l]));
            let cosine = dot(n, exact3(light.toward().as_vec3().to_array()));
            let share = match light {
                Light::Directional { .. } => v.times(cosine.at_least_0()),
                Light::Sky { constant, .. } => {
                    v.times(Bounded::exact(0.5).plus(cosine.scaled(0.5))).plus(Bounded::exact(*constant))
                }
            };
            for (sum, irradiance) in e.iter_mut().zip(light.irradiance().to_array()) {
                *sum = sum.plus(Bounded::exact(irradiance).times(share));
            }
        }
        let (kd, color) = (self.groups[self.i_group[j] as usize].kd, self.particles[j].color);
        let l = [0, 1, 2].map(|c| {
            let albedo = Bounded::exact(f64::from(kd[c])).times(Bounded::exact(f64::from(color[c])));
            albedo.times(e[c]).times(Bounded::once(1.0 / PI))
        });
        // f64's own rounding is 1e-9 of f32's.
        let b = |v: Bounded| v.error * (1.0 + 1e-6);
        [b(e[0]), b(e[1]), b(e[2]), 0.0, b(l[0]), b(l[1]), b(l[2]), 0.0]
    }
}

fn numbers(lit: &[LitRecord]) -> Vec<f64> {
    lit.iter().flat_map(|r| [r.irradiance, r.radiance].concat()).map(f64::from).collect()
}

#[test]
fn every_facet_is_lit_as_the_reference_says() {
    let mut gpu = Gpu::new();
    for (n_suns, sky) in [(1, false), (0, true), (3, true), (9, true)] {
        let case = case(n_suns, sky);
        let (values, truths, bounds) = (numbers(&case.run(&mut gpu, None)), case.truth(), case.bounds());
        println!("{n_suns} suns, sky {sky}: greatest error/bound {:.3}", greatest_ratio(&values, &truths, &bounds));
        assert_within(&format!("{n_suns} suns, sky {sky}"), &values, &truths, &bounds);
        // The bound itself says something: 1e-6 of full scale (9 suns of 5, and the sky).
        assert!(bounds.iter().all(|b| *b < 5e-5), "{:?}", bounds.iter().cloned().fold(0.0, f64::max));
    }
}

#[test]
fn without_lights_it_is_dark() {
    let mut gpu = Gpu::new();
    let lit = case(0, false).run(&mut gpu, None);
    assert!(lit.iter().all(|r| *r == LitRecord::default()));
}

#[test]
fn wrong_light_is_noticed() {
    let mut gpu = Gpu::new();
    let case = case(2, true);
    let (truths, bounds) = (case.truth(), case.bounds());
    let mut values = numbers(&case.run(&mut gpu, None));
    assert!(greatest_ratio(&values, &truths, &bounds) <= 1.0);
    let i = 8 * 4321 + 5;
    values[i] += 2.0 * bounds[i];
    assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "one corrupted number");
    for (from, to) in [
        ("max(cosine, 0.0)", "cosine"),
        ("0.318309886183791", "0.3183"),
        (" + light.constant", ""),
        ("particles[j].color", "particles[0].color"),
        ("groups[i_group[j]]", "groups[0]"),
        ("j * push.n_lights + l", "l * push.n_facets + j"),
    ] {
        let mut sources = passes::sources();
        assert!(sources.replace("first.comp", from, to), "{from}");
        let compiler = Compiler::new(sources, None).expect("shaderc");
        let values = numbers(&case.run(&mut gpu, Some(&compiler)));
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}
