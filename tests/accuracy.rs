//! Error of two reflections of facets against the integrals over the surfaces' areas
//! (docs/explanation/passes.md "second", "area reference"; docs/reference/measured.md "Lighting
//! accuracy").

#[path = "harness/bounded.rs"]
mod bounded;
mod harness;
#[path = "harness/rooms.rs"]
mod rooms;
#[path = "harness/scene_text.rs"]
mod scene_text;

use bounded::Random;
use glam::DVec3;
use harness::Gpu;
use nimbus::model::basis::{Basis, evaluate};
use nimbus::model::material::Brdf;
use nimbus::model::parallel::parallel_map;
use nimbus::model::scene::Scene;
use nimbus::reference::area::{Accuracy, AreaScene, Estimate};
use rooms::{Frame, HEAD, Plate, frame, plates_text, random_plates, sun_and_lamp};
use scene_text::load_with;

const EYE: DVec3 = DVec3::new(2.0, 3.0, 6.0);

fn room(plates: &[Plate], eye: DVec3, lights: &str, lighting: &str) -> Scene {
    let head = format!("{HEAD}[camera]\nposition = {:?}\n[lighting]\n{lighting}\n", eye.to_array());
    load_with(&(head + lights + &plates_text(plates)), &[], None).unwrap().scene
}

