use glam::{DVec3, UVec3};

use super::moments::flux_through_faces;
use super::{AtFaces, DiffuseLight, DiffusionMedium, Multigrid, Sources, System, solve};
use crate::model::cloud::Shape;
use crate::model::grid::GridSpec;
use crate::model::light::Light;
use crate::model::medium::MeanMedium;
use crate::reference::Blob;
use crate::reference::deposit::deposit;
use crate::reference::grid::density;
use crate::reference::transmit::Obstacles;

const MEAN: MeanMedium =
    MeanMedium { albedo: DVec3::new(1.0, 0.99, 0.6), g: 0.85, straight: 0.85 * 0.85, second: 0.0 };

fn spec(n: [u32; 3], aspect: f64) -> GridSpec {
    let half = DVec3::new(2.0, 1.5, 1.0);
    let cell = 2.0 * half.x / f64::from(n[0]);
    let n_cells = UVec3::from(n);
    let low = -0.5 * cell * DVec3::new(1.0, aspect, 1.0) * n_cells.as_dvec3();
    GridSpec { n_cells, cell, aspect, low }
}

fn blobs() -> Vec<Blob> {
    let blob = |x: f64, y: f64, z: f64, sigma, kappa| Blob {
        shape: Shape::BALL,
        position: DVec3::new(x, y, z),
        sigma,
        kappa,
    };
    vec![
        blob(-0.4, 0.1, 0.0, 0.3, 6.0),
        blob(0.5, -0.2, 0.1, 0.25, 9.0),
        blob(0.0, 0.5, -0.3, 0.2, 4.0),
    ]
}

fn lights() -> [Light; 3] {
    [
        Light::Directional {
            direction: DVec3::new(-0.4, -0.8, -0.3).normalize(),
            irradiance: DVec3::new(3.0, 2.5, 2.0),
        },
        Light::Point { position: DVec3::new(1.5, 0.8, 0.9), intensity: DVec3::ONE, radius: 0.1 },
        Light::even_sky(DVec3::new(0.5, 0.7, 1.0), 0.3),
    ]
}

/// The equations on a grid, with what they were made from.
fn system(grid: &GridSpec, lights: &[Light]) -> (DiffusionMedium, Vec<f64>, Sources, System) {
    system_of(grid, deposit(grid, &blobs()), lights)
}

fn system_of(
    grid: &GridSpec,
    cells: Vec<f64>,
    lights: &[Light],
) -> (DiffusionMedium, Vec<f64>, Sources, System) {
    let of = DiffusionMedium::new(MEAN, grid);
    let obstacles =
        Obstacles { spec: grid, cells: &cells, rectangles: &[], step: 0.5, forward: 0.0 };
    let sources = Sources::new(&of, &obstacles, lights, false);
    let system = System::new(&of, grid, &cells, &sources, lights, None, AtFaces::Mean);
    (of, cells, sources, system)
}

/// Greatest difference as a share of the greatest value.
fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    let most =
        |v: &mut dyn Iterator<Item = DVec3>| v.map(|v| v.abs().max_element()).fold(0.0, f64::max);
    most(&mut a.iter().zip(b).map(|(a, b)| *a - *b)) / most(&mut b.iter().copied())
}

#[test]
fn cycles_end_at_the_solution_by_elimination() {
    // Cubes, an odd number of cells, and flat cells: each cycle leaves less than a quarter.
    for grid in [spec([12, 9, 6], 1.0), spec([11, 7, 5], 1.0), spec([10, 30, 6], 0.25)] {
        let (.., system) = system(&grid, &lights());
        let truth = solve(&system);
        let levels = Multigrid::new(system, grid.edges());
        let left: Vec<f64> = [1, 2, 3, 4, 5, 24].map(|n| apart(&levels.solve(n), &truth)).into();
        println!("{:?}: {left:?}", grid.n_cells);
        for pair in left[..5].windows(2) {
            assert!(pair[1] < 0.25 * pair[0], "{:?}: {left:?}", grid.n_cells);
        }
        assert!(left[0] < 0.2 && left[1] < 0.03 && left[5] < 1e-12, "{left:?}");
    }
}

