//! present: code values of whole windows against the f64 law, in every format of the film, of one
//! picture and of two.

use crate::bounded::Random;
use crate::harness::Gpu;
use glam::{DVec3, DVec4};
use half::f16;
use nimbus::gpu::TargetFormat;
use nimbus::gpu::{Buffer, Compiler, Image, MemoryUsage};
use nimbus::layout::frame::CameraRecord;
use nimbus::layout::sky::SkyRecord;
use nimbus::model::backdrop::Backdrop;
use nimbus::model::camera::Pose;
use nimbus::model::cover::Sea;
use nimbus::model::film::{Film, FilmFormat, ToneMap};
use nimbus::model::sky::{SUN_RADIUS, Sky, SkySettings, SkyView};
use nimbus::passes::present::{Compare, Present, Shown};
use nimbus::reference::haze::{ROUNDING, magnitude, sea_rounding};
use nimbus::reference::present::{Compared, compared_values};

const SIZE: [u32; 2] = [71, 49];
/// The window is larger, and the picture not in its corner.
const WINDOW: [u32; 2] = [90, 64];
const CORNER: [i32; 2] = [7, -3];

/// The error of a code value before it is rounded down. Vulkan promises: log2 3 ulp of at
/// most 8.3 (or 2^-21), over 2.4 and times ln 2 a relative 8e-7; exp2 3 + 2 · 3.5 ulp, 1.2e-6; the
/// composition and the tone map's three quotients some twenty roundings of 2^-24, 1.2e-6: 3.2e-6 of
/// 255, and twice that for 1.055 v − 0.055 and the sums after it.
const OFF: f64 = 2e-3;

fn film(format: FilmFormat, tone_map: ToneMap) -> Film {
    let background = DVec3::new(0.16, 0.30, 0.55).as_vec3().as_dvec3();
    Film { width: SIZE[0], height: SIZE[1], format, background, exposure: 1.25, tone_map }
}

/// A picture's film and the sky behind it.
#[derive(Clone, Copy)]
struct Set {
    film: Film,
    sky: Option<SkyView>,
}

/// The camera of the sky: level with the horizon, the sun to the right.
fn pose() -> Pose {
    let forward = DVec3::new(0.6, 0.0, -0.8);
    Pose { position: DVec3::ZERO, right: DVec3::new(0.8, 0.0, 0.6), up: DVec3::Y, forward }
}
const FOV: f64 = 0.12;

/// A hazy sky with its disc in the picture, over ground.
fn sky() -> SkyView {
    let settings = SkySettings {
        albedo: DVec3::splat(0.25),
        metres_per_unit: 2.0,
        exaggeration: 4.0,
        haze: 0.5,
        ..SkySettings::of_turbidity(4.0)
    };
    let toward = DVec3::new(0.62, 0.03, -0.78).normalize().as_vec3().as_dvec3();
    let view =
        SkyView::new(&Sky::new(settings, toward).expect("a sky"), DVec3::Y * 8192.0, &[], &[], 0.0);
    SkyView {
        disc: DVec3::new(32.0, 24.0, 8.0),
        ground: Some(DVec3::new(0.25, 0.5, 0.125)),
        ..view
    }
}

/// The same sky without air before a sea.
fn over_sea() -> SkyView {
    let view = sky();
    let settings = SkySettings { haze: 0.0, ..*view.sky.settings() };
    let clear = Sky::new(settings, view.toward_sun()).expect("a sky");
    SkyView {
        sky: clear,
        sea: Some(Sea { slopes: 0.03125 }),
        sun: DVec3::new(2.0, 1.5, 0.5),
        ..view
    }
}

impl Set {
    fn plain(film: Film) -> Set {
        Set { film, sky: None }
    }

    fn backdrop(&self) -> Backdrop {
        match self.sky {
            Some(view) => Backdrop::under(self.film, view, &pose(), FOV),
            None => self.film.into(),
        }
    }

