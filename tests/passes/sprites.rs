//! sprites: whole pictures against the f64 reference, both formats, within its bound at each layer.

use std::path::Path;

use crate::bounded::{Random, greatest_ratio};
use crate::harness::{Gpu, assert_within};
use crate::mixed::{EYE, assert_small, cases, front};
use crate::picture::{FORMATS, Picture, Way};
use crate::sheets;
use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::gpu::TargetFormat;
use nimbus::io::scene_file;
use nimbus::layout::facet::LitRecord;
use nimbus::layout::particle::{DrawnRecord, ParticleRecord, TexturedRecord};
use nimbus::model::film::FilmFormat;
use nimbus::passes;
use nimbus::reference::texture::Pool;
use nimbus::reference::{live, place};

/// Draws `picture` in both formats, lit and unlit, and compares every number of every pixel.
/// Greatest value seen.
fn compare(gpu: &mut Gpu, what: &str, picture: &Picture) -> f64 {
    let mut greatest = 0f64;
    let mut random = Random(77);
    let mut lit = || {
        let first = [random.within(0.0, 4.0), random.within(0.0, 1.0), random.within(0.0, 0.01)];
        let second = [random.within(0.0, 0.5), 0.0, random.within(-0.001, 0.1)];
        LitRecord { direct: [9.0; 3], indirect: [9.0; 3], first, second, ..LitRecord::default() }
    };
    // A facet a particle; and facets that several particles share.
    let n = picture.placed.len() as u32;
    let singly = Some((0..n).map(|_| lit()).collect());
    let shared = Some((0..n / 2 + 1).map(|_| lit()).collect());
    let i_facet = Some((0..n).map(|i| (7 * i) % (n / 2 + 1)).collect());
    let singly = Picture { lit: singly, ..picture.clone() };
    let shared = Picture { lit: shared, i_facet, ..picture.clone() };
    // The last picture is drawn in every format. The others are drawn in one, because the shader's
    // light does not depend on the format.
    let all = [(picture.clone(), &FORMATS[2..]), (singly, &FORMATS[1..2]), (shared, &FORMATS[..])];
    for (picture, formats) in all {
        for &(target, format) in formats {
            let what = format!(
                "{what}, {format:?}, {}",
                if picture.lit.is_some() { "lit" } else { "unlit" }
            );
            let values = picture.draw(gpu, None, target);
            let (truths, bounds) = picture.truth(format);
            let r = picture.rounding(format);
            let ratio = greatest_ratio(&values, &truths, &bounds);
            println!("{what}: error/bound {ratio:.3}; α {:.1e}, edge {:.1e}", r.alpha, r.edge);
            assert_within(&what, &values, &truths, &bounds);
            greatest = truths.iter().fold(greatest, |a, b| a.max(*b));
        }
    }
    greatest
}

/// The bound promised for floats; eight bits are rounded at every layer.
#[test]
fn blobs_of_all_kinds_are_near_the_truth() {
    let mut gpu = Gpu::new();
    for (what, picture, least) in cases() {
        let greatest = compare(&mut gpu, &what, &picture);
        assert!(if least > 0.0 { greatest > least } else { greatest == 0.0 }, "{what}: {greatest}");
        for (target, format) in &FORMATS[1..] {
            let values = picture.draw(&mut gpu, None, *target);
            assert_small(
                &what,
                *format,
                [&values, &picture.truth(*format).0],
                picture.most_layers(),
            );
        }
    }
}

#[test]
fn one_blob_centred_and_off_axis() {
    let mut gpu = Gpu::new();
    for (what, at, tau) in
        [("centred", (0.0, 0.0), 1.0), ("off axis", (1.7, 1.1), 0.3), ("dense", (-1.9, 0.9), 30.0)]
    {
        let picture = front();
        let position = picture.at(at.0, at.1, 5.0);
        let drawn = compare(&mut gpu, what, &picture.blob(position, 0.4, tau));
        assert!(drawn > 0.2, "{what} is in the picture");
    }
}

#[test]
fn the_papers_cloud() {
    let mut gpu = Gpu::new();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cubes-554.toml");
    let scene = scene_file::load(&file, &[], None).expect("the scene").scene;
    let groups = scene.groups();
    let generated = live::cloud(&scene.clouds[0], 0.0);
    let positions: Vec<DVec3> = generated.iter().map(|g| g.position).collect();
    let placed = place::place(
        &positions,
        &groups,
        &place::offsets(&groups, &scene.clouds, 0.0, DVec3::ZERO),
    );
    let mut picture =
        Picture::new(DVec3::new(-0.2, -0.3, 18.0), DVec3::new(-0.2, -0.3, 0.0), 45.0, 0.1);
    for (position, g) in placed.iter().zip(&generated) {
        let tau = g.kappa * g.sigma * nimbus::model::cloud::SQRT_TAU;
        picture = picture.blob(*position, g.sigma, tau);
    }
    assert_eq!(picture.placed.len(), 554);
    assert!(compare(&mut gpu, "554 particles", &picture) > 0.9);
}

