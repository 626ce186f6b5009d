//! transmit: the march of every facet toward every light against the same march in f64, within a running bound.

#[path = "harness/bounded.rs"]
mod bounded;
mod harness;

use bounded::{Bounded, Random, greatest_ratio};
use glam::{DVec3, IVec3};
use harness::{Gpu, assert_within};
use nimbus::gpu::Compiler;
use nimbus::layout::facet::FacetRecord;
use nimbus::layout::frame::{GridRecord, LightRecord};
use nimbus::model::grid::GridSpec;
use nimbus::model::light::Light;
use nimbus::passes::{self, transmit::Transmit};
use nimbus::reference::{Blob, grid::deposit, transmit};

/// All inputs are f32 numbers, the same on both sides.
struct Case {
    spec: GridSpec,
    density: Vec<f32>,
    positions: Vec<[f32; 3]>,
    lights: Vec<Light>,
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

/// Blobs in a slab of cells that are no power of two, suns from all sides and the sky.
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
    // Inside the grid's box, clear of its faces by more than they are rounded: 1e-4 against 1e-6.
    let position = |r: &mut Random| [0, 1, 2].map(|i| r.within(low[i] + 1e-4, high[i] - 1e-4));
    let positions = (0..700).map(|_| position(&mut r)).collect();
    let mut lights: Vec<Light> = (0..4).map(|_| sun(double(r.direction()))).collect();
    lights.push(Light::Sky { irradiance: DVec3::ONE, constant: 0.5 });
    lights.push(sun(DVec3::Z));
    Case { spec, density, positions, lights }
}

fn sun(direction: DVec3) -> Light {
    Light::Directional { direction, irradiance: DVec3::ONE }
}

impl Case {
    fn run(&self, gpu: &mut Gpu, compiler: Option<&Compiler>, step: f64, forward: f64) -> Vec<f64> {
        let pass = Transmit::new(&gpu.device, compiler.unwrap_or(&gpu.compiler)).expect("transmit");
        let facet = |&position: &[f32; 3]| FacetRecord { position, ..FacetRecord::default() };
        let facets = gpu.upload(&self.positions.iter().map(facet).collect::<Vec<_>>());
        let lights = gpu.upload(&self.lights.iter().map(|l| LightRecord::new(l, DVec3::ZERO)).collect::<Vec<_>>());
        let density = gpu.upload(&self.density);
        let n = [self.positions.len() as u32, self.lights.len() as u32];
        let n_total = self.positions.len() * self.lights.len();
        let out = gpu.buffer::<f32>(n_total);
        let grid = GridRecord::from(&self.spec);
        gpu.run(|rec| pass.record(rec, [&facets, &lights, &density, &out], &grid, n, step, forward));
        gpu.download::<f32>(&out, n_total).into_iter().map(f64::from).collect()
    }

    fn cells(&self) -> Vec<f64> {
        self.density.iter().map(|&v| f64::from(v)).collect()
    }

    fn truth(&self, step: f64, forward: f64) -> Vec<f64> {
        let positions: Vec<DVec3> = self.positions.iter().map(|&p| double(p)).collect();
        transmit::transmittance(&self.spec, &self.cells(), &positions, &self.lights, forward, step)
    }

    fn bounds(&self, step: f64, forward: f64) -> Vec<f64> {
        let cells = self.cells();
        let one = |&p: &[f32; 3], l: &Light| {
            let tau = self.depth(&cells, double(p), l.arrival(double(p)).toward, step);
            let depth = tau.times(Bounded::once(1.0 - forward));
            // Transmittance through nothing is exact by the shader's own test.
            if depth.value + depth.error > 0.0 { depth.scaled(-1.0).exp().error * (1.0 + 1e-6) } else { 0.0 }
        };
        self.positions.iter().flat_map(|p| self.lights.iter().map(move |l| one(p, l))).collect()
    }