    /// The radiance behind a pixel, and the bound of its rounding.
    fn behind(&self, x: usize, y: usize) -> (DVec3, DVec3) {
        let found = self.backdrop().at(x, y);
        let Some(view) = self.sky else { return (found, DVec3::ZERO) };
        let tan = (0.5 * FOV).tan();
        let [width, height] = SIZE.map(f64::from);
        let right = (2.0 * (x as f64 + 0.5) / width - 1.0) * tan * width / height;
        let up = (1.0 - 2.0 * (y as f64 + 0.5) / height) * tan;
        let direction = (pose().forward + right * pose().right + up * DVec3::Y).normalize();
        // A direction is off by some 2^-23, 3e-5 of the sun's radius; the rim is a tenth wide.
        let near_sun = direction.cross(view.toward_sun()).length() < 1.2 * SUN_RADIUS;
        let rim = if near_sun { 1e-3 * view.disc } else { DVec3::ZERO };
        // In level directions the way to the ground has the error of 1/y, 1e-6/y of it. It shows by
        // 1/e at most, and from 1e-3 down the air is opaque before the ground is reached.
        let level = 1.0 + 1e-6 / direction.y.abs().max(1e-3) / ROUNDING;
        // The direction's own error as much again.
        let mirrored = view.sea.map(|sea| 3.0 * sea_rounding(&view, &sea, direction, 1.0));
        let of_sea = mirrored.unwrap_or_default();
        // Without air a sea ends at the horizon at once, and rounding decides in level directions.
        let is_level = view.sea.is_some() && direction.y.abs() < 1e-6;
        let of_sea = if is_level { DVec3::ONE } else { of_sea };
        (found, ROUNDING * level * (magnitude(&view, direction) + found) + rim + of_sea)
    }
}

/// Ramps over all magnitudes that show, what is beyond, and what is no number.
fn pixels() -> Vec<[f32; 4]> {
    let mut random = Random(3);
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, -1.0, 1e-30, 65504.0, 1.0];
    let n = (SIZE[0] * SIZE[1]) as usize;
    let pixel = |i: usize| match i {
        // In the fifth row: the first three are outside the window.
        280..344 => [odd[i % 8], odd[(i - 280) / 8], 0.25, 1.0],
        _ => {
            let scale = 10f64.powf(f64::from(random.within(-4.0, 1.0)));
            [0; 4]
                .map(|_| random.within(0.0, scale))
                .map(|v| if i.is_multiple_of(3) { v } else { v.min(1.0) })
        }
    };
    (0..n).map(pixel).collect()
}

/// B: of a third of the pixels A's own, of a third nearly, the rest others; what is no number
/// against other such, and against numbers.
fn others() -> Vec<[f32; 4]> {
    let mut random = Random(4);
    let a = pixels();
    let turned = |i: usize| a[(i + 1) % a.len()];
    let other = |(i, pixel): (usize, &[f32; 4])| match i {
        280..344 => {
            if i % 2 == 0 {
                *pixel
            } else {
                turned(i)
            }
        }
        _ => match i % 3 {
            0 => *pixel,
            1 => pixel.map(|v| v * (1.0 + random.within(-1e-3, 1e-3))),
            _ => turned(i * 7),
        },
    };
    a.iter().enumerate().map(other).collect()
}

/// None, and all that two pictures can be compared by.
const COMPARED: [(Option<Compare>, Option<Compared>); 8] = [
    (None, None),
    (Some(Compare::Second), Some(Compared::Second)),
    (Some(Compare::Split { column: 31 }), Some(Compared::Split(31))),
    // In the window's first column, and outside of the picture.
    (Some(Compare::Split { column: 0 }), Some(Compared::Split(0))),
    (Some(Compare::Split { column: -1 }), Some(Compared::Split(-1))),
    (Some(Compare::Split { column: 71 }), Some(Compared::Split(71))),
    (Some(Compare::Difference { gain: 1.0 }), Some(Compared::Difference(1.0))),
    (Some(Compare::Difference { gain: 64.0 }), Some(Compared::Difference(64.0))),
];
const ALONE: (Option<Compare>, Option<Compared>) = COMPARED[0];

/// The further error of a difference: 4 roundings of 2^-24 of what is added up, 5 more of either
/// where bytes are read (2.5 ulp of a quotient), 2 of the gains; and 12.92 is the steepest of sRGB.
fn off_by_differing(film: &Film, gain: f64, [a, b]: [DVec4; 2]) -> DVec3 {
    let size = |p: DVec4| p.truncate().abs() + p.w.abs() * film.background;
    255.0 * 12.92 * 11.0 * 2f64.powi(-24) * gain * film.exposure * (size(a) + size(b))
}

