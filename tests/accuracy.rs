//! How far two reflections of facets are from the integrals over the surfaces' areas (docs/model.md §11, "second").

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
use nimbus::model::light::Light;
use nimbus::model::material::Brdf;
use nimbus::reference::area::mean::each;
use nimbus::reference::area::{Accuracy, Scenery};
use rooms::{Frame, HEAD, Plate, frame, plates_text, random_plates, sun_and_lamp};
use scene_text::load_with;

const EYE: DVec3 = DVec3::new(2.0, 3.0, 6.0);

fn text(plates: &[Plate], lights: &str, lighting: &str) -> String {
    let eye = format!("{HEAD}[camera]\nposition = {:?}\n[lighting]\n{lighting}\n", EYE.to_array());
    eye + lights + &plates_text(plates)
}

fn third(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

#[test]
fn explore() {
    let gpu = Gpu::new();
    for seed in std::env::var("SEEDS").map_or(0..3, |s| 0..s.parse().unwrap()) {
        let mut r = Random(100 + seed);
        let plates = random_plates(&mut r, 12, 1.5, 0.1);
        let lights = sun_and_lamp(&mut r, 2.5);
        let cut = lights.rfind("[[light]]").unwrap();
        let (sun, lamp) = (&lights[..cut], &lights[cut..]);
        for (lighting, lights) in [
            ("gather = 'exact'", &lights[..]),
            ("gather='exact'\npair_size=0.125", &lights[..]),
            ("gather = 'exact'", sun),
            ("gather = 'exact'", lamp),
            ("gather='exact'\npair_size=0.125", sun),
            ("gather='exact'\npair_size=0.125", lamp),
        ] {
            let scene = load_with(&text(&plates, lights, lighting), &[], None).unwrap().scene;
            let t = std::time::Instant::now();
            let live = nimbus::gpu::Compiler::new(
                nimbus::passes::sources().with_dir(std::path::Path::new("shaders")).unwrap(),
                None,
            )
            .unwrap();
            let f = rooms::frame_by(&gpu, &live, scene);
            let t_gpu = t.elapsed();
            let t = std::time::Instant::now();
            let brdfs: Vec<Brdf> = (0..12).map(|i| f.scene.region_material(i).at(0.0)).collect();
            let scenery = Scenery::new(&f.scene.surfaces, &brdfs, &f.scene.lights, &[], 0.0, &[]);
            let truths = each(f.facets.len(), |j| {
                let (s, i) = (j / 64, (j % 64) as u32);
                let receiver = scenery.on_surface(s, f.scene.surfaces[s].facet_center(i));
                let toward = (EYE - receiver.position).normalize();
                scenery.second(&receiver, toward, &Accuracy::relative(1e-3))
            });
            let rms =
                |of: &dyn Fn(usize) -> DVec3| ((0..truths.len()).map(|j| of(j).length_squared()).sum::<f64>()).sqrt();
            let value = rms(&|j| truths[j].radiance);
            let error = |j: usize| third(f.lit[j].second) - truths[j].radiance;
            let ierror = |j: usize| third(f.lit[j].indirect) - truths[j].irradiance;
            println!(
                "seed {seed} {lighting:?} {}: L2 {:.5} I_i {:.5} unresolved {} gpu {t_gpu:?} truth {:?}",
                lights.len(),
                rms(&error) / value,
                rms(&ierror) / rms(&|j| truths[j].irradiance),
                f.lit.iter().map(|l| l.n_unresolved).sum::<f32>(),
                t.elapsed()
            );
            let mut worst: Vec<usize> = (0..truths.len()).collect();
            worst.sort_by(|a, b| error(*b).length().total_cmp(&error(*a).length()));
            let total: f64 = (0..truths.len()).map(|j| error(j).length_squared()).sum();
            for &j in &worst[..2] {
                println!(
                    "   {} {} gpu {:?} truth {} err {:.4} share {:.3} unres {} {}",
                    j / 64,
                    j % 64,
                    f.lit[j].second,
                    truths[j].radiance,
                    error(j).length() / truths[j].radiance.length(),
                    error(j).length_squared() / total,
                    f.lit[j].n_unresolved,
                    f.lit[j].unresolved
                );
            }
        }
    }
}
