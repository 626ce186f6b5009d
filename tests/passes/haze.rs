//! The pass haze against its f64 reference: whole buffers, every radiance at its own bound.

use crate::harness::{Gpu, assert_within_and_say, check_within};
use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::layout::facet::{FacetRecord, LitRecord, SlopeRecord};
use nimbus::layout::frame::CameraRecord;
use nimbus::layout::sky::SkyRecord;
use nimbus::model::cover::Sea;
use nimbus::model::light::Light;
use nimbus::model::philox::philox4x32_10;
use nimbus::model::sky::{Sky, SkySettings, SkyView};
use nimbus::passes::haze::{HazeBuffers, HazePass, HazeVariant, Push};
use nimbus::reference::haze::{rounding, seen};

const VARIANTS: [HazeVariant; 3] = [
    HazeVariant { has_slopes: true, has_sea: false, has_depths: false },
    HazeVariant { has_slopes: true, has_sea: true, has_depths: false },
    HazeVariant { has_slopes: true, has_sea: true, has_depths: true },
];
const N: usize = 3000;
const EYE: [f32; 3] = [250.0, -40.5, 1e3];

/// Returns numbers from −1 to 1.
fn some(i: u32, k: u32) -> [f32; 4] {
    philox4x32_10([3, 4], [i, k, 0, 0]).map(|word| word as f32 / (1u64 << 31) as f32 - 1.0)
}

/// Views whose numbers are those of their records: from the ground into a low sun, and from high up
/// over exaggerated heights in other units.
fn views() -> [SkyView; 2] {
    let low = SkySettings { albedo: DVec3::new(0.1, 0.2, 0.5), ..SkySettings::of_turbidity(2.0) };
    let high = SkySettings {
        turbidity: 6.5,
        metres_per_unit: 12.5,
        exaggeration: 4.0,
        haze: 0.25,
        sea_level: -96.0,
        ..low
    };
    let view = |settings: SkySettings, toward: DVec3, height: f64| {
        let toward = toward.normalize().as_vec3().as_dvec3();
        let sky = Sky::new(settings, toward).expect("a sky");
        let eye = DVec3::Y * (settings.sea_level + height);
        let sun = Light::Directional { direction: -toward, irradiance: DVec3::new(3.0, 2.5, 2.0) };
        SkyView::new(&sky, eye, &[sun], &[], 0.0)
    };
    [view(low, DVec3::new(0.8, 0.05, -0.6), 2.0), view(high, DVec3::new(-0.3, 0.9, 0.2), 4096.0)]
}

fn facet(i: u32) -> FacetRecord {
    let [x, y, z, size] = some(i, 0);
    let far = 10f32.powf(2.5 + 2.5 * size);
    let offset = match i {
        // At the eye, straight up and down, and level.
        0 => [0.0; 3],
        1 => [0.0, 500.0, 0.0],
        2 => [0.0, -500.0, 0.0],
        3 => [7e3, 0.0, -2e3],
        _ => [x, y, z].map(|v| far * v),
    };
    FacetRecord {
        position: [0, 1, 2].map(|k| EYE[k] + offset[k]),
        i_region: i % 5,
        ..Default::default()
    }
}

fn lit(i: u32) -> LitRecord {
    let color = |k: u32| some(i, k).map(|v| 0.5 + 0.5 * v);
    let [r, g, b, _] = color(1);
    let [r2, g2, b2, bright] = color(2);
    LitRecord {
        direct: [7.0; 3],
        first: [r, g, b].map(|v| 4.0 * bright * v),
        second: if i.is_multiple_of(3) { [0.0; 3] } else { [r2, g2, b2] },
        unresolved: 5.0,
        ..Default::default()
    }
}

fn slope(i: u32) -> SlopeRecord {
    let [x, y, z, _] = some(i, 3);
    SlopeRecord { relative: [x, y, z], position: facet(i).position, ..Default::default() }
}