    /// Distance to the box's face: high = low + cell·n, then a difference and a quotient, the least of three.
    fn exit(&self, p: DVec3, d: DVec3) -> Bounded {
        let exact = Bounded::exact;
        let sides = (0..3).filter(|&i| d[i] != 0.0).map(|i| {
            let n = f64::from(self.spec.n_cells[i]);
            let high = exact(self.spec.low[i]).plus(exact(self.spec.cell).times(exact(n)));
            let side = if d[i] > 0.0 { high } else { exact(self.spec.low[i]) };
            side.minus(exact(p[i])).over(exact(d[i]))
        });
        let sides: Vec<Bounded> = sides.collect();
        let value = sides.iter().map(|s| s.value).fold(f64::INFINITY, f64::min);
        let low = sides.iter().map(|s| s.value - s.error).fold(f64::INFINITY, f64::min);
        let high = sides.iter().map(|s| s.value + s.error).fold(f64::INFINITY, f64::min);
        Bounded { value, error: (value - low).max(high - value) }
    }

    /// τ of a march, term by term.
    fn depth(&self, cells: &[f64], p: DVec3, d: DVec3, step: f64) -> Bounded {
        if transmit::exit_distance(&self.spec, p, d) == 0.0 {
            return Bounded::exact(0.0);
        }
        let length = self.exit(p, d);
        let s = Bounded::once(step * self.spec.cell);
        let n = transmit::n_steps(&self.spec, length.value, step);
        let mut tau = Bounded::exact(0.0);
        let mut last_error = 0.0;
        for k in 0..n {
            let start = s.times(Bounded::exact(f64::from(k)));
            let rest = length.minus(start);
            let ds = if s.value <= rest.value { s } else { rest };
            // The lesser of two errs no more than they.
            let ds = Bounded { error: s.error.max(rest.error), ..ds };
            let at = start.plus(ds.scaled(0.5));
            let x = [0, 1, 2].map(|i| Bounded::exact(p[i]).plus(at.times(Bounded::exact(d[i]))));
            let rho = self.density_at(cells, x);
            tau = tau.plus(rho.times(ds));
            last_error = rho.value * (rest.error + s.error) + rho.error * s.value;
        }
        // A length beside a multiple of the step: one step more or less, no longer than the error of the rest. A last
        // step that the f64 side has and the other lacks is in `last_error` when it is that short; one that only
        // the other has meets the density beyond it, where the margin is empty.
        let steps = length.value / s.value;
        let beside = (steps - steps.round()).abs() * s.value <= length.error + s.error * (steps + 1.0);
        Bounded { error: tau.error + if beside { last_error } else { 0.0 }, ..tau }
    }

    /// Trilinear density: what the position's error makes of it, by the steepest slope among the cells around; and the
    /// rounding of three levels of (1 − f) a + f b, three operations each, of numbers that are not negative.
    fn density_at(&self, cells: &[f64], x: [Bounded; 3]) -> Bounded {
        let value = nimbus::reference::grid::sample(&self.spec, cells, DVec3::from(x.map(|x| x.value)));
        let exact = Bounded::exact;
        let g = [0, 1, 2].map(|i| {
            let offset = x[i].minus(exact(self.spec.low[i]));
            offset.times(Bounded::once(1.0 / self.spec.cell)).minus(exact(0.5))
        });
        let base = IVec3::from(g.map(|g| g.value.floor() as i32));
        let (slopes, any) = self.slopes(cells, base);
        let moved: f64 = (0..3).map(|i| slopes[i] * g[i].error).sum();
        let rounding = if any { 9.0 * bounded::U * (value + moved) * (1.0 + 1e-5) + 1e-37 } else { 0.0 };
        Bounded { value, error: moved + rounding }
    }

