//! Random rooms of rectangles, compared with the area reference and with their mirror images.

use super::*;
use nimbus::model::basis::{Basis, Sampling};
use nimbus::model::parallel::parallel_map;
use nimbus::model::philox::{philox4x32_10, uniform};
use nimbus::reference::transmit::{Obstacles, Receiver as Place};

const EYE: DVec3 = DVec3::new(2.0, 3.0, 6.0);

/// Number of facets along each side.
const SIDE: u32 = 8;

struct Room {
    surfaces: Vec<Surface>,
    brdfs: Vec<Brdf>,
    lights: Vec<Light>,
    eye: DVec3,
}

/// Twelve rectangles of half axes 0.3…0.8 in a box of half edge 1.5, a third of them glossy; a sun,
/// a lamp and a sky.
fn random(seed: u32) -> Room {
    let mut n = 0;
    let mut next = || {
        n += 1;
        uniform(philox4x32_10([seed, 78], [n, 0, 0, 0])[0])
    };
    let (mut surfaces, mut brdfs) = (Vec::new(), Vec::new());
    for i in 0..12 {
        let mut vector = || DVec3::new(next(), next(), next());
        let [a, b] = [0; 2].map(|_| (2.0 * vector() - 1.0).normalize());
        let (center, kd) = (3.0 * vector() - 1.5, 0.2 + 0.4 * vector());
        let mut half = || 0.3 + 0.5 * next();
        let surface = plane(center, a * half(), a.cross(b).normalize() * half(), SIDE);
        surfaces.push(Surface { i_material: i, ..surface });
        let ks = if i % 3 == 0 { 0.1 * next() } else { 0.0 };
        brdfs.push(Brdf { kd, ks: DVec3::splat(ks), ns: 50f64.powf(next()) });
    }
    let direction = DVec3::new(next() - 0.5, -1.0, next() - 0.5).normalize();
    // The lamp is away from the rectangles: pairs of facets cannot resolve the light of a lamp
    // nearer than a facet's width.
    let position = DVec3::new(4.0 * next() - 2.0, 2.6 + next(), 4.0 * next() - 2.0);
    let lights = vec![
        Light::Directional { direction, irradiance: DVec3::new(3.0, 2.9, 2.7) },
        Light::Point { position, intensity: DVec3::splat(4.0), radius: 0.05 },
        Light::even_sky(DVec3::new(0.3, 0.4, 0.6), 0.2),
    ];
    Room { surfaces, brdfs, lights, eye: EYE }
}

impl Room {
    /// Returns every `stride`-th facet's index and light, with places and shapes rounded by
    /// `rounded`.
    fn gather_as(&self, stride: usize, rounded: impl Fn(DVec3) -> DVec3) -> Vec<(usize, Gathered)> {
        let mut scene = Scene::of_surfaces(&self.surfaces, matte(1.0));
        let basis = Basis::new([1.0, 100.0], 8, Sampling::Log);
        for (region, brdf) in scene.regions.iter_mut().zip(&self.brdfs) {
            region.brdf = *brdf;
            region.lobe = (brdf.ks != DVec3::ZERO).then(|| basis.lobe(brdf.ns));
        }
        let rectangles: Vec<_> = scene.regions.iter().filter_map(|r| r.rectangle).collect();
        let obstacles = Obstacles {
            spec: &SPEC,
            cells: &[0.0],
            rectangles: &rectangles,
            step: 1.0,
            forward: 1.0,
        };
        let places = scene
            .facets
            .iter()
            .map(|f| Place { position: f.position, i_region: f.i_region as u32 });
        let through = obstacles.through(&places.collect::<Vec<_>>(), &self.lights);
        for r in scene.regions.iter_mut().filter_map(|r| r.rectangle.as_mut()) {
            (r.center, r.u, r.v, r.normal) =
                (rounded(r.center), rounded(r.u), rounded(r.v), rounded(r.normal));
            r.facet = (rounded(r.facet.0), rounded(r.facet.1));
        }
        for f in &mut scene.facets {
            (f.position, f.normal) = (rounded(f.position), rounded(f.normal));
        }
        let exchange = Exchange { eye: self.eye, ..scene.exchange(&self.lights, &through) };
        let senders = exchange.senders();
        parallel_map(scene.facets.len().div_ceil(stride), |k| {
            (k * stride, exchange.gather(k * stride, &senders))
        })
    }

