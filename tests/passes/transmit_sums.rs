//! transmit as its sums may be formed: plain, compensated, pairwise, in f32 and f64, each within
//! its own bound.

use crate::bounded::{Random, greatest_ratio};
use crate::harness::{Gpu, assert_within};
use crate::sums::{KAHAN, PAIRWISE, PLAIN, every_way, has_doubles, ways_of};
use crate::ways::{Case, case, in_cloud, room, sun};
use glam::{DVec3, UVec3};
use nimbus::gpu::Compiler;
use nimbus::model::grid::GridSpec;
use nimbus::model::light::Light;
use nimbus::model::sums::{Precision, Sums};

/// A block of one density: nothing but the sum is rounded much. Ways along it and to a lamp, of
/// thousands of steps.
fn block() -> Case {
    let mut r = Random(23);
    let n = UVec3::new(40, 12, 12);
    let spec = GridSpec { aspect: 1.0, n_cells: n, cell: 0.5, low: DVec3::new(-10.0, -3.0, -3.0) };
    let cell = |i: u32| [i % n.x, i / n.x % n.y, i / (n.x * n.y)];
    let inner = |c: [u32; 3]| (0..3).all(|k| c[k] > 0 && c[k] + 1 < n[k]);
    let density = (0..n.x * n.y * n.z).map(|i| if inner(cell(i)) { 0.1 } else { 0.0 }).collect();
    let facets =
        (0..200).map(|_| in_cloud([-9.5, r.within(-2.0, 2.0), r.within(-2.0, 2.0)])).collect();
    let lamp = Light::Point {
        position: DVec3::new(9.25, 0.5, -0.75),
        intensity: DVec3::ONE,
        radius: 0.125,
    };
    Case { spec, density, surfaces: vec![], facets, lights: vec![sun(DVec3::NEG_X), lamp] }
}

/// In cells: some 2500 steps, and 3900 of a step that is no f32 number.
const TINY_STEPS: [f64; 2] = [1.0 / 64.0, 1.0 / 100.0];

#[test]
fn every_way_to_sum_is_within_its_own_bound() {
    let mut gpu = Gpu::new();
    let (one, two) = ([0.5, 3.7], TINY_STEPS);
    for (what, mut case, steps) in
        [("room", room(), one), ("cloud", case(), one), ("block", block(), two)]
    {
        case.facets.reverse();
        case.facets.truncate(400);
        for step in steps {
            let truths = case.truth(step, 0.0);
            for sums in ways_of(&gpu.device) {
                let values = case.run_as(&mut gpu, None, [step, 0.0], sums);
                let (bounds, _) = case.bounds_as(step, 0.0, sums);
                for k in [0, 1] {
                    let what = format!("{what} {k}, step {step}, {sums:?}");
                    println!(
                        "{what}: greatest error/bound {:.3}",
                        greatest_ratio(&values[k], &truths[k], &bounds[k])
                    );
                    assert_within(&what, &values[k], &truths[k], &bounds[k]);
                }
            }
        }
    }
}

#[test]
fn wrong_doubles_and_floats_in_their_place_are_noticed() {
    let mut gpu = Gpu::new();
    let has_doubles = has_doubles(&gpu.device);
    let mut case = room();
    case.facets.truncate(400);
    let (step, doubles) = (0.37, Sums { precision: Precision::F64, ..PLAIN });
    let (truths, (bounds, _)) = (case.truth(step, 0.0), case.bounds_as(step, 0.0, doubles));
    let mut ratio = |compiler: Option<&Compiler>, sums: Sums| {
        greatest_ratio(
            &case.run_as(&mut gpu, compiler, [step, 0.0], sums)[1],
            &truths[1],
            &bounds[1],
        )
    };
    let of_floats = ratio(None, KAHAN);
    assert!(of_floats > 1.0, "sums of floats: {of_floats} of the bound of doubles");
    if !has_doubles {
        return;
    }
    assert!(ratio(None, doubles) <= 1.0);
    for (file, from, to) in [
        ("transmit.comp", "#define DEEP DOUBLE", "#define DEEP 0"),
        ("transmit.comp", "LightPath(d > 0.0 ? offset / d", "LightPath(d > 0.0 ? offset"),
        ("transmit.comp", "PLACE(light.position) - PLACE(p)", "PLACE(p) - PLACE(light.position)"),
        (
            "include/density.glsl",
            "((x) / double(push.grid.cell) *",
            "((x) * double(push.grid.cell) *",
        ),
    ] {
        let found = ratio(Some(&Gpu::wrong_compiler(file, from, to)), doubles);
        assert!(found > 1.0, "{from} as {to}: {found}");
    }
}

#[test]
fn a_plain_march_of_thousands_of_steps_is_not_within_the_bounds_of_the_others() {
    let mut gpu = Gpu::new();
    let case = block();
    for step in TINY_STEPS {
        let (values, truths) = (case.run(&mut gpu, None, step, 0.0), case.truth(step, 0.0));
        for sums in [KAHAN, PAIRWISE, Sums { precision: Precision::F64, ..PLAIN }] {
            let (bounds, _) = case.bounds_as(step, 0.0, sums);
            let ratio = greatest_ratio(&values[1], &truths[1], &bounds[1]);
            println!("step {step}, {sums:?}: greatest plain error/bound {ratio:.3}");
            assert!(ratio > 2.0, "step {step}, {sums:?}: {ratio}");
        }
    }
}

#[test]
#[ignore = "the table of docs/reference/measured.md"]
fn what_every_way_is_off_by() {
    let mut gpu = Gpu::new();
    for (what, case, step) in
        [("cloud", case(), 1.0), ("cloud", case(), 0.1), ("block", block(), TINY_STEPS[0])]
    {
        let [_, truths] = case.truth(step, 0.0);
        for sums in every_way() {
            let [_, values] = case.run_as(&mut gpu, None, [step, 0.0], sums);
            let squares: f64 = values.iter().zip(&truths).map(|(v, t)| (v - t) * (v - t)).sum();
            println!(
                "{what}, step {step}, {sums:?}: RMSE {:.2e}",
                (squares / truths.len() as f64).sqrt()
            );
        }
    }
}
