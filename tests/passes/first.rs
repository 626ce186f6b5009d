//! first: irradiance and radiance of every facet against the f64 reference, within a running bound.

use std::f64::consts::PI;

use crate::bounded::{Bounded, Random, U, dot, exact3, greatest_ratio};
use crate::harness::{Gpu, assert_within};
use crate::lights;
use crate::lights::{arrival, double, near_light};
use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::layout::facet::{FacetRecord, LitRecord, NO_LOBE, RegionRecord};
use nimbus::model::basis::{self, Basis, Sampling};
use nimbus::model::light::Light;
use nimbus::passes::first::{First, FirstBuffers, Push};
use nimbus::reference::first::{irradiance, radiance};

const N_FACETS: usize = 10_000;
const N_REGIONS: u32 = 7;
/// Numbers of a LitRecord.
const N_NUMBERS: usize = 16;

/// All inputs are f32 numbers, the same on both sides.
struct Case {
    facets: Vec<FacetRecord>,
    lights: Vec<Light>,
    transmittance: Vec<f32>,
    regions: Vec<RegionRecord>,
    table: Vec<f32>,
}

/// `n_near` point lights and as many spots among the facets.
fn case(n_suns: usize, n_near: usize, sky: bool) -> Case {
    let mut r = Random(n_suns as u64 + 10 * u64::from(sky) + 100 * n_near as u64);
    let mut lights: Vec<Light> = (0..n_suns)
        .map(|_| Light::Directional {
            direction: double(r.direction()),
            irradiance: double([0; 3].map(|_| r.within(0.0, 5.0))),
        })
        .collect();
    lights.extend((0..2 * n_near).map(|i| near_light(&mut r, 3.0, i % 2 == 1)));
    if sky {
        lights.insert(n_suns / 2, Light::even_sky(DVec3::new(0.25, 0.5, 1.5), 0.125));
    }
    let facet = |i: usize, r: &mut Random| FacetRecord {
        position: [0; 3].map(|_| r.within(-4.0, 4.0)),
        normal: r.direction(),
        i_region: r.word() as u32 % N_REGIONS,
        color: if i.is_multiple_of(3) { [1.0; 3] } else { [0; 3].map(|_| r.within(0.0, 1.0)) },
        ..FacetRecord::default()
    };
    let mut facets: Vec<_> = (0..N_FACETS).map(|i| facet(i, &mut r)).collect();
    facets[0].normal = [0.0, 1.0, 0.0];
    facets[1].normal = [0.0, -1.0, 0.0];
    // In the first point light itself.
    if let Some(Light::Point { position, .. }) =
        lights.iter().find(|l| matches!(l, Light::Point { .. }))
    {
        facets[2].position = position.as_vec3().to_array();
    }
    let mut transmittance: Vec<f32> =
        (0..N_FACETS * lights.len()).map(|_| r.within(0.0, 1.0)).collect();
    for (i, v) in transmittance.iter_mut().take(40).enumerate() {
        *v = (i % 2) as f32;
    }
    let mut region = || RegionRecord {
        kd: [0; 3].map(|_| r.within(0.0, 1.0)),
        i_lobe: NO_LOBE,
        ..RegionRecord::default()
    };
    let regions = (0..N_REGIONS).map(|_| region()).collect();
    Case { facets, lights, transmittance, regions, table: vec![] }
}

/// Where the facets are seen from.
const EYE: [f32; 3] = [0.5, 3.0, 1.25];

impl Case {
    fn run(&self, gpu: &mut Gpu, compiler: Option<&Compiler>) -> Vec<LitRecord> {
        let first = First::new(&gpu.device, compiler.unwrap_or(&gpu.compiler)).expect("first");
        let buffers = [
            gpu.upload(&self.facets),
            gpu.upload(&lights::records(&self.lights)),
            gpu.upload(&self.transmittance),
            gpu.upload(&self.regions),
            gpu.upload(&self.table),
            gpu.upload(&[LitRecord::default(); N_FACETS]),
        ];
        let push = Push { eye: EYE, n_facets: N_FACETS as u32, n_lights: self.lights.len() as u32 };
        let [facets, lights, transmittance, regions, table, lit] = buffers.each_ref();
        let named = FirstBuffers { facets, lights, transmittance, regions, table, lit };
        gpu.run(|rec| first.record(rec, &named, &push));
        gpu.download(&buffers[5], N_FACETS)
    }

    /// Irradiance and radiance in the order of the records' floats.
    fn truth(&self) -> Vec<f64> {
        let vectors = |of: fn(&FacetRecord) -> [f32; 3]| {
            self.facets.iter().map(|f| double(of(f))).collect::<Vec<_>>()
        };
        let (positions, normals, colors) =
            (vectors(|f| f.position), vectors(|f| f.normal), vectors(|f| f.color));
        let transmittance: Vec<f64> = self.transmittance.iter().map(|&v| f64::from(v)).collect();
        let e = irradiance(&positions, &normals, &transmittance, &self.lights);
        let kd: Vec<DVec3> = self.regions.iter().map(|r| double(r.kd)).collect();
        let i_regions: Vec<u32> = self.facets.iter().map(|f| f.i_region).collect();
        let l = radiance(&e, &i_regions, &kd, &colors);
        e.iter().zip(&l).flat_map(|(e, l)| in_order(e.to_array(), l.to_array())).collect()
    }