/// Regions: a plate, land, two seas, and a cloud that a sea's number must not reach.
const SEAS: [f32; 5] = [0.0, 0.0, 0.003, 0.06, 0.06];
const N_SOLIDS: u32 = 4;
const I_SUN: usize = 1;
const N_LIGHTS: usize = 3;
const BACKWARD: f64 = 0.25;

/// The share or the depth of each light at a facet. Some depths are barred.
fn arriving(i: u32, has_depths: bool) -> [f32; N_LIGHTS] {
    let [a, b, c, _] = some(i, 5).map(|v| 0.5 + 0.5 * v);
    match has_depths {
        false => [a, b, c],
        true if i.is_multiple_of(5) => [a, 1e30, c],
        true => [a, 4.0 * b, c],
    }
}

/// The sea of a facet and what arrives of the sun.
fn sea(i: u32, has_depths: bool) -> Option<(Sea, f64)> {
    let slopes = SEAS.get(facet(i).i_region as usize).filter(|_| facet(i).i_region < N_SOLIDS)?;
    let v = f64::from(arriving(i, has_depths)[I_SUN]);
    let sunlit = match has_depths {
        true if v > 1e29 => 0.0,
        true => (-BACKWARD * v).exp(),
        false => v,
    };
    (*slopes > 0.0).then_some((Sea { slopes: f64::from(*slopes) }, sunlit))
}