#[test]
fn the_near_plane_cuts_by_the_centres_depth() {
    let mut gpu = Gpu::new();
    // 1e-4 from the plane: the depth's rounding is some 1e-6.
    let empty = Picture::new(EYE, DVec3::new(0.3, -0.2, 0.0), 45.0, 1.0);
    let near = |z: f64| empty.clone().blob(empty.at(0.05, 0.02, z), 0.1, 1.0);
    assert_eq!(compare(&mut gpu, "before the near plane", &near(0.9999)), 0.0);
    assert!(compare(&mut gpu, "behind the near plane", &near(1.0001)) > 0.5);
    assert_eq!(compare(&mut gpu, "behind the eye", &near(-2.0)), 0.0);
}

#[test]
fn blobs_around_beside_and_far_from_the_camera() {
    let mut gpu = Gpu::new();
    let around = front();
    let at = around.at(0.2, 0.1, 0.5);
    assert!(compare(&mut gpu, "around the camera", &around.blob(at, 2.0, 1.0)) > 0.5);
    let far = front();
    for (x, y, z) in [
        (1e4, 0.0, 5.0),
        (-300.0, 40.0, 5.0),
        (0.0, -1e3, 5.0),
        (3.0, 1e6, 100.0),
        (0.0, 0.0, -50.0),
    ] {
        assert_eq!(compare(&mut gpu, "far off", &far.clone().blob(far.at(x, y, z), 0.5, 1.0)), 0.0);
    }
}

#[test]
fn huge_and_sub_pixel_blobs() {
    let mut gpu = Gpu::new();
    let huge = front();
    let at = huge.at(30.0, 10.0, 40.0);
    assert!(compare(&mut gpu, "huge", &huge.blob(at, 1e4, 0.7)) > 0.3);
    // Pixels of 0.0345 at this depth; the blobs reach 0.0015, on a pixel's ray and between four.
    let small = front();
    let ray = small.view.ray(100, 30) * 5.0;
    let on = small.clone().blob(EYE + ray, 0.0005, 1.0);
    assert!(compare(&mut gpu, "sub-pixel on a ray", &on) > 0.5);
    let between = small.view.ray(100, 30) * 2.5 + small.view.ray(101, 31) * 2.5;
    assert_eq!(
        compare(&mut gpu, "sub-pixel between rays", &small.blob(EYE + between, 0.0005, 1.0)),
        0.0
    );
}

#[test]
fn nothing_to_draw_clears_the_target() {
    let mut gpu = Gpu::new();
    assert_eq!(compare(&mut gpu, "no particles", &front()), 0.0);
    let picture = front();
    let at = picture.at(0.0, 0.0, 5.0);
    assert_eq!(compare(&mut gpu, "no size", &picture.clone().blob(at, 0.0, 1.0)), 0.0);
    assert_eq!(compare(&mut gpu, "no extinction", &picture.clone().blob(at, 0.5, 0.0)), 0.0);
    let both = picture.blob(at, 0.0, 1.0).blob(at, 0.5, 0.0).blob(at, 0.3, 0.5);
    assert!(compare(&mut gpu, "among others", &both) > 0.3);
}

#[test]
fn equal_layers_compose_to_a_power() {
    let mut gpu = Gpu::new();
    let mut picture = front();
    let at = picture.at(0.3, 0.0, 5.0);
    for _ in 0..64 {
        picture = picture.blob(at, 0.5, 0.02);
    }
    assert!(compare(&mut gpu, "64 layers", &picture) > 0.7);
    // In f32 the transmittance through the 64 is that of their sum: 64·0.02, looked at where the
    // ray meets the centre.
    let values = picture.draw(&mut gpu, None, TargetFormat::Rgba32f);
    let most = values.iter().skip(3).step_by(4).cloned().fold(0.0, f64::max);
    // The nearest ray passes within half a pixel's diagonal, 0.025 = 0.05 σ: less by at most 0.13
    // %.
    let whole = -(-1.28f64).exp_m1();
    assert!(most <= whole * (1.0 + 1e-5) && most >= whole * (1.0 - 2e-3), "{most} {whole}");
}