fn random_room(seed: u64, subdivide: u32, lighting: &str) -> Scene {
    let mut r = Random(100 + seed);
    let mut plates = random_plates(&mut r, 12, 1.5, 0.1);
    plates.iter_mut().for_each(|p| p.subdivide = [subdivide; 2]);
    let lights = sun_and_lamp(&mut r, 2.5);
    room(&plates, EYE, &lights, lighting)
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

/// Every facet's surface, and its index in the surface.
fn places(scene: &Scene) -> Vec<(usize, u32)> {
    let of = |(s, surface): (usize, &nimbus::model::surface::Surface)| {
        (0..surface.n_facets() as u32).map(move |i| (s, i))
    };
    scene.surfaces.iter().enumerate().flat_map(of).collect()
}

fn brdfs(scene: &Scene) -> Vec<Brdf> {
    (0..scene.n_regions()).map(|i| scene.region_material(i).at(0.0)).collect()
}

/// L2 toward the eye and I_i at every `stride`-th facet's centre by the area reference.
fn truths(scene: &Scene, eye: DVec3, stride: usize, relative: f64) -> Vec<(usize, Estimate)> {
    let brdfs = brdfs(scene);
    let scenery = AreaScene::new(&scene.surfaces, &brdfs, &scene.lights, &[], 0.0, &[]);
    let places = places(scene);
    parallel_map(places.len().div_ceil(stride), |k| {
        let (s, i) = places[k * stride];
        let receiver = scenery.on_surface(s, scene.surfaces[s].facet_center(i));
        let toward = (eye - receiver.position).normalize();
        (k * stride, scenery.second(&receiver, toward, &Accuracy::relative(relative)))
    })
}

/// Sums of squares of the errors of L2 and I_i, and of their values.
#[derive(Default, Clone, Copy)]
struct Squares {
    error: [f64; 2],
    value: [f64; 2],
}

impl Squares {
    fn of(f: &Frame, truths: &[(usize, Estimate)]) -> Squares {
        let mut sum = Squares::default();
        for (j, truth) in truths {
            let lit = &f.lit[*j];
            for (k, (gpu, truth)) in
                [(lit.second, truth.radiance), (lit.indirect, truth.irradiance)]
                    .into_iter()
                    .enumerate()
            {
                sum.error[k] += (double(gpu) - truth).length_squared();
                sum.value[k] += truth.length_squared();
            }
        }
        sum
    }

    fn plus(self, b: Squares) -> Squares {
        let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
        Squares { error: add(self.error, b.error), value: add(self.value, b.value) }
    }

    /// Relative root mean square errors.
    fn relative(&self) -> [f64; 2] {
        [0, 1].map(|k| (self.error[k] / self.value[k]).sqrt())
    }
}

/// Promised accuracy of the default settings: 1 %, root mean square over all facets and channels
/// relative to that of the values.
const PROMISED: f64 = 0.01;

#[test]
fn random_rooms_are_within_one_percent() {
    let gpu = Gpu::new();
    // The reference's own error is a tenth of the promise.
    let of_truth = 1e-3;
    for lighting in ["gather = 'exact'", "gather = 'tree'"] {
        let mut sum = Squares::default();
        for seed in 0..8 {
            let scene = random_room(seed, 8, lighting);
            let truths = truths(&scene, EYE, 1, of_truth);
            let f = frame(&gpu, scene);
            let own = Squares::of(&f, &truths);
            // Facets whose light the device left out would be counted.
            let n_endless = f.lit.iter().filter(|l| l.unresolved.is_infinite()).count();
            println!(
                "{lighting}, room {seed}: L2 and I_i {:?}, {} lost",
                own.relative(),
                f.lit.iter().map(|l| l.n_lost).sum::<f32>()
            );

            assert_eq!(n_endless, 0);
            sum = sum.plus(own);
        }
        println!("{lighting}, all: L2 and I_i {:?}", sum.relative());
        assert!(sum.relative()[0] <= PROMISED && sum.value[0] > 0.0);
    }
}

/// The scene of the timings in docs/reference/measured.md.
#[test]
fn the_scene_of_rectangles_is_within_one_percent() {
    let gpu = Gpu::new();
    let scene =
        nimbus::io::scene_file::load(std::path::Path::new("scenes/rectangles.toml"), &[], None)
            .unwrap()
            .scene;
    let eye = scene.camera.pose(0.0).expect("a camera").position;
    let truths = truths(&scene, eye, 1, 1e-3);
    let [radiance, irradiance] = Squares::of(&frame(&gpu, scene), &truths).relative();
    println!("scenes/rectangles.toml: L2 and I_i {radiance:.4}, {irradiance:.4}");
    assert!(radiance <= PROMISED);
}

#[test]
fn what_the_lights_bring_is_right_to_rounding() {
    let gpu = Gpu::new();
    for seed in 0..3 {
        let f = frame(&gpu, random_room(seed, 8, "gather = 'exact'"));
        let brdfs = brdfs(&f.scene);
        let basis = Basis::new(
            f.scene.lighting.exponents,
            f.scene.lighting.bases,
            f.scene.lighting.sampling,
        );
        let tables: Vec<_> = brdfs.iter().map(|b| basis.lobe(b.ns)).collect();
        let scenery = AreaScene::new(&f.scene.surfaces, &brdfs, &f.scene.lights, &[], 0.0, &[]);
        let mut greatest = [0f64; 2];
        for (j, (s, i)) in places(&f.scene).into_iter().enumerate() {
            let at = scenery.on_surface(s, f.scene.surfaces[s].facet_center(i));
            let toward = (EYE - at.position).normalize();
            let (mut direct, mut first, mut reach) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
            for light in &f.scene.lights {
                let arrival = light.arrival(at.position);
                let e = light.energy()
                    * light.share(at.normal, &arrival, scenery.visibility(at.position, light));
                // Turn of cos θ and the lobe by rounding: coordinates up to 4 rounded to f32, over
                // the lamp's distance.
                let turn = 8.0 * f64::from(f32::EPSILON) * (1.0 + 4.0 / arrival.distance.min(4.0));
                let w = 0.5 * (at.normal - (arrival.toward + toward).normalize()).length_squared();
                let lobe = |w: f64| {
                    if at.normal.dot(toward) > 0.0 { evaluate(&tables[s], w) } else { 0.0 }
                };
                let gap = (2.0 * w).sqrt();
                let slope = (lobe(0.5 * (gap + turn).powi(2))
                    - lobe(0.5 * (gap - turn).max(0.0).powi(2)))
                .abs();
                direct += e;
                first += e * (brdfs[s].kd / std::f64::consts::PI + brdfs[s].ks * lobe(w));
                // Energy at a grazing angle errs by the whole turn of the cosine.
                reach += light.energy() * arrival.falloff * turn + e * brdfs[s].ks * slope;
            }
            // Sums of two lights of products of some ten factors: 32 roundings.
            let bound =
                |value: DVec3| reach + 32.0 * bounded::U * value.abs() + DVec3::splat(1e-12);
            let lit = &f.lit[j];
            for (k, (gpu, truth)) in
                [(lit.direct, direct), (lit.first, first)].into_iter().enumerate()
            {
                let ratio = ((double(gpu) - truth).abs() / bound(truth)).max_element();
                assert!(ratio <= 1.0, "room {seed}, facet {j}, {k}: {gpu:?} is not {truth}");
                greatest[k] = greatest[k].max(ratio);
            }
        }
        println!("room {seed}: greatest error/bound of I_d and L1 {greatest:?}");
    }
}

/// Checks every facet against `tolerance` or its own error bound. Returns the number of negative
/// and of unresolved facets, and the greatest bound over the greatest value.
fn assert_honest(what: &str, f: &Frame, truths: &[(usize, Estimate)], tolerance: f64) -> [f64; 3] {
    let greatest = truths.iter().map(|(_, t)| t.radiance.max_element()).fold(0.0, f64::max);
    let mut worst = 0f64;
    for (j, truth) in truths {
        let lit = &f.lit[*j];
        assert!(
            lit.second.iter().chain(&lit.first).chain(&lit.indirect).all(|v| v.is_finite()),
            "{what}: {j}"
        );
        let error = (double(lit.second) - truth.radiance).abs().max_element();
        let known = if truth.error.is_finite() { truth.error } else { f64::INFINITY };
        let allowed = tolerance * (truth.radiance.max_element() + 0.1 * greatest)
            + f64::from(lit.unresolved)
            + known;
        worst = worst.max(error / allowed);
        assert!(
            error <= allowed,
            "{what}: facet {j}: {:?} is not {truth:?}, says {}",
            lit.second,
            lit.unresolved
        );
    }
    let n_negative = f.lit.iter().filter(|l| l.second.iter().any(|v| *v < 0.0)).count();
    let n_unresolved = f.lit.iter().filter(|l| l.n_unresolved > 0.0).count();
    let bound = f.lit.iter().map(|l| f64::from(l.unresolved)).fold(0.0, f64::max) / greatest;
    println!(
        "{what}: greatest error/allowed {worst:.3}, {n_negative} negative, {n_unresolved} \
         unresolved, bound {bound:.3e}"
    );
    [n_negative as f64, n_unresolved as f64, bound]
}

fn plate(center: DVec3, u: DVec3, v: DVec3, kd: f64, ks: f64, ns: f64, n: u32) -> Plate {
    Plate { center, u, v, kd: DVec3::splat(kd), ks: DVec3::splat(ks), ns, subdivide: [n, n] }
}

const SUN: &str =
    "[[light]]\nkind = 'directional'\ndirection = [0.3, -1.0, 0.2]\nirradiance = [3.0, 3.0, 3.0]\n";

#[test]
fn extremes_are_near_or_say_so() {
    let gpu = Gpu::new();
    let up = |c: DVec3, half: f64, kd: f64, ks: f64, ns: f64, n| {
        plate(c, half * DVec3::Z, half * DVec3::X, kd, ks, ns, n)
    };
    let down = |c: DVec3, half: f64, kd: f64, n| {
        plate(c, half * DVec3::X, half * DVec3::Z, kd, 0.0, 1.0, n)
    };
    // A polished floor that mirrors a lit wall, and a polished wall that reflects the sun onto a
    // ceiling.
    let wall = plate(DVec3::new(0.0, 1.0, -1.0), DVec3::X, DVec3::Y, 0.4, 0.1, 1e4, 8);
    let mirrors = [
        up(DVec3::ZERO, 1.0, 0.1, 0.2, 1e4, 8),
        wall,
        down(DVec3::new(0.0, 2.2, 0.0), 0.9, 0.5, 8),
    ];
    let eye = DVec3::new(0.4, 1.2, 3.0);
    let lit_wall = "[[light]]\nkind = 'directional'\ndirection = [0.3, -1.0, -0.9]\nirradiance = \
        [3.0, 3.0, 3.0]\n";
    let scene =
        room(&mirrors, eye, lit_wall, "gather = 'exact'\nexponents = [1, 10000]\nbases = 16");
    let truth = truths(&scene, eye, 1, 1e-3);
    assert_honest("mirrors, n_s = 10^4", &frame(&gpu, scene), &truth, 0.05);
    // A ground of 10^4 and a unit plate one above it.
    let ratio =
        [up(DVec3::ZERO, 5e3, 0.5, 0.0, 1.0, 64), down(DVec3::new(100.0, 1.0, 30.0), 0.5, 0.5, 4)];
    let eye = DVec3::new(120.0, 5.0, 40.0);
    for gather in ["exact", "tree"] {
        let scene = room(&ratio, eye, SUN, &format!("gather = '{gather}'"));
        let mut truth = truths(&scene, eye, 41, 1e-3);
        truth.extend(truths(&scene, eye, 1, 1e-3).split_off(64 * 64));
        assert_honest(&format!("size ratio 10^4, {gather}"), &frame(&gpu, scene), &truth, 0.05);
    }
    // A room at 10^6; the lighting origin O removes the large coordinates.
    let far = DVec3::new(1e6, -1e6, 1e6);
    let mut plates = random_plates(&mut Random(104), 6, 1.0, 0.1);
    plates.iter_mut().for_each(|p| p.center += far);
    let scene = room(&plates, far + EYE, SUN, "gather = 'exact'");
    let truth = truths(&scene, far + EYE, 1, 1e-3);
    assert_honest("coordinates of 10^6", &frame(&gpu, scene), &truth, 0.05);
}

/// Relative error of L2 by number of facets a side.
fn by_subdivision(gpu: &Gpu, build: impl Fn(u32) -> Scene, eye: DVec3) -> Vec<(u32, f64)> {
    let of = |n: u32| {
        let scene = build(n);
        // The same number of facets each time, spread over all.
        let stride = (places(&scene).len() / 192).max(1);
        let truth = truths(&scene, eye, stride, 1e-5);
        (n, Squares::of(&frame(gpu, scene), &truth).relative()[0])
    };
    [2, 4, 8, 16, 32].map(of).to_vec()
}

/// A corner of a room: floor and two walls that see each other entirely.
fn corner(n: u32) -> Scene {
    let floor = plate(DVec3::ZERO, DVec3::Z, DVec3::X, 0.5, 0.05, 8.0, n);
    let wall = plate(DVec3::new(0.0, 1.3, -1.2), DVec3::X, DVec3::Y, 0.4, 0.0, 1.0, n);
    let other = plate(DVec3::new(-1.2, 1.3, 0.0), DVec3::Y, DVec3::Z, 0.6, 0.0, 1.0, n);
    let lamp = "[[light]]\nkind = 'directional'\ndirection = [-0.5, -1.0, -0.6]\nirradiance = \
        [3.0, 2.9, 2.7]\n";
    room(
        &[floor, wall, other],
        EYE,
        lamp,
        "gather = 'exact'\npair_size = 100\nbases = 16\nexponents = [7, 9]",
    )
}

#[test]
#[ignore = "minutes; writes docs/pictures/second-convergence.svg"]
fn plot() {
    let gpu = Gpu::new();
    let curves = [
        ("corner without occluders, pairs as they are", by_subdivision(&gpu, corner, EYE)),
        (
            "random rooms, default",
            by_subdivision(&gpu, |n| random_room(0, n, "gather = 'exact'"), EYE),
        ),
        ("random rooms, tree", by_subdivision(&gpu, |n| random_room(0, n, "gather = 'tree'"), EYE)),
    ];
    for (name, points) in &curves {
        let order: Vec<f64> = points.windows(2).map(|w| (w[0].1 / w[1].1).log2()).collect();
        println!("{name}: {points:?}, order {order:?}");
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/pictures/second-convergence.svg");
    std::fs::write(path, svg(&curves)).expect("the plot");
}

/// Log-log slope of the error over facets a side.
fn svg(curves: &[(&str, Vec<(u32, f64)>)]) -> String {
    let (width, height, left, bottom) = (640.0, 420.0, 80.0, 360.0);
    let x = |n: u32| left + 130.0 * (f64::from(n).log2() - 1.0);
    let y = |e: f64| 30.0 - 80.0 * (e.log10() + 0.0);
    let text = |x: f64, y: f64, anchor: &str, text: &str| {
        format!("<text x='{x:.0}' y='{y:.0}' text-anchor='{anchor}'>{text}</text>\n")
    };
    let mut s = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' \
         font-family='sans-serif' font-size='12'>\n<rect width='{width}' height='{height}' \
         fill='white'/>\n"
    );
    for k in 0..=4 {
        let e = 10f64.powi(-k);
        s += &format!(
            "<path d='M{left} {0:.1}H620' stroke='#ccc'/>\n{1}",
            y(e),
            text(left - 8.0, y(e) + 4.0, "end", &format!("{e:e}"))
        );
    }
    for n in [2, 4, 8, 16, 32] {
        s += &format!(
            "<path d='M{0:.1} 30V{bottom}' stroke='#eee'/>\n{1}",
            x(n),
            text(x(n), bottom + 16.0, "middle", &n.to_string())
        );
    }
    s += &text(350.0, bottom + 40.0, "middle", "facets along each side of a surface");
    s += "<text transform='translate(20 200) rotate(-90)' text-anchor='middle'>relative RMS error \
        of L2</text>\n";
    for (k, (name, points)) in curves.iter().enumerate() {
        let color = ["#1b6ca8", "#c0392b", "#2e8b57"][k % 3];
        let path: Vec<String> =
            points.iter().map(|(n, e)| format!("{:.1} {:.1}", x(*n), y(*e))).collect();
        s += &format!(
            "<path d='M{}' fill='none' stroke='{color}' stroke-width='2'/>\n",
            path.join("L")
        );
        s += &format!(
            "<g fill='{color}'>{}</g>\n",
            text(330.0, 46.0 + 16.0 * k as f64, "start", name)
        );
    }
    s + "</svg>\n"
}
