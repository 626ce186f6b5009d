//! second as its sums may be formed: plain, compensated, pairwise, in f32 and f64, each within its
//! own bound, from every pair and from a tree.

use std::path::Path;

use crate::gathers::{Truths, reference, truths, values};
use crate::harness::{Gpu, assert_within_and_say, check_within};
use crate::rooms::{Frame, HEAD, Plate, frame, plates_text};
use crate::scene_text::load_with;
use crate::sums::{KAHAN, PAIRWISE, PLAIN, every_way, ways_of};
use glam::DVec3;
use nimbus::io::scene_file;
use nimbus::model::scene::{Gather, Scene};
use nimbus::model::sums::{Precision, Sums};
use nimbus::reference::rounding::sum_error;

const SUN: &str =
    "[[light]]\nkind = 'directional'\ndirection = [0.0, -1.0, 0.0]\nirradiance = [3.0, 3.0, 3.0]\n";
/// Facets of the dark plate, a side.
const SIDE: u32 = 64;

/// A receiver over two plates: a bright facet, and thousands of dark ones that come after it and
/// together bring a ten-thousandth of it, each less than half a rounding.
fn bright_and_dark(gather: &str) -> Scene {
    let plate = |center, u: DVec3, v: DVec3, kd, subdivide| Plate {
        center,
        u,
        v,
        kd: DVec3::splat(kd),
        ks: DVec3::ZERO,
        ns: 1.0,
        subdivide,
    };
    let (x, z) = (DVec3::X, DVec3::Z);
    let plates = [
        plate(DVec3::new(-1.0, 0.0, 0.0), 0.25 * z, 0.25 * x, 0.8, [1, 1]),
        plate(DVec3::new(1.0, 0.0, 0.0), 0.25 * z, 0.25 * x, 6e-5, [SIDE, SIDE]),
        // Looking down; away from the sun's way to the two.
        plate(DVec3::new(0.0, 2.0, 3.0), 0.125 * x, 0.125 * z, 0.5, [1, 1]),
    ];
    let camera = "[camera]\nposition = [0.0, 1.0, 8.0]\ntarget = [0.0, 1.0, 0.0]\n";
    let head = format!("{HEAD}{camera}[lighting]\ngather = '{gather}'\ntheta = 0.0\n");
    load_with(&(head + SUN + &plates_text(&plates)), &[], None).unwrap().scene
}

fn with(scene: &Scene, sums: Sums) -> Scene {
    let mut scene = scene.clone();
    scene.lighting.sums = sums;
    scene
}

/// The receiver's light, and what its terms and their sum may err; light is never negative.
fn of_receiver(f: &Frame, (truths, bounds): &Truths, sums: Sums) -> [Vec<f64>; 3] {
    let last = |v: &[f64]| v[v.len() - 3..].to_vec();
    let (truth, of_terms) = (last(&truths[0]), last(&bounds[0]));
    let share = sum_error(sums, u64::from(SIDE * SIDE) + 1);
    let bound = truth.iter().zip(of_terms).map(|(v, terms)| terms + share * (v + terms)).collect();
    [last(&values(f)[0]), truth, bound]
}

#[test]
fn every_way_to_sum_is_within_its_own_bound_and_plain_is_not_within_others() {
    let gpu = Gpu::new();
    for gather in ["exact", "tree"] {
        let scene = bright_and_dark(gather);
        let plain = frame(&gpu, scene.clone());
        let truths = truths(&reference(&plain));
        // From a tree it is the same sum.
        let ways = if gather == "tree" { vec![PLAIN, KAHAN] } else { ways_of(&gpu.device) };
        for sums in ways {
            let [values, truths, bounds] =
                of_receiver(&frame(&gpu, with(&scene, sums)), &truths, sums);
            let what = format!("{gather}, {sums:?}");
            println!("{what}: bound {:.1e} of {:.3e}", bounds[0], truths[0]);
            assert_within_and_say(&what, &values, &truths, &bounds);
        }
        for sums in [KAHAN, PAIRWISE, Sums { precision: Precision::F64, ..PLAIN }] {
            let [values, truths, bounds] = of_receiver(&plain, &truths, sums);
            assert!(
                check_within("plain", &values, &truths, &bounds).is_err(),
                "{gather}: plain keeps {sums:?}'s bound"
            );
        }
    }
}

/// Root mean square of a − b over that of b.
fn off(a: &[f64], b: &[f64]) -> f64 {
    let of = |difference: f64| move |(x, y): (&f64, &f64)| (x - difference * y).powi(2);
    let differences: f64 = a.iter().zip(b).map(of(1.0)).sum();
    (differences / b.iter().map(|y| y * y).sum::<f64>()).sqrt()
}

#[test]
#[ignore = "a minute; the table of docs/reference/measured.md"]
fn what_every_way_is_off_by() {
    let gpu = Gpu::new();
    for (name, gather) in
        [("rectangles", Gather::Exact), ("ground", Gather::Exact), ("materials", Gather::Exact)]
    {
        let set = ["film.width=8".to_owned(), "film.height=8".to_owned()];
        let mut scene =
            scene_file::load(Path::new(&format!("scenes/{name}.toml")), &set, None).unwrap().scene;
        scene.lighting.gather = gather;
        let lit = |sums: Sums| values(&frame(&gpu, with(&scene, sums)));
        let (truths, _) = truths(&reference(&frame(&gpu, scene.clone())));
        let exact_sums = lit(Sums { precision: Precision::F64, ..KAHAN });
        for sums in every_way() {
            let found = lit(sums);
            for (against, of) in [("f64", &truths), ("sums in f64", &exact_sums)] {
                let [indirect, second] = [0, 1].map(|k| off(&found[k], &of[k]));
                println!(
                    "{name}, {sums:?}, against {against}: I_i {indirect:.2e}, L2 {second:.2e}"
                );
            }
        }
    }
}
