//! transmit: the way of every light to every facet, past rectangles and through the grid, against
//! the same in f64, within a running bound.

use crate::bounded::greatest_ratio;
use crate::harness::{Gpu, assert_within};
use crate::sums::PLAIN;
use crate::ways;
use crate::ways::{Case, case, case_of_cells, in_cloud, room, sun};
use glam::DVec3;
use nimbus::model::light::Light;
use nimbus::passes::transmit::{Arriving, Transmit};

#[test]
fn marches_agree_with_the_reference_at_every_step_size() {
    agree_at_every_step_size(case());
}

#[test]
fn through_flat_cells_too() {
    agree_at_every_step_size(case_of_cells(0.25));
}

fn agree_at_every_step_size(case: Case) {
    let mut gpu = Gpu::new();
    // The outermost cells hold nothing: without that the density would jump at the hull of the
    // centres.
    let n = case.spec.n_cells.as_usizevec3();
    let outer = |i: usize| {
        let at = [i % n.x, i / n.x % n.y, i / (n.x * n.y)];
        (0..3).any(|k| at[k] == 0 || at[k] + 1 == n.to_array()[k])
    };
    assert!((0..case.density.len()).all(|i| !outer(i) || case.density[i] == 0.0));
    for (step, forward) in
        [(0.5, 0.0), (0.5, 0.85), (1.0, 0.0), (0.1, 0.0), (3.7, 0.0), (1000.0, 0.0)]
    {
        let ([values, through], [truths, _]) =
            (case.run(&mut gpu, None, step, forward), case.truth(step, forward));
        let ([bounds, _], n_unsure) = case.bounds(step, forward);
        let what = format!("step {step}, forward {forward}");
        let most = bounds.iter().cloned().fold(0.0, f64::max);
        println!(
            "{what}: greatest error/bound {:.3}, bound {most:.1e}",
            greatest_ratio(&values, &truths, &bounds)
        );
        assert_within(&what, &values, &truths, &bounds);
        // The bound itself says something, and so do the inputs: shade and light both occur. (Of
        // flat cells a single step through all of them lies in one, and the flatter the cell the
        // more its place decides.)
        let flat_at_once = case.spec.aspect != 1.0 && step > 10.0;
        assert!(most < if flat_at_once { 1e-2 } else { 1e-3 } && n_unsure == 0);
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
            println!(
                "{what}: greatest error/bound {:.3}",
                greatest_ratio(&values[k], &truths[k], &bounds[k])
            );
            assert_within(&what, &values[k], &truths[k], &bounds[k]);
        }
        // Of some four thousand ways, asked of nine rectangles, edges a few units long pass within
        // some 1e-6 of hardly any; ten would be a wrong bound.
        println!("{n_unsure} decisions within rounding");
        assert!(n_unsure < 10, "{n_unsure}");
        let mut sorted = bounds[0].clone();
        sorted.sort_by(f64::total_cmp);
        assert!(sorted[sorted.len() * 99 / 100] < 1e-3, "{:e}", sorted[sorted.len() * 99 / 100]);
        // All kinds occur: hidden, clear, through the cloud; hidden facets behind it.
        let share = |of: &dyn Fn(f64) -> bool| {
            truths[0].iter().filter(|v| of(**v)).count() * 100 / truths[0].len()
        };
        let (hidden, clear, dimmed) =
            (share(&|v| v == 0.0), share(&|v| v == 1.0), share(&|v| v > 0.0 && v < 0.9));
        assert!(hidden > 10 && clear > 10 && dimmed > 5, "{hidden} {clear} {dimmed}");
        let behind = |(v, s): (&f64, &f64)| *v == 0.0 && *s > 0.0 && *s < 0.9;
        assert!(truths[0].iter().zip(&truths[1]).filter(|(v, s)| behind((v, s))).count() > 30);
    }
}

#[test]
fn by_itself_the_transmittance_is_the_same() {
    let mut gpu = Gpu::new();
    let case = room();
    let pass = Transmit::new(&gpu.device, &gpu.compiler, Arriving::Share, &PLAIN.into(), false)
        .expect("transmit");
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
    assert!(
        case.run(&mut gpu, None, 0.5, 1.0)[0].iter().all(|v| *v == 1.0),
        "all light goes forward"
    );
    // Past the box on every side, and away from it.
    let (low, high) = (case.spec.low, case.spec.high());
    let mut outside = Vec::new();
    for x in [low.x - 1e-3, high.x + 1e-3, low.x - 1e6, high.x + 1e6] {
        let mut p = (0.5 * (low + high)).as_vec3();
        p.x = x as f32;
        outside.push(in_cloud(p.to_array()));
    }
    case.facets = outside;
    case.lights = vec![sun(DVec3::NEG_Y), sun(DVec3::Z), Light::even_sky(DVec3::ONE, 0.0)];
    assert_eq!(case.run(&mut gpu, None, 0.5, 0.0)[0], [1.0; 12], "past the box");
    case.lights = vec![sun(DVec3::X)];
    let through = &case.run(&mut gpu, None, 0.5, 0.0)[0];
    assert!(
        through[0] == 1.0 && through[2] == 1.0 && through[1] < 1.0 && through[3] < 1.0,
        "{through:?}"
    );
    case = ways::case();
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
    let ratio =
        |values: &[Vec<f64>; 2], k: usize| greatest_ratio(&values[k], &truths[k], &bounds[k]);
    let mut values = case.run(&mut gpu, None, step, forward);
    assert!(ratio(&values, 0) <= 1.0 && ratio(&values, 1) <= 1.0);
    for k in [0, 1] {
        let shaded = truths[k].iter().position(|v| *v > 0.1 && *v < 0.9).expect("a shaded facet");
        values[k][shaded] += 2.0 * bounds[k][shaded];
        assert!(ratio(&values, k) > 1.0, "one corrupted number");
    }
    // The errors of the transmittance (0), and of the clouds' part alone (1).
    for (k, file, from, to) in [
        (0, "include/march.glsl", "(t0 + 0.5 * ds)", "t0"),
        (0, "include/march.glsl", "min(step_length, length_total - t0)", "step_length"),
        (0, "transmit.comp", "push.backward * tau", "tau"),
        (0, "transmit.comp", "k / push.n_lights", "k % push.n_facets"),
        (0, "include/march.glsl", "leave = distance", "leave = 3.4e38"),
        (0, "include/march.glsl", "enter = max(enter, min(a, b))", "enter = enter"),
        (0, "include/reach.glsl", "i != i_own && ", ""),
        (0, "include/reach.glsl", "light.kind == LIGHT_POINT ?", "light.kind == 77 ?"),
        (0, "include/reach.glsl", "i = 0; i < n_surfaces", "i = 1; i < n_surfaces"),
        (
            0,
            "transmit.comp",
            "bool is_on = any(notEqual(light.energy, vec3(0.0)))",
            "bool is_on = true",
        ),
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