/// Blobs over a field of view of 120 degrees (133 across): in the corner, beside the eye, reaching
/// behind it.
fn wide() -> Picture {
    let p = Picture::new(EYE, DVec3::new(3.0, 1.0, 0.0), 120.0, 0.1);
    let (a, b, c, d) =
        (p.at(2.0, 1.5, 1.0), p.at(-3.0, -2.4, 1.5), p.at(4.0, 0.0, 2.3), p.at(0.1, -1.0, 0.5));
    p.blob(a, 0.2, 1.0).blob(b, 0.5, 0.5).blob(c, 1.4, 0.4).blob(d, 0.33, 0.7)
}

#[test]
fn narrow_and_wide_fields_of_view() {
    let mut gpu = Gpu::new();
    assert!(compare(&mut gpu, "120 degrees", &wide()) > 0.5);
    let narrow = Picture::new(EYE, DVec3::new(1.0, 0.7, -40.0), 1.0, 0.1);
    let (a, b) = (narrow.at(0.1, 0.2, 45.0), narrow.at(-0.3, -0.1, 60.0));
    assert!(compare(&mut gpu, "1 degree", &narrow.blob(a, 0.05, 1.0).blob(b, 0.1, 2.0)) > 0.5);
}

#[test]
fn wrong_pictures_are_noticed() {
    let mut gpu = Gpu::new();
    let picture = wide();
    let (truths, bounds) = picture.truth(FilmFormat::Rgba16f);
    let mut values = picture.draw(&mut gpu, None, TargetFormat::Rgba16f);
    assert!(greatest_ratio(&values, &truths, &bounds) <= 1.0);
    let i = (0..truths.len()).max_by(|a, b| truths[*a].total_cmp(&truths[*b])).expect("pixels");
    values[i] -= 2.0 * bounds[i];
    assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "one corrupted number");
    for (file, from, to) in [
        ("sprites.vert", "0.5 * push.cutoff * push.cutoff", "0.45 * push.cutoff * push.cutoff"),
        ("sprites.frag", " + twist * twist", ""),
        ("sprites.frag", " / (1.0 + dot(ray, ray))", ""),
        ("sprites.frag", "exp2(exponent)", "(1.0 + exponent)"),
        ("sprites.vert", "-0.5 * LOG2_E", "-0.5"),
        ("include/blob.glsl", "GROWTH = 1.0 + 1e-4", "GROWTH = 0.97"),
        ("include/blob.glsl", "min(low, high) > 0.0", "true"),
        ("sprites.vert", "-corner.y", "corner.y"),
        ("sprites.vert", "].y;\n    if (i == NO_PARTICLE)", "].y / 2u;\n    if (i == NO_PARTICLE)"),
    ] {
        let mut sources = passes::sources();
        assert!(sources.replace(file, from, to), "{from}");
        let compiler = Compiler::new(sources, None).expect("shaderc");
        let values = picture.draw(&mut gpu, Some(&compiler), TargetFormat::Rgba16f);
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}

/// Small blobs within the picture, at its edges and beyond.
fn small() -> Picture {
    let mut picture = front();
    for (k, (x, y)) in [(0.0, 0.0), (2.3, 0.4), (-2.31, -1.7), (0.7, 1.73), (9.0, 0.1), (0.2, -1.0)]
        .iter()
        .enumerate()
    {
        let at = picture.at(*x, *y, 5.0 + 0.2 * k as f64);
        picture = picture.blob(at, 0.06 + 0.02 * k as f64, 0.02 + 0.015 * k as f64);
    }
    picture
}

