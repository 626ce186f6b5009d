//! The area reference in random rooms by two methods: quadrature over polygons
//! (docs/explanation/passes.md "area reference") against random paths. They share only the laws of
//! lights and materials.

#[path = "harness/bounded.rs"]
mod bounded;
mod harness;
#[path = "harness/rooms.rs"]
mod rooms;
#[path = "harness/scene_text.rs"]
mod scene_text;

use std::f64::consts::PI;

use bounded::Random;
use glam::DVec3;
use nimbus::model::material::Brdf;
use nimbus::model::scene::Scene;
use nimbus::reference::area::paths::PathSampling;
use nimbus::reference::area::{Accuracy, AreaScene, Receiver};
use rooms::{HEAD, Plate, plates_text, random_plates, sun_and_lamp};
use scene_text::load_with;

const EYE: DVec3 = DVec3::new(2.0, 3.0, 6.0);

/// Contents of a room besides twelve rectangles, sun and lamp.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Plain,
    /// Exponents up to 1000.
    Sharp,
    /// Five of the rectangles are walls that meet, and the others pass through them.
    Walled,
    /// A second lamp, nearer to a rectangle than its own radius.
    NearLamp,
    Spots,
    /// Every second rectangle stands on the previous one.
    Standing,
}

const KINDS: [Kind; 6] =
    [Kind::Plain, Kind::Sharp, Kind::Walled, Kind::NearLamp, Kind::Spots, Kind::Standing];

fn room(seed: u64, kind: Kind) -> Scene {
    let mut r = Random(100 + seed);
    let mut plates = random_plates(&mut r, 12, 1.5, 0.1);
    let mut text = HEAD.to_string() + &sun_and_lamp(&mut r, 2.5);
    match kind {
        Kind::Plain => {}
        Kind::Sharp => plates.iter_mut().for_each(|p| p.ns = p.ns.powf(1.5)),
        Kind::Walled => wall_in(&mut plates),
        Kind::NearLamp => {
            let p = &plates[0];
            let position = (p.center + 0.1 * p.u + 0.02 * p.u.cross(p.v).normalize()).to_array();
            text += &format!("[[light]]\nkind = 'point'\nposition = {position:?}\n");
            text += "intensity = [0.01, 0.01, 0.01]\nradius = 0.05\n";
        }
        Kind::Spots => {
            for (angles, direction) in
                [([20.0, 30.0], [0.3, -1.0, 0.2]), ([3.0, 8.0], [-0.5, -0.2, 1.0])]
            {
                text += "[[light]]\nkind = 'spot'\nposition = [-0.6, 0.7, -1.6]\nintensity = \
                    [9.0, 8.0, 8.0]\n";
                text += &format!(
                    "direction = {direction:?}\ninner_deg = {:?}\nouter_deg = {:?}\n",
                    angles[0], angles[1]
                );
                text += "radius = 0.05\n";
            }
        }
        Kind::Standing => plates.chunks_mut(2).for_each(|pair| {
            let floor = pair[0];
            let p = &mut pair[1];
            p.v = p.v.length() * floor.u.cross(floor.v).normalize();
            p.u = p.u.length() * floor.u.normalize();
            p.center = floor.center + 0.2 * floor.v + p.v;
        }),
    }
    load_with(&(text + &plates_text(&plates)), &[], None).unwrap().scene
}

/// A cube of half edge 1.7 without its front.
fn wall_in(plates: &mut [Plate]) {
    let (x, y, z) = (1.7 * DVec3::X, 1.7 * DVec3::Y, 1.7 * DVec3::Z);
    for (p, wall) in
        plates.iter_mut().zip([(-x, y, z), (x, z, y), (-y, z, x), (y, x, z), (-z, x, y)])
    {
        (p.center, p.u, p.v) = wall;
    }
}

/// Differences in standard errors.
#[derive(Debug, Default)]
struct Differences {
    n: f64,
    squares: f64,
    sum: f64,
}