    /// Greatest difference of neighbours along each axis among the 4³ cells around, and whether any holds something.
    fn slopes(&self, cells: &[f64], base: IVec3) -> ([f64; 3], bool) {
        let n = self.spec.n_cells.as_ivec3();
        let cell = |at: IVec3| {
            let inside = at.cmpge(IVec3::ZERO).all() && at.cmplt(n).all();
            if inside { cells[(at.x + n.x * (at.y + n.y * at.z)) as usize] } else { 0.0 }
        };
        let mut slopes = [0f64; 3];
        let mut any = false;
        for k in 0..64 {
            let at = base + IVec3::new(k % 4, k / 4 % 4, k / 16) - 1;
            let here = cell(at);
            any |= here > 0.0;
            for (axis, slope) in slopes.iter_mut().enumerate() {
                if at[axis] < base[axis] + 2 {
                    *slope = slope.max((cell(at + IVec3::AXES[axis]) - here).abs());
                }
            }
        }
        (slopes, any)
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
        let (values, truths, bounds) =
            (case.run(&mut gpu, None, step, forward), case.truth(step, forward), case.bounds(step, forward));
        let what = format!("step {step}, forward {forward}");
        let most = bounds.iter().cloned().fold(0.0, f64::max);
        println!("{what}: greatest error/bound {:.3}, bound {most:.1e}", greatest_ratio(&values, &truths, &bounds));
        assert_within(&what, &values, &truths, &bounds);
        // The bound itself says something, and so do the inputs: shade and light both occur.
        assert!(most < 1e-3);
        assert!(truths.contains(&1.0) && (step > 10.0 || truths.iter().any(|v| *v < 0.8)));
    }
}

#[test]
fn a_march_ends_at_its_cap_of_steps() {
    let mut gpu = Gpu::new();
    let mut case = case();
    case.positions.truncate(40);
    // 4096 steps of 0.002 cells reach 8 of some 40 cells.
    let step = 0.002;
    let (values, truths, bounds) = (case.run(&mut gpu, None, step, 0.0), case.truth(step, 0.0), case.bounds(step, 0.0));
    println!("cap: greatest error/bound {:.3}", greatest_ratio(&values, &truths, &bounds));
    assert_within("cap", &values, &truths, &bounds);
    let whole = case.truth(0.5, 0.0);
    assert!(truths.iter().zip(&whole).any(|(a, b)| a - b > 0.01), "the cap cuts something off");
}

#[test]
fn nothing_on_the_way_is_exactly_one() {
    let mut gpu = Gpu::new();
    let mut case = case();
    assert!(case.run(&mut gpu, None, 0.5, 1.0).iter().all(|v| *v == 1.0), "all light goes forward");
    let n_lights = case.lights.len();
    let (low, high) = (case.spec.low, case.spec.high());
    let mut outside = Vec::new();
    for axis in 0..3 {
        for x in [low[axis] - 1e-3, high[axis] + 1e-3, low[axis] - 1e6, high[axis] + 1e6] {
            let mut p = (0.5 * (low + high)).as_vec3();
            p[axis] = x as f32;
            outside.push(p.to_array());
        }
    }
    case.positions = outside;
    assert_eq!(case.run(&mut gpu, None, 0.5, 0.0), vec![1.0; 12 * n_lights], "outside");
    case = self::case();
    case.density.fill(0.0);
    assert!(case.run(&mut gpu, None, 0.5, 0.0).iter().all(|v| *v == 1.0), "no density");
}

#[test]
fn wrong_transmittance_is_noticed() {
    let mut gpu = Gpu::new();
    let case = case();
    // A long step, so that the last and shorter one is not in the empty margin.
    let (step, forward) = (3.7, 0.5);
    let (truths, bounds) = (case.truth(step, forward), case.bounds(step, forward));
    let mut values = case.run(&mut gpu, None, step, forward);
    assert!(greatest_ratio(&values, &truths, &bounds) <= 1.0);
    let shaded = truths.iter().position(|v| *v < 0.9).expect("a shaded facet");
    values[shaded] += 2.0 * bounds[shaded];
    assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "one corrupted number");
    for (file, from, to) in [
        ("transmit.comp", "(t0 + 0.5 * ds)", "t0"),
        ("transmit.comp", "min(push.step_length, length_total - t0)", "push.step_length"),
        ("transmit.comp", "push.backward * tau", "tau"),
        ("transmit.comp", "k / push.n_lights", "k % push.n_facets"),
        ("include/density.glsl", "inv_cell - 0.5", "inv_cell"),
        ("include/density.glsl", "density[c + 1]", "density[c]"),
        ("include/density.glsl", "n.x * n.y;", "n.x * n.z;"),
    ] {
        let mut sources = passes::sources();
        assert!(sources.replace(file, from, to), "{from}");
        let compiler = Compiler::new(sources, None).expect("shaderc");
        let values = case.run(&mut gpu, Some(&compiler), step, forward);
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}