    fn bounds(&self) -> Vec<f64> {
        (0..N_FACETS).flat_map(|j| self.bound(j)).collect()
    }

    /// Operation by operation as Vulkan bounds them; a sum's order is left open, so that it is
    /// taken the longest way.
    fn bound(&self, j: usize) -> [f64; N_NUMBERS] {
        let facet = &self.facets[j];
        let mut e = [Bounded::exact(0.0); 3];
        for (l, light) in self.lights.iter().enumerate() {
            let v = Bounded::exact(f64::from(self.transmittance[j * self.lights.len() + l]));
            let a = arrival(light, facet.position);
            let cosine = dot(exact3(facet.normal), a.toward);
            let share = match light {
                Light::Sky { constant, .. } => v
                    .times(Bounded::exact(0.5).plus(cosine.scaled(0.5)))
                    .plus(Bounded::exact(*constant)),
                _ => v.times(a.falloff).times(cosine.at_least_0()),
            };
            for (sum, energy) in e.iter_mut().zip(light.energy().to_array()) {
                *sum = sum.plus(Bounded::exact(energy).times(share));
            }
        }
        let (kd, color) = (self.regions[facet.i_region as usize].kd, facet.color);
        let l = [0, 1, 2].map(|c| {
            let albedo =
                Bounded::exact(f64::from(kd[c])).times(Bounded::exact(f64::from(color[c])));
            albedo.times(e[c]).times(Bounded::once(1.0 / PI))
        });
        // f64's own rounding is 1e-9 of f32's.
        let b = |v: Bounded| v.error * (1.0 + 1e-6);
        in_order(e.map(b), l.map(b))
    }
}

/// The second reflection's numbers are 0 here.
fn in_order(direct: [f64; 3], first: [f64; 3]) -> [f64; N_NUMBERS] {
    let mut numbers = [0.0; N_NUMBERS];
    numbers[..3].copy_from_slice(&direct);
    numbers[8..11].copy_from_slice(&first);
    numbers
}

fn numbers(lit: &[LitRecord]) -> Vec<f64> {
    bytemuck::cast_slice::<LitRecord, f32>(lit).iter().map(|&v| f64::from(v)).collect()
}

#[test]
fn every_facet_is_lit_as_the_reference_says() {
    let mut gpu = Gpu::new();
    for (n_suns, n_near, sky) in
        [(1, 0, false), (0, 0, true), (3, 0, true), (9, 0, true), (0, 2, false), (1, 1, true)]
    {
        let what = format!("{n_suns} suns, {n_near} points and spots, sky {sky}");
        let case = case(n_suns, n_near, sky);
        let (values, truths, bounds) =
            (numbers(&case.run(&mut gpu, None)), case.truth(), case.bounds());
        println!("{what}: greatest error/bound {:.3}", greatest_ratio(&values, &truths, &bounds));
        assert_within(&what, &values, &truths, &bounds);
        // The bound itself says something: 1e-6 of full scale (9 suns of 5, and the sky); a spot's
        // narrow edge multiplies the cosine's rounding, some 20 u, by 2/(cos inner − cos outer), up
        // to 130.
        let most = |of: &[f64]| of.iter().cloned().fold(0.0, f64::max);
        let (bound, greatest) = (most(&bounds), most(&truths));
        assert!(
            bound < 5e-5 || (n_near > 0 && bound < 1.5e-4 * greatest),
            "{what}: {bound:e} of {greatest}"
        );
    }
}

#[test]
fn without_lights_it_is_dark() {
    let mut gpu = Gpu::new();
    let lit = case(0, 0, false).run(&mut gpu, None);
    assert!(lit.iter().all(|r| *r == LitRecord::default()));
}

#[test]
fn wrong_light_is_noticed() {
    let mut gpu = Gpu::new();
    let case = case(2, 1, true);
    let (truths, bounds) = (case.truth(), case.bounds());
    let mut values = numbers(&case.run(&mut gpu, None));
    assert!(greatest_ratio(&values, &truths, &bounds) <= 1.0);
    let i = N_NUMBERS * 4321 + 9;
    values[i] += 2.0 * bounds[i];
    assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "one corrupted number");
    for (file, from, to) in [
        ("include/light.glsl", "max(cosine, 0.0)", "cosine"),
        ("include/light.glsl", " + light.constant", ""),
        ("include/light.glsl", "a.falloff * ", ""),
        ("include/light.glsl", "max(d, light.radius)", "d"),
        ("include/light.glsl", "cone * cone", "cone"),
        ("include/light.glsl", "dot(toward, light.toward)", "dot(toward, -light.toward)"),
        ("include/first.glsl", "0.318309886183791", "0.3183"),
        ("include/reflect.glsl", "* facet.color", ""),
        ("include/reflect.glsl", "region_at(facet.i_region)", "region_at(0u)"),
        ("include/reflect.glsl", "j * n_lights + l", "l * push.n_facets + j"),
        (
            "include/reflect.glsl",
            "arrival_at(light, facet.position)",
            "arrival_at(light, vec3(0.0))",
        ),
    ] {
        let values = numbers(&case.run(&mut gpu, Some(&Gpu::wrong_compiler(file, from, to))));
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}

