//! The pass facets against its f64 reference, fed with the GPU's own density, so that this stage is
//! measured alone.

use crate::harness::{Gpu, assert_within_and_say, check_within};
use crate::shells::{
    Around, LENGTH_ERROR, N_PER_CLOUD, N_SURFACE_FACETS, REGIONS, SIGMA_MEANS, Scene, U, color,
};
use glam::{DVec3, Vec3};
use nimbus::gpu::Compiler;
use nimbus::layout::facet::FacetRecord;
use nimbus::model::cloud::{Shapes, runs};
use nimbus::reference::facet_runs::{grouped, merged};
use nimbus::reference::facets::{CONDITIONING, Facet, FacetPlace, FacetSources};
use nimbus::reference::morton;
use nimbus::reference::rounding::DIVISION_ERROR;

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
        self.labels_right
            && (0..4).all(|k| {
                check_within("", &self.values[k], &self.truths[k], &self.bounds[k]).is_ok()
            })
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
    println!(
        "normals' bounds: median {:e}, greatest {:e}",
        bounds[bounds.len() / 2],
        bounds[bounds.len() - 1]
    );
    println!(
        "by the centre {by_center}, by the gradient {by_slope}, blended {}",
        3000 - by_center - by_slope
    );
    // The bound says something (a twentieth of a degree at the median), and all three branches are
    // met.
    assert!(
        bounds[bounds.len() / 2] < 1e-3
            && by_center > 10
            && by_slope > 1000
            && by_center + by_slope < 2990
    );
    assert_eq!((made[11].area, made[12].area), (0.0, 0.0));
    assert_eq!(scene.run(&mut gpu, &compiler), (cells, made));
}

