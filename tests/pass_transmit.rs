//! transmit: the way of every light to every facet, past rectangles and through the grid, against the same in f64, within
//! a running bound.

#[path = "harness/bounded.rs"]
mod bounded;
mod harness;
#[path = "harness/lights.rs"]
mod lights;
#[path = "harness/march.rs"]
mod march;
#[path = "harness/occlusion.rs"]
mod occlusion;

use bounded::{Bounded, Random, greatest_ratio};
use glam::DVec3;
use harness::{Gpu, assert_within};
use lights::{double, near_light};
use march::March;
use nimbus::gpu::{Buffer, Compiler};
use nimbus::layout::facet::{FacetRecord, NO_LOBE, RegionRecord};
use nimbus::layout::frame::GridRecord;
use nimbus::model::grid::GridSpec;
use nimbus::model::light::Light;
use nimbus::model::material::Brdf;
use nimbus::model::surface::Surface;
use nimbus::passes::transmit::Transmit;
use nimbus::reference::{Blob, grid::deposit, occlude::Rectangle, transmit};
use occlusion::{Verdict, verdict};

/// All inputs are f32 numbers, the same on both sides.
struct Case {
    spec: GridSpec,
    density: Vec<f32>,
    surfaces: Vec<Surface>,
    facets: Vec<FacetRecord>,
    lights: Vec<Light>,
}

/// The region of the clouds' facets, whatever the number of surfaces.
const CLOUD: u32 = 100;

fn in_cloud(position: [f32; 3]) -> FacetRecord {
    FacetRecord { position, i_region: CLOUD, ..FacetRecord::default() }
}