/// Where no light flows, ∇φ is q/D. φ rises from centre to centre by the mean of that, also between
/// a nearly clear cell and an opaque one.
#[test]
fn fluence_rises_by_the_mean_of_q_over_d() {
    let grid = spec([2, 1, 1], 1.0);
    let of = DiffusionMedium::new(MEAN, &grid);
    let h = grid.cell;
    for cells in [[1e-9, 1e-9], [1e-9, 30.0], [30.0, 1e-9], [2.0, 5.0]] {
        let [a, b] = cells.map(|sigma| of.reach(sigma));
        for over_d in [[1.0, 0.0], [0.0, 1.0], [0.7, -0.2]] {
            let [p, q] = [a * over_d[0], b * over_d[1]];
            let zero = vec![DVec3::ZERO; 2];
            let sources = Sources {
                scattered: zero,
                carried: vec![[p, DVec3::ZERO, DVec3::ZERO], [q, DVec3::ZERO, DVec3::ZERO]],
                ..Sources::default()
            };
            let series = AtFaces::InSeries;
            let system = System::new(&of, &grid, &cells, &sources, &[], None, series);
            // The source of the first cell, less that of its face on the box.
            let half = 0.5 * h / a;
            let of_face = (2.0 + half).recip() / h * half * p;
            let at_face = (of_face - system.source[0]) * h;
            let rise = at_face / (h * system.next[0][0]);
            let expected = 0.5 * h * (over_d[0] + over_d[1]);
            let off = (rise / expected - 1.0).abs().max_element();
            assert!(off < 1e-9, "{cells:?} {over_d:?}: {rise}");
        }
    }
}

#[test]
fn elimination_solves_the_equations() {
    let (.., system) = system(&spec([9, 7, 5], 1.0), &lights());
    let phi = solve(&system);
    let most = system.source.iter().map(|s| s.max_element()).fold(0.0, f64::max);
    for c in 0..phi.len() {
        let left = (system.applied(&phi, c) - system.source[c]).abs().max_element();
        // Some hundred roundings of a cell's terms.
        assert!(left < 1e-12 * most, "{c}: {left:e}");
    }
    // Incoming light is absorbed or leaves.
    let [in_all, out_all] = [
        system.source.iter().sum::<DVec3>(),
        system.sink.iter().zip(&phi).map(|(sink, phi)| *sink * *phi).sum::<DVec3>(),
    ];
    assert!(((in_all - out_all) / in_all).abs().max_element() < 1e-12);
}