fn bytes_of(format: TargetFormat, pixels: &[[f32; 4]]) -> Vec<u8> {
    let all = pixels.iter().flatten();
    match format {
        TargetFormat::Rgba8 | TargetFormat::Bgra8 => {
            all.map(|v| (255.0 * v.clamp(0.0, 1.0)).round() as u8).collect()
        }
        TargetFormat::Rgba16f => all.flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect(),
        TargetFormat::Rgba32f => all.flat_map(|v| v.to_le_bytes()).collect(),
    }
}

/// As the buffer has it.
fn stored(format: TargetFormat, pixel: [f32; 4]) -> DVec4 {
    DVec4::from(pixel.map(|v| match format {
        TargetFormat::Rgba8 | TargetFormat::Bgra8 => {
            f64::from((255.0 * v.clamp(0.0, 1.0)).round() as u8) / 255.0
        }
        TargetFormat::Rgba16f => f16::from_f32(v).to_f64(),
        TargetFormat::Rgba32f => f64::from(v),
    }))
}

/// Code values of the window.
fn show(
    gpu: &mut Gpu,
    compiler: Option<&Compiler>,
    (from, into): (TargetFormat, TargetFormat),
    set: &Set,
    compare: Option<Compare>,
) -> Vec<u8> {
    let Set { film, sky } = set;
    let compiler = compiler.unwrap_or(&gpu.compiler);
    let pass = Present::new(&gpu.device, compiler, [from, into], sky.is_some()).expect("present");
    let tan = (0.5 * FOV).tan() as f32;
    let pose = pose();
    let camera = CameraRecord {
        tan_x: tan * SIZE[0] as f32 / SIZE[1] as f32,
        tan_y: tan,
        right: pose.right.as_vec3().to_array(),
        up: pose.up.as_vec3().to_array(),
        forward: pose.forward.as_vec3().to_array(),
        ..Default::default()
    };
    let sky = sky.map_or(SkyRecord::default(), |view| SkyRecord::new(&view, camera));
    let sky = gpu.upload(&[sky]);
    let pictures = [pixels(), others()].map(|pixels| gpu.upload(&bytes_of(from, &pixels)));
    let mut window = Image::color_target(&gpu.device, "test.window", WINDOW[0], WINDOW[1], into)
        .expect("a window");
    let n = 4 * u64::from(WINDOW[0]) * u64::from(WINDOW[1]);
    let read =
        Buffer::new::<u8>(&gpu.device, "test.codes", n, MemoryUsage::Readback).expect("room");
    let shown = Shown {
        background: film.background.as_vec3().to_array(),
        exposure: film.exposure as f32,
        size: SIZE,
        corner: CORNER,
        tone_map: film.tone_map as u32,
        compare,
    };
    let [a, b] = &pictures;
    let pictures = if compare.is_some() { [a, b] } else { [a, a] };
    gpu.run(|rec| {
        pass.record(rec, pictures, &sky, &mut window, &shown)?;
        rec.copy_image(&mut window, &read);
        Ok(())
    });
    read.read(n as usize).expect("codes")
}

/// The first pixel that is another than the law and rounding allow.
fn first_wrong(
    set: &Set,
    from: TargetFormat,
    compared: Option<Compared>,
    codes: &[u8],
) -> Option<String> {
    let (a, b, film) = (pixels(), others(), &set.film);
    (0..WINDOW[1] as usize).flat_map(|y| (0..WINDOW[0] as usize).map(move |x| (x, y))).find_map(
        |(x, y)| {
            let code = &codes[4 * (y * WINDOW[0] as usize + x)..][..4];
            let (i, j) = (x as i64 - i64::from(CORNER[0]), y as i64 - i64::from(CORNER[1]));
            let is_inside =
                (0..i64::from(SIZE[0])).contains(&i) && (0..i64::from(SIZE[1])).contains(&j);
            let (truth, off) = if is_inside {
                let (i, j) = (i as usize, j as usize);
                let both = [&a, &b].map(|pixels| stored(from, pixels[j * SIZE[0] as usize + i]));
                let (behind, off_behind) = set.behind(i, j);
                let film = &Film { background: behind, ..*film };
                let gain = match compared {
                    Some(Compared::Difference(gain)) => Some(gain),
                    _ => None,
                };
                let differing = gain.map_or(DVec3::ZERO, |gain| off_by_differing(film, gain, both));
                // 12.92 is the steepest of sRGB, and a tone map rises by 2 at most.
                let shown = both[0].w.abs().max(both[1].w.abs()) + 1.0;
                let of_sky =
                    255.0 * 12.92 * 2.0 * gain.unwrap_or(1.0) * film.exposure * shown * off_behind;
                let off = DVec3::splat(OFF) + differing + of_sky;
                (compared_values(film, behind, compared, i, j, both), off)
            } else {
                (DVec3::ZERO, DVec3::ZERO)
            };
            let is_right = |k: usize| {
                let within = |v: f64| v.floor().clamp(0.0, 255.0);
                // Of what is no number nothing is rounded.
                let off = if off[k].is_finite() { off[k] } else { 0.0 };
                (within(truth[k] - off)..=within(truth[k] + off)).contains(&f64::from(code[k]))
            };
            let is_right = (0..3).all(is_right) && code[3] == 255;
            (!is_right).then(|| format!("pixel ({x}, {y}): {code:?}, expected {truth}"))
        },
    )
}