    fn gather(&self, stride: usize) -> Vec<(usize, Gathered)> {
        self.gather_as(stride, |v| v)
    }

    fn mirrored(&self) -> Room {
        let over = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
        let surface =
            |s: &Surface| Surface { center: over(s.center), u: over(s.v), v: over(s.u), ..*s };
        let light = |l: &Light| match *l {
            Light::Directional { direction, irradiance } => {
                Light::Directional { direction: over(direction), irradiance }
            }
            Light::Point { position, intensity, radius } => {
                Light::Point { position: over(position), intensity, radius }
            }
            other => other,
        };
        Room {
            surfaces: self.surfaces.iter().map(surface).collect(),
            brdfs: self.brdfs.clone(),
            lights: self.lights.iter().map(light).collect(),
            eye: over(self.eye),
        }
    }
}

#[test]
fn rooms_agree_with_the_area_reference_and_bounds_are_small() {
    let (mut error, mut value) = ([0.0; 2], [0.0; 2]);
    for seed in 0..8 {
        let room = random(seed);
        let truth = AreaScene::new(&room.surfaces, &room.brdfs, &room.lights, &[], 0.0, &[]);
        let found = room.gather(13);
        let truths = parallel_map(found.len(), |k| {
            let (s, i) = (found[k].0 as u32 / (SIDE * SIDE), found[k].0 as u32 % (SIDE * SIDE));
            let at = truth.on_surface(s as usize, room.surfaces[s as usize].facet_center(i));
            // A tenth of the tolerance below.
            truth.second(&at, (EYE - at.position).normalize(), &Accuracy::relative(1e-3))
        });
        for ((_, found), truth) in found.iter().zip(&truths) {
            let of = [(found.second, truth.radiance), (found.indirect, truth.irradiance)];
            for (k, (found, truth)) in of.into_iter().enumerate() {
                error[k] += (found - truth).length_squared();
                value[k] += truth.length_squared();
            }
        }
        let greatest = found.iter().map(|(_, g)| g.second.max_element()).fold(0.0, f64::max);
        let loose =
            found.iter().filter(|(_, g)| g.second_error.max_element() > 1e-3 * greatest).count();
        assert!(loose * 20 <= found.len());
    }
    let relative = [0, 1].map(|k| f64::sqrt(error[k] / value[k]));
    println!("L2 and I_i {relative:?}");
    // Over 48 such rooms the errors are 1.02 and 1.12 %, nearly all of it where a receiver touches
    // an emitter: parts are discs there, a few percent too dark. In eight rooms one such receiver
    // adds some tenths.
    assert!(relative.iter().all(|r| *r < 0.015), "{relative:?}");
}

#[test]
fn mirrored_rooms_have_mirrored_light() {
    let room = random(11);
    let (found, mirrored) = (room.gather(1), room.mirrored().gather(1));
    let mut n_lit = 0;
    for (j, a) in found {
        // The mirror image swaps u and v.
        let n = SIDE as usize;
        let (s, i) = (j / (n * n), j % (n * n));
        let b = mirrored[s * n * n + i / n + i % n * n].1;
        for (a, b) in [(a.indirect, b.indirect), (a.second, b.second)] {
            assert!((a - b).abs().max_element() <= 1e-10 * a.abs().max_element(), "{j}: {a} {b}");
        }
        n_lit += u32::from(a.indirect.x > 0.0);
    }
    assert!(n_lit > 200, "{n_lit}");
}

#[test]
fn roundings_stay_within_the_bounds() {
    for seed in 20..26 {
        let room = random(seed);
        let rounded = |v: DVec3| v.as_vec3().as_dvec3();
        let mut worst = 0.0f64;
        for ((j, a), (_, b)) in room.gather(5).into_iter().zip(room.gather_as(5, rounded)) {
            for (a, b, error) in
                [(a.indirect, b.indirect, a.indirect_error), (a.second, b.second, a.second_error)]
            {
                let off = ((a - b).abs() / (error + 1e-300)).max_element();
                assert!(off <= 1.0, "{seed} {j}: {a} {b} {error}");
                worst = worst.max(off);
            }
            assert!((a.n_unresolved - b.n_unresolved).abs() <= a.n_doubted, "{seed} {j}");
        }
        // The bound is not vacuous: some differences come within a factor of a thousand.
        assert!(worst > 1e-3, "{worst}");
    }
}