/// Suns and the sky on facets of three lobes, from the narrowest that the basis is made for on.
fn shiny_case() -> Case {
    let mut case = case(2, 0, true);
    let basis = Basis::new([1.0, 1000.0], 12, Sampling::Log);
    case.table =
        [3.0, 60.0, 1000.0].iter().flat_map(|ns| basis.lobe(*ns)).map(|v| v as f32).collect();
    for (region, i) in case.regions.iter_mut().zip(0u32..) {
        region.ks = [0.25, 0.5, 0.125 * i as f32];
        region.i_lobe = if i < 3 { i } else { NO_LOBE };
    }
    case
}

/// L1 of the lobes alone, and a bound on what f32 may make of it.
fn shine(case: &Case, j: usize) -> [(f64, f64); 3] {
    let facet = &case.facets[j];
    let region = &case.regions[facet.i_region as usize];
    let (n, p) = (double(facet.normal), double(facet.position));
    let out = (double(EYE) - p).normalize();
    let mut sums = [(0.0, 0.0); 3];
    if region.i_lobe == NO_LOBE || n.dot(out) <= 0.0 {
        return sums;
    }
    let table: Vec<f64> = case.table[region.i_lobe as usize * basis::N_NODES..][..basis::N_NODES]
        .iter()
        .map(|v| f64::from(*v))
        .collect();
    for (l, light) in case.lights.iter().enumerate().filter(|(_, light)| !light.is_sky()) {
        let a = light.arrival(p);
        let v = f64::from(case.transmittance[j * case.lights.len() + l]);
        let share = light.share(n, &a, v);
        let sum = a.toward + out;
        let chord = (n - sum.normalize()).length();
        // Directions err by 4 roundings and what their sum cancels; the chord by that and its own
        // 4; the place in the table by 4 of t, which is at most 1, a thousand cells wide.
        let off = U * (16.0 / sum.length() + 8.0);
        let at = |chord: f64| basis::evaluate(&table, 0.5 * chord * chord);
        let lobe = at(chord);
        let cell = |c: f64| (at(c * (1.0 + 16.0 * U)) - at(c * (1.0 - 16.0 * U))).abs();
        let turned = (at(chord + off) - lobe).abs().max((at((chord - off).max(0.0)) - lobe).abs());
        let lobe_off = turned + cell(chord) + 8.0 * U * lobe.abs();
        // A cosine errs by 6 roundings of 1; then come V, E, K_s and the sums.
        let share_off = U * (6.0 * v + 12.0 * share);
        for (c, (value, bound)) in sums.iter_mut().enumerate() {
            let e = f64::from(region.ks[c]) * light.energy()[c];
            *value += e * share * lobe;
            *bound += e * (share_off * (lobe.abs() + lobe_off) + share * lobe_off);
        }
    }
    sums
}

#[test]
fn lobes_shine_toward_the_eye_from_the_front_side() {
    let mut gpu = Gpu::new();
    let case = shiny_case();
    let (plain, bounds) = (case.truth(), case.bounds());
    let expect = |j: usize, c: usize| {
        let (value, bound) = shine(&case, j)[c];
        let i = N_NUMBERS * j + 8 + c;
        (plain[i] + value, bounds[i] + bound + 4.0 * U * (plain[i] + value.abs()))
    };
    let (truths, limits): (Vec<f64>, Vec<f64>) =
        (0..3 * N_FACETS).map(|i| expect(i / 3, i % 3)).unzip();
    let first =
        |lit: &[LitRecord]| lit.iter().flat_map(|l| l.first.map(f64::from)).collect::<Vec<f64>>();
    let values = first(&case.run(&mut gpu, None));
    println!("greatest error/bound {:.3}", greatest_ratio(&values, &truths, &limits));
    assert_within("L1 with lobes", &values, &truths, &limits);
    let lit_up = (0..N_FACETS).filter(|j| shine(&case, *j)[1].0 > 0.0).count();
    assert!(lit_up > N_FACETS / 20, "{lit_up} facets shine");
    for (file, from, to) in [
        ("include/reflect.glsl", "dot(outgoing, facet.normal) > 0.0", "true"),
        ("include/reflect.glsl", "a.toward, outgoing", "outgoing, outgoing"),
        ("include/reflect.glsl", "light.kind == LIGHT_SKY ? 0u : n_shiny", "n_shiny"),
        ("include/lobe.glsl", "t - float(i)", "0.0"),
        ("include/lobe.glsl", "0.5 * dot(chord, chord)", "0.501 * dot(chord, chord)"),
    ] {
        let compiler = Gpu::wrong_compiler(file, from, to);
        let values = first(&case.run(&mut gpu, Some(&compiler)));
        assert!(greatest_ratio(&values, &truths, &limits) > 1.0, "{from} as {to}");
    }
}