const FORMATS: [(TargetFormat, FilmFormat); 3] = [
    (TargetFormat::Rgba8, FilmFormat::Rgba8),
    (TargetFormat::Rgba16f, FilmFormat::Rgba16f),
    (TargetFormat::Rgba32f, FilmFormat::Rgba32f),
];

#[test]
fn windows_show_what_files_have() {
    let mut gpu = Gpu::new();
    for (from, format) in FORMATS {
        for (tone_map, sky) in [
            (ToneMap::Neutral, None),
            (ToneMap::Clip, None),
            (ToneMap::Filmic, None),
            (ToneMap::Clip, Some(sky())),
            (ToneMap::Filmic, Some(sky())),
        ] {
            let set = Set { film: film(format, tone_map), sky };
            let mut codes_of = |compare, into| show(&mut gpu, None, (from, into), &set, compare);
            let codes = codes_of(None, TargetFormat::Rgba8);
            for (compare, compared) in COMPARED {
                let codes = codes_of(compare, TargetFormat::Rgba8);
                assert_eq!(
                    first_wrong(&set, from, compared, &codes),
                    None,
                    "{format:?} {tone_map:?} {compare:?}"
                );
            }
            // Windows that have blue first.
            let mut swapped = codes_of(None, TargetFormat::Bgra8);
            swapped.chunks_exact_mut(4).for_each(|p| p.swap(0, 2));
            assert!(swapped == codes);
            // Hardly a pixel is left to rounding: no code value is off by more than the bound's
            // share of a step.
            let n_exact = pixels().len();
            assert!(codes.chunks_exact(4).filter(|p| p[..3] != [0; 3]).count() > n_exact / 2);
        }
    }
}

#[test]
fn wrong_windows_are_noticed() {
    let mut gpu = Gpu::new();
    let set = Set::plain(film(FilmFormat::Rgba16f, ToneMap::Neutral));
    let (split, apart) = (COMPARED[2], COMPARED[7]);
    for (from, to, (compare, compared)) in [
        ("push.exposure * (pixel", "(pixel", ALONE),
        ("/ 2.4", "/ 2.2", ALONE),
        ("+ dither(uvec2(at))", "+ 0.5", ALONE),
        ("(1.0 - pixel.a) * behind", "behind", ALONE),
        ("- push.corner", "", ALONE),
        ("START_COMPRESSION = 0.8", "START_COMPRESSION = 0.9", ALONE),
        ("peak > 3e38 ? vec3(1.0) : ", "", ALONE),
        ("unpackHalf2x16(half_words.y)", "unpackHalf2x16(half_words.x)", ALONE),
        ("(i & 1u) == 0u", "true", ALONE),
        ("push.compare == SECOND || (", "(", COMPARED[1]),
        ("at.x > push.split", "at.x < push.split", split),
        ("at.x == push.split", "false", split),
        ("DASH = 4", "DASH = 2", split),
        ("= is_b ?", "= !is_b ?", split),
        ("pixel_at(true", "pixel_at(false", apart),
        ("push.gain * (", "(", apart),
        ("push.exposure * abs(", "abs(", apart),
        ("* abs(", "* (", apart),
        ("d.rgb - d.a * behind", "d.rgb", apart),
        ("mix(vec3(1.0), far, greaterThanEqual(far, vec3(0.0)))", "far", apart),
    ] {
        let wrong = Gpu::wrong_compiler("present.frag", from, to);
        let formats = (TargetFormat::Rgba16f, TargetFormat::Rgba8);
        let codes = show(&mut gpu, Some(&wrong), formats, &set, compare);
        assert!(
            first_wrong(&set, TargetFormat::Rgba16f, compared, &codes).is_some(),
            "{to} was not noticed"
        );
    }
}