#[test]
fn facets_of_ellipsoids_are_within_their_bounds() {
    let mut gpu = Gpu::new();
    let compiler = Compiler::new(nimbus::passes::sources(), Compiler::default_cache()).unwrap();
    for (what, scene) in [
        ("flat", Scene::of_shape(0.2)),
        ("tall", Scene::of_shape(2.5)),
        ("turned", Scene::turned()),
    ] {
        let (cells, made) = scene.run(&mut gpu, &compiler);
        let compared = compare(&scene, &cells, &made);
        assert!(compared.labels_right);
        for (k, what) in QUANTITIES.into_iter().enumerate() {
            assert_within_and_say(
                what,
                &compared.values[k],
                &compared.truths[k],
                &compared.bounds[k],
            );
        }
        let mut bounds = compared.bounds[0].clone();
        bounds.sort_by(f64::total_cmp);
        println!("{what}: normals' bounds: median {:e}", bounds[bounds.len() / 2]);
        assert!(bounds[bounds.len() / 2] < 1e-2);
        for counts in [[100, 400], [1, 1499]] {
            let runs = Runs::new(&scene, counts);
            let (cells, made, _) = scene.run_groups(&mut gpu, &compiler, &runs.order, &runs.runs);
            let ratios = compare_runs(&runs.truth(&scene, &cells), &made).unwrap();
            println!("{what}, {counts:?}: error/bound {ratios:.3?}");
        }
    }
    let scene = Scene::of_shape(0.2);
    for (from, to) in [
        ("gradient /= axes;", ""),
        ("form.aspect * form.aspect * n.y", "form.aspect * n.y"),
        ("tau *= volume_of(form) / wider;", "tau *= volume_of(form);"),
        ("at = axes * d;", "at = d;"),
    ] {
        let (cells, made) =
            scene.run(&mut gpu, &Gpu::wrong_compiler("include/shell.glsl", from, to));
        assert!(!compare(&scene, &cells, &made).is_right(), "{to} was not noticed");
    }
    let scene = Scene::turned();
    for (file, from, to) in [
        ("include/turn.glsl", "q.y * q.z - q.x * q.w", "q.y * q.z + q.x * q.w"),
        ("include/shell.glsl", "gradient = form.axes * gradient;", ""),
        ("include/shell.glsl", "at = form.axes * at;", ""),
        ("include/shell.glsl", "powers.x + powers.y + powers.x * powers.y", "1.0 + 2.0 * powers.x"),
        ("include/shell.glsl", "vec3 own = n * form.axes", "vec3 own = n"),
        ("include/shell.glsl", "return form.lengths.y * form.lengths.z;", "return form.lengths.y;"),
    ] {
        let (cells, made) = scene.run(&mut gpu, &Gpu::wrong_compiler(file, from, to));
        assert!(!compare(&scene, &cells, &made).is_right(), "{to} was not noticed");
    }
    let runs = Runs::new(&scene, [100, 400]);
    for (from, to) in [
        ("* (sigma * particle.aspect_z);", "* sigma;"),
        ("0.5 * dot(squares, 1.0 - upward * upward)", "0.5 * dot(squares, upward * upward)"),
    ] {
        let compiler = Gpu::wrong_compiler("facets_groups.comp", from, to);
        let (cells, made, _) = scene.run_groups(&mut gpu, &compiler, &runs.order, &runs.runs);
        assert!(compare_runs(&runs.truth(&scene, &cells), &made).is_err(), "{to} was not noticed");
    }
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
        ("facets.comp", "particle.color", "PARTICLE_AT(0u).color"),
        ("facets.comp", "push.i_first_facet + i]", "push.i_first_facet + (i + 1) % push.n_facets]"),
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

/// The blobs in Morton order cloud by cloud, and the runs of places that facets stand for.
struct Runs {
    order: Vec<u32>,
    runs: Vec<(u64, u64)>,
}

impl Runs {
    /// `counts`: facets of each cloud.
    fn new(scene: &Scene, counts: [u64; 2]) -> Runs {
        let n = u64::from(N_PER_CLOUD);
        let (mut order, mut all) = (vec![], vec![]);
        for (first, count) in [(0, counts[0]), (n, counts[1])] {
            let blobs = &scene.blobs[first as usize..(first + n) as usize];
            let positions: Vec<DVec3> = blobs.iter().map(|b| b.position).collect();
            let bounds = [(DVec3::splat(-8.0), DVec3::splat(8.0))];
            order.extend(
                morton::order(&positions, &vec![0; blobs.len()], &bounds)
                    .iter()
                    .map(|i| i + first as u32),
            );
            all.extend(runs(n, count).map(|(a, b)| (first + a, first + b)));
        }
        Runs { order, runs: all }
    }

    fn members(&self, g: usize) -> &[u32] {
        &self.order[self.runs[g].0 as usize..self.runs[g].1 as usize]
    }

    /// The reference's facets and colours, and the bounds: normal, position, area, colour.
    fn truth(&self, scene: &Scene, cells: &[f64]) -> Vec<(Facet, DVec3, [f64; 4])> {
        let means: Vec<f64> =
            scene.i_group.iter().map(|g| f64::from(SIGMA_MEANS[*g as usize])).collect();
        let regions: Vec<u32> = scene.i_group.iter().map(|g| REGIONS[*g as usize]).collect();
        let colors: Vec<DVec3> =
            scene.blobs.iter().map(|b| Vec3::from(color(b)).as_dvec3()).collect();
        let members = FacetSources {
            blobs: &scene.blobs,
            sigma_means: &means,
            regions: &regions,
            colors: &colors,
            place: FacetPlace::Shell,
        };
        let facets =
            grouped(&scene.spec, cells, &members, &scene.centers(), &self.order, &self.runs);
        let bounded = |(g, (facet, color)): (usize, (Facet, DVec3))| {
            (facet, color, run_bounds(scene, cells, &members, self.members(g), &facet))
        };
        facets.into_iter().enumerate().map(bounded).collect()
    }
}

/// Bounds on normal, position (the greatest axis), area and colour of the facet of `run`. A mean
/// about the first member, of n numbers at most D from it by weights of relative error w: the
/// weights' errors enter above and below, each sum rounds n times, and difference, product and
/// quotient follow; what it is added to rounds once.
fn run_bounds(
    scene: &Scene,
    cells: &[f64],
    m: &FacetSources<'_>,
    run: &[u32],
    facet: &Facet,
) -> [f64; 4] {
    let n = run.len() as f64;
    let mean = |weight: f64, reach: f64, value: f64| {
        (2.0 * weight + (2.0 * n + 3.0 + DIVISION_ERROR) * U) * reach + U * (value + reach)
    };
    let greatest =
        |of: &dyn Fn(usize) -> f64| run.iter().map(|i| of(*i as usize)).fold(0.0, f64::max);
    let ellipsoids = scene.shapes() > Shapes::Balls;
    let (b, first) = (merged(m, run, ellipsoids), run[0] as usize);
    // κσ³a, and b where axes are turned: five products.
    let by_mass = 5.0 * U;
    let reach = greatest(&|i| (m.blobs[i].position - m.blobs[first].position).length());
    let p_error = if run.len() == 1 { 0.0 } else { mean(by_mass, reach, b.position.length()) };
    // σ² + |p − p̄|²/3: p̄'s error and the difference's rounding enter the square, whose five
    // operations and the sum round; then weights and sums as above, the quotient, and the root,
    // derived from inversesqrt and a division.
    let far = greatest(&|i| (m.blobs[i].position - b.position).length());
    let d = p_error + U * far;
    let square = |sigma: f64| {
        (2.0 * by_mass + (2.0 * n + 8.0 + DIVISION_ERROR) * U) * sigma.powi(2)
            + (2.0 * far * d + d * d)
    };
    // |√a − √b| ≤ |a − b|/√a, and ≤ √|a − b|. A third of the distance's error counts for balls; for
    // ellipsoids half of it counts along x and z, and all of it along y.
    let share = if ellipsoids { 0.5 } else { 1.0 / 3.0 };
    let root = |sigma: f64, square: f64| {
        (square / sigma).min(square.sqrt()) + (4.0 + DIVISION_ERROR) * U * sigma
    };
    let of = |sigma: f64, share: f64| {
        root(sigma, square(sigma) - (1.0 - share) * (2.0 * far * d + d * d))
    };
    let spread = of(b.sigma, share);
    let high = b.sigma * b.shape.aspect;
    let aspect_error = match (run.len(), ellipsoids) {
        (1, _) | (_, false) => 0.0,
        _ => {
            (of(high, 1.0) + b.shape.aspect * spread) / (b.sigma - spread)
                + DIVISION_ERROR * U * b.shape.aspect
        }
    };
    let means = greatest(&|i| (m.sigma_means[i] - m.sigma_means[first]).abs());
    let scale_error =
        if run.len() == 1 { 0.0 } else { spread.max(mean(by_mass, means, b.sigma_mean)) };
    let scale = b.sigma.max(b.sigma_mean);
    let around =
        Around { p: b.position, p_error, scale, scale_error, shape: b.shape, aspect_error };
    let normal = scene.normal_bound(cells, &around, facet);
    let position = around.shell_bound(normal, facet).max_element();
    let colors = greatest(&|i| (m.colors[i] - m.colors[first]).length());
    let color =
        if run.len() == 1 { 0.0 } else { mean(scene.area_error(), colors, b.color.length()) };
    [normal, position, facet.area * (scene.area_error() + n * U), color]
}

/// Greatest error/bound of normal, position, area and colour, or what is wrong.
fn compare_runs(
    truth: &[(Facet, DVec3, [f64; 4])],
    made: &[FacetRecord],
) -> Result<[f64; 4], String> {
    if !truth.iter().zip(made).all(|((facet, _, _), made)| made.i_region == facet.region) {
        return Err("a region".into());
    }
    let mut ratios = [0.0; 4];
    for (k, ratio) in ratios.iter_mut().enumerate() {
        let of_made = |f: &FacetRecord| match k {
            0 => f.normal.map(f64::from).to_vec(),
            1 => f.position.map(f64::from).to_vec(),
            2 => vec![f64::from(f.area)],
            _ => f.color.map(f64::from).to_vec(),
        };
        let of_truth = |(f, color, _): &(Facet, DVec3, [f64; 4])| match k {
            0 => f.normal.to_array().to_vec(),
            1 => f.position.to_array().to_vec(),
            2 => vec![f.area],
            _ => color.to_array().to_vec(),
        };
        let values: Vec<f64> = made.iter().flat_map(of_made).collect();
        let truths: Vec<f64> = truth.iter().flat_map(of_truth).collect();
        let n = if k == 2 { 1 } else { 3 };
        let bounds: Vec<f64> = truth.iter().flat_map(|t| vec![t.2[k]; n]).collect();
        *ratio =
            check_within(["normal", "position", "area", "color"][k], &values, &truths, &bounds)?;
    }
    Ok(ratios)
}

#[test]
fn facets_of_runs_are_within_their_bounds() {
    let mut gpu = Gpu::new();
    let compiler = Compiler::new(nimbus::passes::sources(), Compiler::default_cache()).unwrap();
    let scene = Scene::new();
    for counts in [[100, 400], [1, 1499]] {
        let runs = Runs::new(&scene, counts);
        let (cells, made, i_facet) = scene.run_groups(&mut gpu, &compiler, &runs.order, &runs.runs);
        let truth = runs.truth(&scene, &cells);
        let ratios = compare_runs(&truth, &made).unwrap();
        let mut bounds: Vec<f64> = truth.iter().map(|t| t.2[0]).collect();
        bounds.sort_by(f64::total_cmp);
        let (median, greatest) = (bounds[bounds.len() / 2], bounds[bounds.len() - 1]);
        println!(
            "{counts:?}: error/bound {ratios:.3?}; normals' bounds: median {median:e}, greatest \
             {greatest:e}"
        );
        assert!(median < 1e-2);
        for g in 0..runs.runs.len() {
            assert!(
                runs.members(g)
                    .iter()
                    .all(|i| i_facet[*i as usize] as usize == N_SURFACE_FACETS + g)
            );
        }
    }
}

#[test]
fn runs_of_one_are_the_particles_facets_to_the_bit() {
    let mut gpu = Gpu::new();
    let compiler = Compiler::new(nimbus::passes::sources(), Compiler::default_cache()).unwrap();
    let scene = Scene::new();
    let runs = Runs::new(&scene, [u64::from(N_PER_CLOUD); 2]);
    let (_, singly) = scene.run(&mut gpu, &compiler);
    let (_, made, i_facet) = scene.run_groups(&mut gpu, &compiler, &runs.order, &runs.runs);
    let by_particle: Vec<FacetRecord> =
        i_facet.iter().map(|f| made[*f as usize - N_SURFACE_FACETS]).collect();
    assert!(by_particle == singly && made != singly);
}

#[test]
fn wrong_facets_of_runs_are_noticed() {
    let mut gpu = Gpu::new();
    let scene = Scene::new();
    let runs = Runs::new(&scene, [100, 400]);
    let mutations = [
        ("particle.kappa * sigma * sigma * sigma", "particle.kappa * sigma * sigma"),
        ("dot(d, d) * (1.0 / 3.0)", "dot(d, d) * (1.0 / 2.9)"),
        ("s.area += a;", "s.area = a;"),
        ("s.color += a * c;", "s.color += m * c;"),
        ("max(sigma, sigma_mean)", "max(sigma, group.sigma_mean)"),
        ("max(sigma, sigma_mean)", "sigma"),
        (
            "(by_mass ? s.position / s.mass : s.plain_position * n_inverse)",
            "s.plain_position * n_inverse",
        ),
        ("k < run.i_first + run.n_particles", "k < run.i_first + run.n_particles - 1u"),
    ];
    for (from, to) in mutations {
        let compiler = Gpu::wrong_compiler("facets_groups.comp", from, to);
        let (cells, made, _) = scene.run_groups(&mut gpu, &compiler, &runs.order, &runs.runs);
        assert!(compare_runs(&runs.truth(&scene, &cells), &made).is_err(), "{to} was not noticed");
    }
}