#[test]
fn light_from_everywhere_is_the_same_everywhere() {
    // A radiance of 1 has φ = 4π and no flux; only what absorbs is darker.
    let even = Light::even_sky(DVec3::splat(1e-9), 1e9 * std::f64::consts::PI);
    let grid = spec([8, 6, 5], 1.0);
    let (of, cells, sources, system) = system(&grid, &[even]);
    let phi = solve(&system);
    let light = DiffuseLight::of_fluence(&of, &grid, &cells, &sources, &phi);
    for [phi, flux @ ..] in &light.cells {
        // The share from above alone is 1e-9 of it.
        assert!((phi.x / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-8);
        assert!(flux.iter().all(|f| f.x.abs() < 1e-7));
        assert!(phi.z < phi.y && phi.y < phi.x);
    }
}

#[test]
fn finer_grids_converge_at_second_order() {
    // The box stays, so that c does.
    let at = |n: u32| {
        let grid = spec([8 * n, 6 * n, 4 * n], 1.0);
        // Beside a lamp light has no limit.
        let [sun, _, sky] = lights();
        // Deposited blobs end at 3 σ with a jump, which is of first order. Here they do not end.
        let cells = (0..(192 * n * n * n) as usize).map(|c| density(&blobs(), grid.center(c)));
        let (of, cells, sources, system) = system_of(&grid, cells.collect(), &[sun, sky]);
        let phi = Multigrid::new(system, grid.edges()).solve(16);
        let light = DiffuseLight::of_fluence(&of, &grid, &cells, &sources, &phi);
        // Corners of cells on every grid, so that interpolation errs alike on all of them.
        [DVec3::ZERO, DVec3::new(-0.5, 0.0, 0.0), DVec3::new(0.5, -0.5, 0.5)]
            .map(|p| light.at(p).0[0].x)
    };
    let found = [1, 2, 4, 8].map(at);
    let step = |a: [f64; 3], b: [f64; 3]| {
        let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        squares.sqrt()
    };
    let steps = [0, 1, 2].map(|i: usize| step(found[i], found[i + 1]));
    println!("{found:?}, steps {steps:?}");
    // A quarter of the step before, once a cell is shorter than a blob's σ.
    assert!(steps[2] < 0.35 * steps[1] && steps[1] < 0.6 * steps[0], "{steps:?}");
}

#[test]
fn an_empty_box_lets_the_sky_through() {
    // φ = 2E + 4kE and F = −E along y in all cells, as without the box.
    let sky = Light::even_sky(DVec3::new(1.0, 2.0, 0.5), 0.2);
    let grid = spec([6, 5, 4], 0.7);
    let of = DiffusionMedium::new(MEAN, &grid);
    let cells = vec![0.0; 120];
    let obstacles =
        Obstacles { spec: &grid, cells: &cells, rectangles: &[], step: 0.5, forward: 0.0 };
    let sources = Sources::new(&of, &obstacles, &[sky], true);
    let system = System::new(&of, &grid, &cells, &sources, &[sky], None, AtFaces::Mean);
    let phi = solve(&system);
    let light = DiffuseLight::of_fluence(&of, &grid, &cells, &sources, &phi);
    for [phi, x, y, z] in &light.cells {
        let e = sky.energy();
        assert!((*phi - 2.8 * e).abs().max_element() < 1e-12, "{phi}");
        assert!((*y + e).abs().max_element() < 1e-12 && (*x + *z).abs().max_element() < 1e-12);
    }
}

/// Between unlike cells: D is 1/c, that is 3/7, and the 1/(3σ + c) of σ = 7/9, 3/14.
#[test]
fn what_flows_through_faces_by_hand() {
    let grid = GridSpec { n_cells: UVec3::new(3, 1, 1), cell: 0.5, aspect: 1.0, low: DVec3::ZERO };
    let mean = MeanMedium { albedo: DVec3::ZERO, g: 0.0, straight: 0.0, second: 0.0 };
    let of = DiffusionMedium { densest: f64::INFINITY, ..DiffusionMedium::new(mean, &grid) };
    let cells = [0.0, 7.0 / 9.0, 0.0];
    let phi = [1.0, 3.0, 4.0].map(DVec3::splat);
    let of_axis = |x: f64| [DVec3::splat(x), DVec3::Y, DVec3::Z];
    let sources = Sources {
        scattered: vec![DVec3::ZERO; 3],
        carried: [1.0, 4.0, -2.0].map(of_axis).into(),
        ..Sources::default()
    };
    // D of a face is 2/(7/3 + 14/3) = 2/7, slopes are 4 and 2.
    for (at_faces, [first, second]) in [
        (AtFaces::Mean, [2.5 - 8.0 / 7.0, 1.0 - 4.0 / 7.0]),
        // q of a third of its first cell and two thirds of the second, and the other way about.
        (AtFaces::InSeries, [3.0 - 8.0 / 7.0, 2.0 - 4.0 / 7.0]),
    ] {
        let found = flux_through_faces(&of, &grid, &cells, (&sources, at_faces), &phi);
        let expected = [first, 0.5 * (first + second), second];
        for (k, (found, x)) in found.iter().zip(expected).enumerate() {
            assert!((found[1].x - x).abs() < 1e-14, "{at_faces:?} {k}: {} {x}", found[1].x);
            // One cell across: q alone.
            assert_eq!([found[2], found[3]], [DVec3::Y, DVec3::Z]);
        }
    }
}

#[test]
fn a_flux_by_hand() {
    // φ rises by 2 along x in cells of edge 0.5 without extinction: F = −D·4, D = 1/c.
    let grid = GridSpec { n_cells: UVec3::new(3, 1, 1), cell: 0.5, aspect: 1.0, low: DVec3::ZERO };
    let of = DiffusionMedium::new(MEAN, &grid);
    // c: 1/1.5 + 1/0.5 + 1/0.5, halved.
    assert!((of.inverse_chord - 7.0 / 3.0).abs() < 1e-15);
    let phi = [1.0, 3.0, 5.0].map(DVec3::splat);
    let nothing = Sources {
        scattered: vec![DVec3::ZERO; 3],
        carried: vec![[DVec3::ZERO; 3]; 3],
        direct: vec![1.0, 2.0, 4.0],
        ..Sources::default()
    };
    let light = DiffuseLight::of_fluence(&of, &grid, &[0.0; 3], &nothing, &phi);
    // All faces have the same flow.
    let by_faces = flux_through_faces(&of, &grid, &[0.0; 3], (&nothing, AtFaces::Mean), &phi);
    for [_, x, y, z] in light.cells.iter().chain(&by_faces) {
        assert!((x.x + 4.0 * 3.0 / 7.0).abs() < 1e-14 && y.x == 0.0 && z.x == 0.0);
    }
    assert_eq!(light.at(DVec3::new(0.5, 9.0, -9.0)).0[0], DVec3::splat(2.0));
    assert_eq!(light.at(DVec3::new(9.0, 0.0, 0.0)).0[0], DVec3::splat(5.0));
    assert_eq!(light.at(DVec3::new(1.0, 0.0, 0.0)).1, 3.0);
}