/// Wrong skies, and a wrong curve of the film.
#[test]
fn wrong_skies_are_noticed() {
    let mut gpu = Gpu::new();
    let formats = (TargetFormat::Rgba32f, TargetFormat::Rgba8);
    let set = Set { film: film(FilmFormat::Rgba32f, ToneMap::Filmic), sky: Some(sky()) };
    let is_right = |codes: &[u8]| first_wrong(&set, formats.0, None, codes).is_none();
    assert!(is_right(&show(&mut gpu, None, formats, &set, None)));
    for (file, from, to) in [
        ("present.frag", "0.59) + 0.14", "0.59) + 0.16"),
        ("present.frag", "push.tone_map == FILMIC", "push.tone_map == NEUTRAL"),
        ("present.frag", "vec2(p) + 0.5", "vec2(p)"),
        ("present.frag", "ray.y * camera.up", "ray.y * camera.right"),
        (
            "include/behind.glsl",
            "taken_by(depth) * radiance_of_air(sky, direction)\n               +",
            "",
        ),
        ("include/clear_sky.glsl", "(1.05 - off)", "(1.3 - off)"),
        ("include/behind.glsl", "* share_of_disc", "* 0.0 * share_of_disc"),
        ("include/behind.glsl", "haze.through * (sky.ground", "(sky.ground"),
        ("include/behind.glsl", "sky.unit * sky.flatness", "sky.unit"),
        ("include/behind.glsl", "depth_to_space(sky, sky.height,", "depth_to_space(sky, 0.0,"),
    ] {
        let wrong = Gpu::wrong_compiler(file, from, to);
        assert!(!is_right(&show(&mut gpu, Some(&wrong), formats, &set, None)), "{to} was missed");
    }
    let set = Set { sky: Some(over_sea()), ..set };
    let is_right = |codes: &[u8]| first_wrong(&set, formats.0, None, codes).is_none();
    let codes = show(&mut gpu, None, formats, &set, None);
    assert_eq!(first_wrong(&set, formats.0, None, &codes), None);
    for (file, from, to) in [
        ("include/behind.glsl", "-direction, 1.0)", "-direction, 0.0)"),
        ("include/behind.glsl", "sky.slopes > 0.0", "sky.slopes > 1.0"),
        ("include/sea.glsl", "(4.0 * square * square * shadowed)", "(2.0 * square * shadowed)"),
    ] {
        let wrong = Gpu::wrong_compiler(file, from, to);
        assert!(!is_right(&show(&mut gpu, Some(&wrong), formats, &set, None)), "{to} was missed");
    }
}

/// Where two pictures are the same nothing is off, whatever the gain: code value 0 and nothing
/// else.
#[test]
fn the_same_picture_twice_is_black() {
    let mut gpu = Gpu::new();
    let set = Set::plain(film(FilmFormat::Rgba32f, ToneMap::Neutral));
    let apart = Some(Compare::Difference { gain: 1e9 });
    let codes = show(&mut gpu, None, (TargetFormat::Rgba32f, TargetFormat::Rgba8), &set, apart);
    let (a, b) = (pixels(), others());
    let mut n_same = 0;
    for (k, (a, b)) in
        a.iter().zip(&b).enumerate().filter(|(_, (a, b))| a == b && a.iter().all(|v| v.is_finite()))
    {
        let (x, y) =
            ((k as u32 % SIZE[0]) as i32 + CORNER[0], (k as u32 / SIZE[0]) as i32 + CORNER[1]);
        if y >= 0 {
            let code = &codes[4 * (y as usize * WINDOW[0] as usize + x as usize)..][..4];
            assert_eq!(code, [0, 0, 0, 255], "{a:?} {b:?}");
            n_same += 1;
        }
    }
    assert!(n_same > pixels().len() / 4);
}