/// Points are for devices that are CPUs; where a blob is larger than the largest point, all are
/// quads there, too. [`Picture::draw`] compares both forms.
#[test]
fn sprites_are_points_unless_one_is_too_large() {
    let mut gpu = Gpu::new();
    let most = f64::from(gpu.device.limits().max_point_size);
    let is_cpu = gpu.device.info().kind == "cpu" && most > 200.0;
    let picture = small();
    assert!(compare(&mut gpu, "points", &picture) > 0.02);
    assert_eq!(picture.has_points(&gpu), is_cpu);
    // Larger than the picture: what lies beyond it is not drawn.
    let at = picture.at(0.3, 0.1, 1.5);
    let huge = picture.clone().blob(at, 100.0, 0.1);
    assert!(compare(&mut gpu, "one is large", &huge) > 0.05);
    assert_eq!(huge.has_points(&gpu), is_cpu);
    if !is_cpu {
        return;
    }
    // At the edge of a larger picture, where blobs of a size are widest.
    let [width, height] = [2.5, 1.875].map(|of_most: f64| (of_most * most) as u32);
    let mut large = front();
    (large.view.width, large.view.height) = (width, height);
    let at = large.at(2.3, 0.1, 5.0);
    for (sigma, is_point) in [(0.25, true), (0.45, false)] {
        let picture = large.clone().blob(at, sigma, 0.1);
        assert_eq!(picture.has_points(&gpu), is_point, "{sigma}");
        for format in [TargetFormat::Rgba8, TargetFormat::Rgba32f] {
            picture.draw(&mut gpu, None, format);
        }
    }
    let (truths, bounds) = picture.truth(FilmFormat::Rgba32f);
    for (from, to) in [
        ("max(sides.x, sides.y)", "0.9 * max(sides.x, sides.y)"),
        ("-0.5 * (y.x + y.y)", "0.5 * (y.x + y.y)"),
        ("? gl_VertexIndex :", "? gl_InstanceIndex :"),
    ] {
        let wrong = Gpu::wrong_compiler("sprites.vert", from, to);
        let values = picture.draw_by(&mut gpu, Some(&wrong), TargetFormat::Rgba32f, Way::Points);
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}

/// Layers that bytes cannot show are left out there: no byte changes.
#[test]
fn what_bytes_cannot_show_is_left_out() {
    let mut gpu = Gpu::new();
    let mut picture = small();
    picture.particles[0].color = [0.5, 20.0, 0.0];
    let own = picture.draw(&mut gpu, None, TargetFormat::Rgba8);
    let whole = Gpu::wrong_compiler("sprites.vert", "BYTES != 0 && TEXTURED == 0", "false");
    assert_eq!(picture.draw(&mut gpu, Some(&whole), TargetFormat::Rgba8), own);
    for (from, to) in [
        ("return 510.0 *", "return 250.0 *"),
        ("max(max(radiance.x, radiance.y), max(radiance.z, 1.0))", "1.0"),
    ] {
        let wrong = Gpu::wrong_compiler("include/target.glsl", from, to);
        assert_ne!(picture.draw(&mut gpu, Some(&wrong), TargetFormat::Rgba8), own, "{from}");
    }
}

/// Groups of which a part is drawn, and the last of it in part.
#[test]
fn what_is_drawn_in_part_has_weights() {
    let mut gpu = Gpu::new();
    let mut picture = front();
    for k in 0..12 {
        let at = picture.at(
            0.35 * f64::from(k) - 2.0,
            0.1 * f64::from(k % 3),
            5.0 + 0.1 * f64::from(k % 5),
        );
        picture = picture.blob(at, 0.4, 0.5);
    }
    let part =
        |end, kappa_scale, last_weight| DrawnRecord { shift: 0, end, kappa_scale, last_weight };
    let i_group = vec![0, 0, 0, 0, 1, 1, 2, 2, 2, 2, 2, 3];
    let drawn = vec![part(3, 1.6, 0.25), part(4, 1.0, 1.0), part(11, 1.0, 1.0), part(12, 3.0, 0.5)];
    let picture = Picture { drawn: Some((i_group, drawn)), ..picture };
    assert!(compare(&mut gpu, "weights", &picture) > 0.3);
    let (truths, bounds) = picture.truth(FilmFormat::Rgba32f);
    for (from, to) in [
        ("group.kappa_scale *", "1.0 *"),
        ("? group.last_weight : 1.0", "? 1.0 : 1.0"),
        ("i + 1u ==", "i =="),
    ] {
        let wrong = Gpu::wrong_compiler("include/blob.glsl", from, to);
        let values = picture.draw(&mut gpu, Some(&wrong), TargetFormat::Rgba32f);
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}

#[test]
fn textures_of_every_size_and_their_mutations() {
    let mut gpu = Gpu::new();
    let pool = Pool::on_device(4);
    let picture = sheets::textured(front(), &pool);
    let levels: std::collections::BTreeSet<usize> =
        picture.sheets().iter().flatten().map(|s| s.level).collect();
    assert_eq!(levels.len(), 6, "every level is met: {levels:?}");
    assert!(compare(&mut gpu, "textured", &picture) > 0.5);
    let (truths, bounds) = picture.truth(FilmFormat::Rgba32f);
    // Textures are seen.
    let plain =
        Picture { textured: None, ..picture.clone() }.draw(&mut gpu, None, TargetFormat::Rgba32f);
    assert!(greatest_ratio(&plain, &truths, &bounds) > 10.0);
    for (from, to) in [
        ("turn.x * delta.x - turn.y * delta.y", "turn.x * delta.x + turn.y * delta.y"),
        ("+ turn.zw", "+ turn.wz"),
        ("- gain.z;", ";"),
        ("share.y * (far - near)", "0.5 * (far - near)"),
        ("share.x * (along.y - along.x)", "0.0"),
        ("gain.y * vec2(b)", "gain.x * vec2(b)"),
        ("i_particle - textured.i_first", "i_particle"),
        ("textured.i_field * FIELD_TEXELS", "0u * FIELD_TEXELS"),
        ("squares.x + 2.0 * own", "squares.x + 1.9 * own"),
        ("1.0, 64.0)", "1.0, 32.0)"),
        ("PERIOD_SIGMA * z_in_sigma;", "PERIOD_SIGMA * z_in_sigma * 1.001;"),
        ("(1u << place.y) - 1u", "(1u << place.y) - 2u"),
        ("ivec2(own << 16,", "ivec2(own << 15,"),
    ] {
        let wrong = Gpu::wrong_compiler("include/texture.glsl", from, to);
        let values = picture.draw(&mut gpu, Some(&wrong), TargetFormat::Rgba32f);
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}

/// From all sides: around the camera, off axis over a wide field, with what is drawn in part.
#[test]
fn textures_of_a_wide_field_and_of_parts() {
    let mut gpu = Gpu::new();
    let pool = Pool::on_device(4);
    let wide = wide();
    let record = |i| TexturedRecord { seed: 3, i_box: 0, i_first: 0, i_field: i, strength: 1.0 };
    let textured = Some((vec![0, 1, 0, 1], vec![record(2), record(5)], pool.clone()));
    let part =
        |end, kappa_scale, last_weight| DrawnRecord { shift: 0, end, kappa_scale, last_weight };
    let drawn = Some((vec![0, 1, 0, 1], vec![part(4, 1.5, 1.0), part(4, 1.0, 0.4)]));
    for drawn in [None, drawn] {
        assert!(
            compare(
                &mut gpu,
                "wide",
                &Picture { textured: textured.clone(), drawn, ..wide.clone() }
            ) > 0.3
        );
    }
    let around = front();
    let at = around.at(0.2, 0.1, 0.5);
    let around = around.blob(at, 2.0, 1.0);
    let textured = Some((vec![0], vec![record(7)], pool));
    assert!(compare(&mut gpu, "around the camera", &Picture { textured, ..around }) > 0.3);
}

/// As the camera comes nearer a picture changes by what the step moved, at changes of level as
/// elsewhere.
#[test]
fn a_nearing_camera_meets_no_step() {
    let pool = Pool::on_device(4);
    let record = TexturedRecord { seed: 3, i_box: 0, i_first: 0, i_field: 6, strength: 1.0 };
    let sheet = |z: f64| {
        let picture = front();
        let at = picture.at(0.0, 0.0, z);
        let picture = picture.blob(at, 0.2, 1.0);
        let picture = Picture { textured: Some((vec![0], vec![record], pool.clone())), ..picture };
        picture.sheets()[0].expect("a sheet")
    };
    let mut levels = std::collections::BTreeSet::new();
    let (mut greatest, mut last) = (0f64, None::<f64>);
    for k in 0..4000 {
        let z = 0.3 * 1.0015f64.powi(k);
        let sheet = sheet(z);
        levels.insert(sheet.level);
        // The same place on the blob.
        let exponent = sheet.factor(&pool, glam::DVec2::new(0.13, 0.05) / z).ln();
        if let Some(last) = last {
            greatest = greatest.max((exponent - last).abs());
        }
        last = Some(exponent);
    }
    assert_eq!(levels.len(), 6);
    // A step of 0.15 % changes the fade by at most 0.003 of n, which is below 5, and the mean by a
    // thousandth; pool's rounding.
    println!("greatest step {greatest:.4}");
    assert!(greatest < 0.02, "{greatest}");
}

#[test]
fn the_records_say_what_the_reference_is_given() {
    // A picture's blobs are its records, so that a slip in either would show as a difference of the
    // other.
    let picture = front().blob(DVec3::ONE, 0.25, 2.0);
    let ParticleRecord { sigma, kappa, .. } = picture.particles[0];
    assert!(
        (f64::from(kappa) * f64::from(sigma) * nimbus::model::cloud::SQRT_TAU - 2.0).abs() < 1e-6
    );
    assert_eq!((picture.placed[0].position, picture.placed[0].sigma), ([1.0; 3], 0.25));
}