/// Returns light and slopes after the pass.
fn run(
    gpu: &mut Gpu,
    compiler: Option<&Compiler>,
    view: &SkyView,
    variant: HazeVariant,
) -> (Vec<LitRecord>, Vec<SlopeRecord>) {
    let pass =
        HazePass::new(&gpu.device, compiler.unwrap_or(&gpu.compiler), variant).expect("the pass");
    let seas = gpu.upload(&SEAS);
    let of_lights: Vec<f32> = (0..N as u32).flat_map(|i| arriving(i, variant.has_depths)).collect();
    let of_lights = gpu.upload(&of_lights);
    let push = Push {
        n_facets: N as u32,
        n_lights: N_LIGHTS as u32,
        i_sun: I_SUN as u32,
        n_solids: N_SOLIDS,
        backward: BACKWARD as f32,
    };
    let all = || 0..N as u32;
    let facets = gpu.upload(&all().map(facet).collect::<Vec<_>>());
    let light = gpu.upload(&all().map(lit).collect::<Vec<_>>());
    let slopes = gpu.upload(&all().map(slope).collect::<Vec<_>>());
    let camera = CameraRecord { eye: EYE, ..Default::default() };
    let sky = gpu.upload(&[SkyRecord::new(view, camera)]);
    let hazed = gpu.upload(&vec![LitRecord { second: [9.0; 3], ..Default::default() }; N]);
    let hazed_slopes = gpu.upload(&vec![SlopeRecord::default(); N]);
    let buffers = HazeBuffers {
        facets: &facets,
        lit: &light,
        slopes: &slopes,
        sky: &sky,
        hazed: &hazed,
        hazed_slopes: &hazed_slopes,
        arriving: &of_lights,
        seas: &seas,
    };
    gpu.run(|rec| pass.record(rec, &buffers, &push));
    (gpu.download(&hazed, N), gpu.download(&hazed_slopes, N))
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

/// Returns radiances and slopes in f64, and their bounds.
fn truth(view: &SkyView, variant: HazeVariant) -> [Vec<f64>; 4] {
    let mut all = [vec![], vec![], vec![], vec![]];
    for i in 0..N as u32 {
        let offset = vector(facet(i).position) - vector(EYE);
        let light = vector(lit(i).first) + vector(lit(i).second);
        let sea = sea(i, variant.has_depths).filter(|_| variant.has_sea);
        let (color, share) = seen(view, offset, light, sea);
        let bound = rounding(view, offset, light, sea);
        all[0].extend(color.to_array());
        all[1].extend(bound.to_array());
        let relative = vector(slope(i).relative);
        all[2].extend((share * relative).to_array());
        // The quotient of two sums of three channels.
        let off = 2.0 * bound.element_sum() / color.element_sum() + 1e-6;
        all[3].extend((off * relative.abs() + 1e-9).to_array());
    }
    all
}

fn radiances(of: &[LitRecord]) -> Vec<f64> {
    of.iter().flat_map(|l| l.first.map(f64::from)).collect()
}

#[test]
fn light_behind_air_equals_the_reference() {
    let mut gpu = Gpu::new();
    let names = ["low", "high"];
    let all = views().into_iter().zip(names).flat_map(|of| VARIANTS.map(|variant| (of, variant)));
    for ((view, name), variant) in all {
        let view = &view;
        let [colors, bounds, relative, of_relative] = truth(view, variant);
        let (found, slopes) = run(&mut gpu, None, view, variant);
        assert_within_and_say(name, &radiances(&found), &colors, &bounds);
        let found_slopes: Vec<f64> =
            slopes.iter().flat_map(|s| s.relative.map(f64::from)).collect();
        assert_within_and_say(name, &found_slopes, &relative, &of_relative);
        for (i, (l, s)) in (0u32..).zip(found.iter().zip(&slopes)) {
            assert_eq!((l.direct, l.unresolved, l.second), ([7.0; 3], 5.0, [0.0; 3]), "{i}");
            assert_eq!(s.position, facet(i).position, "{i}");
        }
        // Without slopes they are left as they are.
        let even = HazeVariant { has_slopes: false, ..variant };
        let (same, untouched) = run(&mut gpu, None, view, even);
        assert!(same == found && untouched.iter().all(|s| *s == SlopeRecord::default()));
    }
}

/// In the largest and the smallest scenes that a file may have, all light is a number.
#[test]
fn no_scene_is_too_large_for_its_air() {
    let mut gpu = Gpu::new();
    for (unit, exaggeration, height) in
        [(1e6, 0.01, 1e15), (1e6, 100.0, -1e15), (1e-6, 100.0, 1e15), (1e6, 0.01, 0.0)]
    {
        let settings = SkySettings {
            metres_per_unit: unit,
            exaggeration,
            haze: 100.0,
            ..SkySettings::of_turbidity(10.0)
        };
        let sky = Sky::new(settings, DVec3::Y).expect("a sky");
        let view = SkyView::new(&sky, DVec3::Y * height, &[], &[], 0.0);
        let variant = HazeVariant { has_slopes: false, has_sea: true, has_depths: false };
        let pass = HazePass::new(&gpu.device, &gpu.compiler, variant).expect("the pass");
        let seas = gpu.upload(&[0.003f32]);
        let arriving = gpu.upload(&[1.0f32; 125]);
        let push = Push { n_facets: 125, n_lights: 1, i_sun: 0, n_solids: 1, backward: 1.0 };
        let ends = [-1e15f32, -1.0, 0.0, 1.0, 1e15];
        let at = |k: usize| [ends[k % 5], ends[k / 5 % 5], ends[k / 25]];
        let facet = |k| FacetRecord { position: at(k), ..Default::default() };
        let facets = gpu.upload(&(0..125).map(facet).collect::<Vec<_>>());
        let light = gpu.upload(&[LitRecord { first: [1.0; 3], ..Default::default() }; 125]);
        let sky = gpu.upload(&[SkyRecord::new(&view, CameraRecord::default())]);
        let hazed = gpu.upload(&[LitRecord::default(); 125]);
        let none = gpu.upload(&[SlopeRecord::default()]);
        let buffers = HazeBuffers {
            facets: &facets,
            lit: &light,
            slopes: &none,
            sky: &sky,
            hazed: &hazed,
            hazed_slopes: &none,
            arriving: &arriving,
            seas: &seas,
        };
        gpu.run(|rec| pass.record(rec, &buffers, &push));
        for (k, l) in gpu.download::<LitRecord>(&hazed, 125).iter().enumerate() {
            let is_light = l.first.iter().all(|v| v.is_finite() && *v >= 0.0);
            assert!(is_light, "{unit} {height} {:?}: {:?}", at(k), l.first);
        }
    }
}

#[test]
fn wrong_shaders_are_noticed() {
    let mut gpu = Gpu::new();
    let views: Vec<(SkyView, HazeVariant)> =
        views().into_iter().flat_map(|view| VARIANTS.map(|variant| (view, variant))).collect();
    let truths: Vec<[Vec<f64>; 4]> =
        views.iter().map(|(view, variant)| truth(view, *variant)).collect();
    for (file, from, to) in [
        ("haze.comp", "sent = light.first + light.second", "sent = light.first"),
        ("haze.comp", "through + haze.added", "through"),
        ("haze.comp", "offset / far : ", "offset : "),
        ("haze.comp", "sum(through) / all", "1.0"),
        ("haze.comp", "light.second = vec3(0.0);", ""),
        ("include/clear_sky.glsl", "(up + 0.01)", "(up + 0.02)"),
        ("include/clear_sky.glsl", "sky.d * exp", "exp"),
        (
            "include/clear_sky.glsl",
            "float up = abs(direction.y)",
            "float up = max(direction.y, 0.0)",
        ),
        ("include/angle.glsl", "cosine < 0.0 ? PI - angle", "cosine < 0.0 ? angle"),
        ("include/angle.glsl", "a + b : a - b", "a - b : a - b"),
        ("include/clear_sky.glsl", "around * sqrt(around)", "around"),
        ("include/clear_sky.glsl", "+ sky.h * sqrt(up)", ""),
        ("include/clear_sky.glsl", "vec3(1.0, sky.flatness, 1.0)", "vec3(1.0)"),
        ("include/clear_sky.glsl", "sky.haze * depth_between", "depth_between"),
        ("include/clear_sky.glsl", "taken * radiance_of_air", "radiance_of_air"),
        ("include/clear_sky.glsl", "? 1.0 - x * (0.5", "? 1.0 - x * (0.4"),
        ("include/clear_sky.glsl", "x < 1e-2 ?", "x < 1.0 ?"),
        ("haze.comp", "i_region < push.n_solids ?", "true ?"),
        ("haze.comp", "v < 1e29 ? sunlit : 0.0", "sunlit + 1e-3"),
        ("haze.comp", "i * push.n_lights + push.i_sun", "i * push.n_lights"),
        ("haze.comp", "exp(-push.backward * v)", "exp(-v)"),
        ("include/sea.glsl", "(square * square * away)", "(square * square)"),
        ("include/sea.glsl", "1.0 - density * tail", "1.0"),
        ("include/sea.glsl", "float tilt = deviation * deviation", "float tilt = deviation"),
        ("include/sea.glsl", "(waves_at(deviation, sun).seen / sun_up - 1.0)", "0.0"),
        ("include/sea.glsl", "(4.0 * square * square * shadowed)", "(4.0 * square * shadowed)"),
        ("include/sea.glsl", "* normal.x + deviation * across * normal.y", "* normal.x"),
        ("include/sea.glsl", "2.0 * cosine * normal - toward_eye", "normal"),
    ] {
        let compiler = Gpu::wrong_compiler(file, from, to);
        let is_noticed = views.iter().zip(&truths).any(|((view, variant), truth)| {
            let [colors, bounds, slopes, off] = truth;
            let (found, found_slopes) = run(&mut gpu, Some(&compiler), view, *variant);
            let of_slopes: Vec<f64> =
                found_slopes.iter().flat_map(|s| s.relative.map(f64::from)).collect();
            check_within("wrong", &radiances(&found), colors, bounds).is_err()
                || check_within("wrong", &of_slopes, slopes, off).is_err()
                || found.iter().any(|l| l.second != [0.0; 3])
        });
        assert!(is_noticed, "{to} was not noticed");
    }
}