/// Blobs in a slab of cells that are no power of two, suns from all sides and the sky. Facets inside the grid.
fn case() -> Case {
    let mut r = Random(21);
    let blobs: Vec<Blob> = (0..25)
        .map(|_| Blob {
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
    let fit = GridSpec::fit(DVec3::new(-3.0, -1.0, -2.0) - reach, DVec3::new(3.0, 1.0, 2.0) + reach, 48);
    let spec = GridSpec { cell: f64::from(fit.cell as f32), low: fit.low.as_vec3().as_dvec3(), ..fit };
    let density = deposit(&spec, &blobs).iter().map(|&v| v as f32).collect();
    let (low, high) = (spec.low, spec.high());
    let position = |r: &mut Random| [0, 1, 2].map(|i| r.within(low[i] + 1e-4, high[i] - 1e-4));
    let facets = (0..700).map(|_| in_cloud(position(&mut r))).collect();
    let mut lights: Vec<Light> = (0..4).map(|_| sun(double(r.direction()))).collect();
    lights.push(Light::Sky { irradiance: DVec3::ONE, constant: 0.5 });
    lights.push(sun(DVec3::Z));
    Case { spec, density, surfaces: vec![], facets, lights }
}

fn sun(direction: DVec3) -> Light {
    Light::Directional { direction, irradiance: DVec3::ONE }
}

/// A corner of three walls around the cloud, tilted plates inside and outside of it; facets on all of them, in the cloud
/// and far out; lamps and spots among them.
fn room() -> Case {
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
        // The last one small and far out: its facets' rounded centres do not lie in its plane.
        let (scale, reach) = if i < 5 { (f64::from(r.within(0.5, 1.5)), 4.0) } else { (0.05, 60.0) };
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
    case.lights.push(Light::Sky { irradiance: DVec3::X, constant: 0.5 });
    case.lights.push(Light::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ZERO });
    case
}

impl Case {
    /// Transmittances, and what clouds alone let through.
    fn run(&self, gpu: &mut Gpu, compiler: Option<&Compiler>, step: f64, forward: f64) -> [Vec<f64>; 2] {
        let pass = Transmit::new(&gpu.device, compiler.unwrap_or(&gpu.compiler), true).expect("transmit");
        let n_total = self.facets.len() * self.lights.len();
        let through = gpu.buffer::<f32>(n_total);
        let transmittance = self.dispatch(gpu, &pass, &through, [step, forward]);
        [transmittance, gpu.download::<f32>(&through, n_total).into_iter().map(f64::from).collect()]
    }

    fn dispatch(&self, gpu: &mut Gpu, pass: &Transmit, through: &Buffer, [step, forward]: [f64; 2]) -> Vec<f64> {
        let brdf = Brdf { kd: DVec3::ONE, ks: DVec3::ZERO, ns: 1.0 };
        let region = |s: &Surface| RegionRecord::surface(s, DVec3::ZERO, &brdf, NO_LOBE, 0);
        let facets = gpu.upload(&self.facets);
        let lights = gpu.upload(&lights::records(&self.lights));
        let regions = gpu.upload(&self.surfaces.iter().map(region).collect::<Vec<_>>());
        let density = gpu.upload(&self.density);
        let n = [self.facets.len(), self.lights.len(), self.surfaces.len()].map(|n| n as u32);
        let n_total = self.facets.len() * self.lights.len();
        let out = gpu.buffer::<f32>(n_total);
        let grid = GridRecord::from(&self.spec);
        gpu.run(|rec| pass.record(rec, [&facets, &lights, &regions, &density, &out, through], &grid, n, step, forward));
        gpu.download::<f32>(&out, n_total).into_iter().map(f64::from).collect()
    }

    fn cells(&self) -> Vec<f64> {
        self.density.iter().map(|&v| f64::from(v)).collect()
    }

    fn truth(&self, step: f64, forward: f64) -> [Vec<f64>; 2] {
        let receiver = |f: &FacetRecord| transmit::Receiver { position: double(f.position), i_region: f.i_region };
        let receivers: Vec<_> = self.facets.iter().map(receiver).collect();
        let rectangles: Vec<_> = self.surfaces.iter().map(|s| Rectangle::new(s, DVec3::ZERO)).collect();
        let cells = self.cells();
        let all = transmit::Obstacles { spec: &self.spec, cells: &cells, rectangles: &rectangles, step, forward };
        [all.transmittance(&receivers, &self.lights), all.through(&receivers, &self.lights)]
    }

    /// Bounds of both, and how many decisions rounding may turn: there the bound is what the decision is worth.
    fn bounds(&self, step: f64, forward: f64) -> ([Vec<f64>; 2], usize) {
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
            let tau = march.depth(f.position, l, step);
            let depth = tau.times(Bounded::once(1.0 - forward));
            // Transmittance through nothing is exact by the shader's own test.
            let through = if depth.value + depth.error > 0.0 { depth.scaled(-1.0).exp() } else { Bounded::exact(1.0) };
            let at_center = verdict(&self.surfaces, f.i_region, double(f.position).to_array().map(Bounded::exact), l);
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

#[test]
fn marches_agree_with_the_reference_at_every_step_size() {
    let mut gpu = Gpu::new();
    let case = case();
    // The outermost cells hold nothing: without that the density would jump at the hull of the centres.
    let n = case.spec.n_cells.as_usizevec3();
    let outer = |i: usize| {
        let at = [i % n.x, i / n.x % n.y, i / (n.x * n.y)];
        (0..3).any(|k| at[k] == 0 || at[k] + 1 == n.to_array()[k])
    };
    assert!((0..case.density.len()).all(|i| !outer(i) || case.density[i] == 0.0));
    for (step, forward) in [(0.5, 0.0), (0.5, 0.85), (1.0, 0.0), (0.1, 0.0), (3.7, 0.0), (1000.0, 0.0)] {
        let ([values, through], [truths, _]) = (case.run(&mut gpu, None, step, forward), case.truth(step, forward));
        let ([bounds, _], n_unsure) = case.bounds(step, forward);
        let what = format!("step {step}, forward {forward}");
        let most = bounds.iter().cloned().fold(0.0, f64::max);
        println!("{what}: greatest error/bound {:.3}, bound {most:.1e}", greatest_ratio(&values, &truths, &bounds));
        assert_within(&what, &values, &truths, &bounds);
        // The bound itself says something, and so do the inputs: shade and light both occur.
        assert!(most < 1e-3 && n_unsure == 0);
        assert!(truths.contains(&1.0) && (step > 10.0 || truths.iter().any(|v| *v < 0.8)));
        assert_eq!(through, values, "nothing but the cloud is in the way");
    }
}

#[test]
fn rectangles_hide_and_marches_begin_and_end_where_the_way_does() {
    let mut gpu = Gpu::new();
    let case = room();
    for (step, forward) in [(0.5, 0.0), (1.0, 0.85), (3.7, 0.0)] {
        let (values, truths) = (case.run(&mut gpu, None, step, forward), case.truth(step, forward));
        let (bounds, n_unsure) = case.bounds(step, forward);
        for (k, quantity) in ["transmittance", "through"].into_iter().enumerate() {
            let what = format!("{quantity}, step {step}, forward {forward}");
            println!("{what}: greatest error/bound {:.3}", greatest_ratio(&values[k], &truths[k], &bounds[k]));
            assert_within(&what, &values[k], &truths[k], &bounds[k]);
        }
        // Of some four thousand ways, asked of nine rectangles, edges a few units long pass within some 1e-6 of hardly any;
        // ten would be a wrong bound.
        println!("{n_unsure} decisions within rounding");
        assert!(n_unsure < 10, "{n_unsure}");
        let mut sorted = bounds[0].clone();
        sorted.sort_by(f64::total_cmp);
        assert!(sorted[sorted.len() * 99 / 100] < 1e-3, "{:e}", sorted[sorted.len() * 99 / 100]);
        // All kinds occur: hidden, clear, through the cloud; hidden facets behind it.
        let share = |of: &dyn Fn(f64) -> bool| truths[0].iter().filter(|v| of(**v)).count() * 100 / truths[0].len();
        let (hidden, clear, dimmed) = (share(&|v| v == 0.0), share(&|v| v == 1.0), share(&|v| v > 0.0 && v < 0.9));
        assert!(hidden > 10 && clear > 10 && dimmed > 5, "{hidden} {clear} {dimmed}");
        let behind = |(v, s): (&f64, &f64)| *v == 0.0 && *s > 0.0 && *s < 0.9;
        assert!(truths[0].iter().zip(&truths[1]).filter(|(v, s)| behind((v, s))).count() > 30);
    }
}

#[test]
fn by_itself_the_transmittance_is_the_same() {
    let mut gpu = Gpu::new();
    let case = room();
    let pass = Transmit::new(&gpu.device, &gpu.compiler, false).expect("transmit");
    let none = gpu.buffer::<f32>(0);
    let alone = case.dispatch(&mut gpu, &pass, &none, [1.0, 0.5]);
    assert_eq!(alone, case.run(&mut gpu, None, 1.0, 0.5)[0]);
}

#[test]
fn a_march_ends_at_its_cap_of_steps() {
    let mut gpu = Gpu::new();
    let mut case = case();
    case.facets.truncate(40);
    // 4096 steps of 0.002 cells reach 8 of some 40 cells.
    let step = 0.002;
    let ([values, _], [truths, _]) = (case.run(&mut gpu, None, step, 0.0), case.truth(step, 0.0));
    let ([bounds, _], _) = case.bounds(step, 0.0);
    println!("cap: greatest error/bound {:.3}", greatest_ratio(&values, &truths, &bounds));
    assert_within("cap", &values, &truths, &bounds);
    let whole = &case.truth(0.5, 0.0)[0];
    assert!(truths.iter().zip(whole).any(|(a, b)| a - b > 0.01), "the cap cuts something off");
}

#[test]
fn nothing_on_the_way_is_exactly_one() {
    let mut gpu = Gpu::new();
    let mut case = case();
    assert!(case.run(&mut gpu, None, 0.5, 1.0)[0].iter().all(|v| *v == 1.0), "all light goes forward");
    // Past the box on every side, and away from it.
    let (low, high) = (case.spec.low, case.spec.high());
    let mut outside = Vec::new();
    for x in [low.x - 1e-3, high.x + 1e-3, low.x - 1e6, high.x + 1e6] {
        let mut p = (0.5 * (low + high)).as_vec3();
        p.x = x as f32;
        outside.push(in_cloud(p.to_array()));
    }
    case.facets = outside;
    case.lights = vec![sun(DVec3::NEG_Y), sun(DVec3::Z), Light::Sky { irradiance: DVec3::ONE, constant: 0.0 }];
    assert_eq!(case.run(&mut gpu, None, 0.5, 0.0)[0], [1.0; 12], "past the box");
    case.lights = vec![sun(DVec3::X)];
    let through = &case.run(&mut gpu, None, 0.5, 0.0)[0];
    assert!(through[0] == 1.0 && through[2] == 1.0 && through[1] < 1.0 && through[3] < 1.0, "{through:?}");
    case = self::case();
    case.density.fill(0.0);
    assert!(case.run(&mut gpu, None, 0.5, 0.0)[0].iter().all(|v| *v == 1.0), "no density");
}

#[test]
fn wrong_transmittance_is_noticed() {
    let mut gpu = Gpu::new();
    let case = room();
    // A long step, so that the last and shorter one is not in the empty margin.
    let (step, forward) = (3.7, 0.5);
    let (truths, (bounds, _)) = (case.truth(step, forward), case.bounds(step, forward));
    let ratio = |values: &[Vec<f64>; 2], k: usize| greatest_ratio(&values[k], &truths[k], &bounds[k]);
    let mut values = case.run(&mut gpu, None, step, forward);
    assert!(ratio(&values, 0) <= 1.0 && ratio(&values, 1) <= 1.0);
    for k in [0, 1] {
        let shaded = truths[k].iter().position(|v| *v > 0.1 && *v < 0.9).expect("a shaded facet");
        values[k][shaded] += 2.0 * bounds[k][shaded];
        assert!(ratio(&values, k) > 1.0, "one corrupted number");
    }
    // What is wrong in the transmittance (0), and what in the clouds' part alone (1).
    for (k, file, from, to) in [
        (0, "transmit.comp", "(t0 + 0.5 * ds)", "t0"),
        (0, "transmit.comp", "min(WEIGHT(push.step_length), length_total - t0)", "push.step_length"),
        (0, "transmit.comp", "push.backward * tau", "tau"),
        (0, "transmit.comp", "k / push.n_lights", "k % push.n_facets"),
        (0, "transmit.comp", "leave = distance", "leave = 3.4e38"),
        (0, "transmit.comp", "enter = max(enter, min(a, b))", "enter = enter"),
        (0, "include/reach.glsl", "i != i_own && ", ""),
        (0, "include/reach.glsl", "light.kind == LIGHT_POINT ?", "light.kind == 77 ?"),
        (0, "include/reach.glsl", "i = 0; i < n_surfaces", "i = 1; i < n_surfaces"),
        (0, "transmit.comp", "bool is_on = any", "bool is_on = true || any"),
        (1, "transmit.comp", "through[k] = dimmed", "through[k] = is_center_clear ? dimmed : 0.0"),
        (0, "include/occlude.glsl", "<= dot(r.v, r.v)", "<= dot(r.u, r.u)"),
        (0, "include/occlude.glsl", "(a / (a - b))", "(a / (a + b))"),
        (0, "include/occlude.glsl", "p - d * (a / b)", "p + d * (a / b)"),
        (0, "include/occlude.glsl", "? e : 0.0", "? e : 1e-30"),
        (0, "include/density.glsl", "push.grid.low) - 0.5", "push.grid.low)"),
        (0, "include/density.glsl", "cell_at(c + 1)", "cell_at(c)"),
        (0, "include/density.glsl", "n.x * n.y;", "n.x * n.z;"),
    ] {
        let values = case.run(&mut gpu, Some(&Gpu::wrong_compiler(file, from, to)), step, forward);
        assert!(ratio(&values, k) > 1.0, "{from} as {to}");
    }
}