/// Greatest standard error, as a share of the mean, of a comparison that counts. A greater one says
/// that too few paths met the light.
const MAX_PATH_ERROR: f64 = 0.1;

impl Differences {
    /// `found` ± `error` by paths, `truth` ± `own` by quadrature.
    fn add(&mut self, [found, error]: [f64; 2], [truth, own]: [f64; 2], what: &str) {
        if found == 0.0 || error > MAX_PATH_ERROR * found {
            return;
        }
        let z = (found - truth) / error.hypot(own);
        // Of 1000 normal numbers, one in 2000 such tests has one beyond 5.
        assert!(z.abs() < 5.0, "{what}: {found} ± {error} by paths, {truth} ± {own} by quadrature");
        *self = Differences { n: self.n + 1.0, squares: self.squares + z * z, sum: self.sum + z };
    }

    /// Mean 0 with deviation 1/√n, mean square 1 with √(2/n), each to 4 deviations.
    fn assert_normal(&self, what: &str) {
        let (n, mean, square) = (self.n, self.sum / self.n, self.squares / self.n);
        println!("{what}: of {n} differences mean {mean:.3}, mean square {square:.3}");
        assert!(
            mean.abs() < 4.0 / n.sqrt() && square < 1.0 + 4.0 * (2.0 / n).sqrt(),
            "{what}: {self:?}"
        );
    }
}

/// Compares L2 toward the eye and I_i at every `stride`-th facet's centre of room `seed` by both
/// methods. Returns the differences of L2 in front of the eye and behind, and of I_i.
fn compare(seed: u32, stride: usize, n_paths: u32, found: &mut [Differences; 3]) {
    let kind = KINDS[seed as usize % KINDS.len()];
    let scene = room(u64::from(seed), kind);
    let brdfs: Vec<Brdf> =
        (0..scene.n_regions()).map(|i| scene.region_material(i).at(0.0)).collect();
    let scenery = AreaScene::new(&scene.surfaces, &brdfs, &scene.lights, &[], 0.0, &[]);
    let facets = scene.surfaces.iter().enumerate();
    let facets =
        facets.flat_map(|(s, surface)| (0..surface.n_facets() as u32).map(move |i| (s, i)));
    for (s, i) in facets.skip(seed as usize % stride).step_by(stride) {
        let at = scenery.on_surface(s, scene.surfaces[s].facet_center(i));
        let toward = (EYE - at.position).normalize();
        let e = scenery.second(&at, toward, &Accuracy::relative(1e-4));
        assert!(e.error.is_finite() && e.irradiance_error.is_finite(), "{e:?}");
        let by_paths = |at: &Receiver, seed| {
            let l =
                scenery.reflections(at, toward, 2, PathSampling { n_paths, seed, i_sample: 0 })[1];
            [l.radiance.x, l.error.x]
        };
        let what = format!("room {seed} ({kind:?}), surface {s}, facet {i}");
        let is_behind = usize::from(at.normal.dot(toward) <= 0.0);
        found[is_behind].add(by_paths(&at, seed), [e.radiance.x, e.error], &what);
        // A white receiver's L2 is I_i/π.
        let white = Receiver::new(
            at.position,
            at.normal,
            Brdf { kd: DVec3::ONE, ks: DVec3::ZERO, ns: 1.0 },
        );
        let irradiance = by_paths(&white, seed + 1000).map(|l| PI * l);
        found[2].add(irradiance, [e.irradiance.x, e.irradiance_error], &what);
    }
}

#[test]
fn quadrature_and_paths_agree_in_random_rooms() {
    let mut found: [Differences; 3] = Default::default();
    (0..12).for_each(|seed| compare(seed, 71, 25_000, &mut found));
    for (differences, what) in found.iter().zip(["L2 before the eye", "L2 behind", "I_i"]) {
        differences.assert_normal(what);
        assert!(differences.n >= 30.0, "{what}: {} compared", differences.n);
    }
}
