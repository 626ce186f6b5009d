//! impostors: whole buffers of parted entries, and whole pictures of shells seen from elsewhere,
//! against the f64 reference within a derived bound.

use crate::harness::{Gpu, assert_within_and_say, check_within};
use glam::{DMat3, DQuat, DVec2, DVec3};
use nimbus::gpu::TargetFormat;
use nimbus::gpu::{Buffer, Compiler, Image, MemoryUsage, Target};
use nimbus::layout::facet::{LitRecord, RegionRecord};
use nimbus::layout::frame::CameraRecord;
use nimbus::layout::particle::PlacedRecord;
use nimbus::model::impostor::{FarField, Shell, View};
use nimbus::passes::impostors::{Impostors, LayerView, PartBuffers};
use nimbus::passes::surfaces::Surfaces;
use nimbus::reference::impostors::{Picture, part, place_of, sample};

/// Unit round-off of f32.
const U: f64 = 1.0 / 16_777_216.0;
const SIZE: [u32; 2] = [96, 64];
const SHELL: [u32; 2] = [120, 81];
const TANGENTS: DVec2 = DVec2::new(0.6, 0.4);
const EYE: DVec3 = DVec3::new(0.3, -0.2, 5.0);

fn hashed(i: u32) -> u32 {
    let x = i.wrapping_mul(0x9E37_79B9) ^ (i >> 3).wrapping_mul(0x85EB_CA6B);
    (x ^ x >> 15).wrapping_mul(0x2C1B_3C6D)
}

/// Noise, in which every texel differs from its neighbours; some of it transparent, some beyond 1.
fn texels() -> Vec<[f64; 4]> {
    let value = |i: u32, k: u32| f64::from(hashed(4 * i + k) >> 8) / f64::from(1u32 << 24);
    let of = |i: u32| {
        let alpha = (1.5 * value(i, 3) - 0.3).clamp(0.0, 1.0);
        [2.5 * alpha * value(i, 0), alpha * value(i, 1), alpha * value(i, 2), alpha]
            .map(|v| f64::from(v as f32))
    };
    (0..SHELL[0] * SHELL[1]).map(of).collect()
}

fn view(eye: DVec3, turn: DQuat, tangents: DVec2) -> View {
    View {
        eye,
        right: turn * DVec3::X,
        up: turn * DVec3::Y,
        forward: turn * DVec3::NEG_Z,
        tangents,
    }
}

fn shell() -> Shell {
    let tangents = TANGENTS
        * DVec2::new(
            f64::from(SHELL[0]) / f64::from(SIZE[0]),
            f64::from(SHELL[1]) / f64::from(SIZE[1]),
        );
    let far = FarField { nearest: 4.0, farthest: 9.0, sigma: 0.3, radius: 0.9 };
    Shell { view: view(EYE, DQuat::IDENTITY, tangents), far }
}

/// Views of the shell: its own, moved, turned and rolled, and one that looks beyond its edges.
fn views() -> Vec<(&'static str, View)> {
    let at = |offset: DVec3, axis: DVec3, angle: f64| {
        view(EYE + offset, DQuat::from_axis_angle(axis.normalize(), angle), TANGENTS)
    };
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    vec![
        ("its own", at(DVec3::ZERO, y, 0.0)),
        ("beside it", at(0.11 * x - 0.07 * y, y, 0.0)),
        ("nearer", at(-0.31 * z, y, 0.0)),
        ("turned", at(DVec3::ZERO, y + 0.3 * x, 0.04)),
        ("rolled", at(0.02 * x, z, 0.05)),
        ("all of it", at(0.2 * x + 0.1 * y - 0.4 * z, x + 0.7 * y - 0.2 * z, 0.06)),
        ("beyond its edges", at(1.3 * x, y, -0.5)),
    ]
}

fn shown(shell: &Shell, now: &View, depth: f32) -> LayerView {
    LayerView {
        to_layer: shell.homography(now),
        view_tangents: now.tangents,
        layer_tangents: shell.view.tangents,
        size: SHELL,
        bounds: [-now.tangents, now.tangents],
        depth,
    }
}

/// The expected value of each pixel, and the bound.
///
/// Its place: every entry of the homography between pixels is rounded once, each of the three sums
/// of three terms takes five roundings more at most, the division 2.5 ulp, and two sums of half an
/// extent: with |terms| the sum of a row's terms' magnitudes, (6 U |terms| + |place| 6 U
/// |under|)/under + 5 U |place| + 2 U extent. The cubic: weights to 8 U of at most 1.375 in
/// magnitude (four products and three sums), three products and six sums: 24 U of each term's
/// magnitude, once more where weights cancel to less: 48 U.
fn truth(picture: &Picture<'_>, shell: &Shell, now: &View, unit: f64) -> (Vec<f64>, Vec<f64>) {
    let to_shell = shell.homography(now);
    let (mut truths, mut bounds) = (vec![], vec![]);
    let middle = DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1])) * 0.5;
    let slopes = DMat3::from_diagonal(DVec3::new(
        now.tangents.x / middle.x,
        -now.tangents.y / middle.y,
        1.0,
    ));
    let extent = DVec2::new(f64::from(SHELL[0]), f64::from(SHELL[1]));
    let texels = 0.5 * extent / shell.view.tangents;
    let of = (DMat3::from_diagonal(DVec3::new(texels.x, -texels.y, 1.0)) * to_shell * slopes)
        .transpose();
    for j in 0..SIZE[1] {
        for i in 0..SIZE[0] {
            let at = place_of(&to_shell, SIZE, now.tangents, picture, [i, j]);
            let pixel =
                DVec3::new(f64::from(i) + 0.5 - middle.x, f64::from(j) + 0.5 - middle.y, 1.0);
            let size = |row: DVec3| (row * pixel).abs().element_sum();
            let under = of.z_axis.dot(pixel);
            let off = (at + 0.5 - 0.5 * extent).abs();
            let along = |row: DVec3, off: f64, n: f64| {
                6.0 * U * (size(row) + off * size(of.z_axis)) / under + 5.0 * U * off + 2.0 * U * n
            };
            let place = along(of.x_axis, off.x, extent.x).max(along(of.y_axis, off.y, extent.y));
            let (value, bound) = sample(picture, at, 2.0 * place, 48.0 * U);
            truths.extend(value);
            bounds.extend(
                value.iter().zip(bound).map(|(v, b)| b + unit * (v.abs() + b) + 6e-8 * unit / U),
            );
        }
    }
    (truths, bounds)
}

/// The pass's output over that of `over`.
fn draw(
    gpu: &mut Gpu,
    compiler: Option<&Compiler>,
    format: TargetFormat,
    shown: &LayerView,
) -> Vec<f64> {
    let pass = Impostors::new(&gpu.device, compiler.unwrap_or(&gpu.compiler), format, false)
        .expect("the pass");
    let texels: Vec<[f32; 4]> = texels().iter().map(|t| t.map(|v| v as f32)).collect();
    let shell = gpu.upload(&texels);
    let mut target = Image::color_target(&gpu.device, "test.target", SIZE[0], SIZE[1], format)
        .expect("a target");
    gpu.run(|rec| pass.record_show(rec, &shell, Target::color(&mut target), shown));
    read(gpu, &mut target, format)
}

fn read(gpu: &mut Gpu, target: &mut Image, format: TargetFormat) -> Vec<f64> {
    let n = (SIZE[0] * SIZE[1]) as usize;
    let bytes = n as u64 * format.bytes_per_pixel();
    let readback = Buffer::new::<u8>(&gpu.device, "test.readback", bytes, MemoryUsage::Readback)
        .expect("readback");
    gpu.run(|rec| {
        rec.copy_image(target, &readback);
        Ok(())
    });
    match format {
        TargetFormat::Rgba16f => {
            readback.read::<half::f16>(4 * n).expect("read").iter().map(|h| h.to_f64()).collect()
        }
        _ => readback.read::<f32>(4 * n).expect("read").iter().map(|v| f64::from(*v)).collect(),
    }
}

#[test]
fn shells_seen_from_elsewhere() {
    let mut gpu = Gpu::new();
    let (shell, texels) = (shell(), texels());
    let picture = Picture {
        width: SHELL[0],
        height: SHELL[1],
        tangents: shell.view.tangents,
        texels: &texels,
    };
    for (what, now) in views() {
        // Half floats are rounded to nearest or toward zero.
        for (format, unit) in
            [(TargetFormat::Rgba32f, 0.0), (TargetFormat::Rgba16f, 2f64.powi(-10))]
        {
            let (truths, bounds) = truth(&picture, &shell, &now, unit);
            let values = draw(&mut gpu, None, format, &shown(&shell, &now, 0.0));
            assert_within_and_say(&format!("{what}, {format:?}"), &values, &truths, &bounds);
        }
    }
}

#[test]
fn nothing_is_drawn_beyond_the_bounds() {
    let mut gpu = Gpu::new();
    let (shell, now) = (shell(), views().swap_remove(0).1);
    let whole = draw(&mut gpu, None, TargetFormat::Rgba32f, &shown(&shell, &now, 0.0));
    // Slopes of pixel edges: 24 to 72 of 96 columns, and 8 to 32 of 64 rows from the top.
    let bounds = [DVec2::new(-0.3, 0.0), DVec2::new(0.3, 0.3)];
    let part = draw(
        &mut gpu,
        None,
        TargetFormat::Rgba32f,
        &LayerView { bounds, ..shown(&shell, &now, 0.0) },
    );
    for (p, (a, b)) in part.chunks(4).zip(whole.chunks(4)).enumerate() {
        let (i, j) = (p as u32 % SIZE[0], p as u32 / SIZE[0]);
        let within = (24..72).contains(&i) && (8..32).contains(&j);
        assert_eq!(a, if within { b } else { &[0.0; 4] }, "{i} {j}");
    }
}

#[test]
fn a_wrong_shader_is_noticed() {
    let mut gpu = Gpu::new();
    let (shell, texels) = (shell(), texels());
    let picture = Picture {
        width: SHELL[0],
        height: SHELL[1],
        tangents: shell.view.tangents,
        texels: &texels,
    };
    let (_, now) = views().swap_remove(5);
    let (truths, bounds) = truth(&picture, &shell, &now, 0.0);
    for (from, to) in [
        ("+ 0.5 * extent - 0.5", "+ 0.5 * extent - 0.499"),
        ("dot(push.under, pixel)", "push.under.z"),
        ("2.0 - 5.0 * t2 + 3.0 * t3", "2.0 - 4.99 * t2 + 2.99 * t3"),
        ("ivec2(low) - 1", "ivec2(low)"),
        ("across.w * texel(i.w, j[k])", "across.w * texel(i.z, j[k])"),
        ("j * int(push.width) + i", "j * int(push.height) + i"),
        ("max(sum.xyz, 0.0)", "sum.xyz"),
        ("clamp(sum.w, 0.0, 1.0)", "sum.w"),
        (
            "vec4 across = weights(at.x - low.x), down = weights(at.y - low.y)",
            "vec4 across = weights(at.x - low.x), down = across",
        ),
    ] {
        let compiler = Gpu::wrong_compiler("impostors.frag", from, to);
        let values =
            draw(&mut gpu, Some(&compiler), TargetFormat::Rgba32f, &shown(&shell, &now, 0.0));
        assert!(check_within("wrong", &values, &truths, &bounds).is_err(), "{from} as {to}");
    }
    let values = draw(&mut gpu, None, TargetFormat::Rgba32f, &shown(&shell, &now, 0.0));
    assert!(check_within("right", &values, &truths, &bounds).is_ok());
}

#[test]
fn a_surface_shows_before_the_shell_and_under_it() {
    let mut gpu = Gpu::new();
    let format = TargetFormat::Rgba32f;
    let (shell, texels) = (shell(), texels());
    let picture = Picture {
        width: SHELL[0],
        height: SHELL[1],
        tangents: shell.view.tangents,
        texels: &texels,
    };
    let (_, now) = views().swap_remove(1);
    let (truths, bounds) = truth(&picture, &shell, &now, 0.0);
    let pass = Impostors::new(&gpu.device, &gpu.compiler, format, true).expect("the pass");
    let surfaces = Surfaces::new(&gpu.device, &gpu.compiler, format, false).expect("surfaces");
    let f32s = |v: DVec3| v.as_vec3().to_array();
    // A wall across the whole view at depth 5, near 0.1.
    let camera = CameraRecord {
        eye: f32s(now.eye),
        tan_x: TANGENTS.x as f32,
        right: f32s(now.right),
        tan_y: TANGENTS.y as f32,
        up: f32s(now.up),
        near: 0.1,
        forward: f32s(now.forward),
        unused: 0.0,
    };
    let wall = RegionRecord {
        center: f32s(now.eye + 5.0 * now.forward),
        u: [9.0, 0.0, 0.0],
        v: [0.0, 9.0, 0.0],
        normal: [0.0, 0.0, 1.0],
        n_u: 1,
        n_v: 1,
        n_facets: 1,
        ..RegionRecord::default()
    };
    let lit = LitRecord { first: [0.5, 0.25, 0.125], ..LitRecord::default() };
    let (regions, lit) = (gpu.upload(&[wall]), gpu.upload(&[lit]));
    let shell_texels: Vec<[f32; 4]> = texels.iter().map(|t| t.map(|v| v as f32)).collect();
    let shell_buffer = gpu.upload(&shell_texels);
    let behind = [0.5, 0.25, 0.125, 1.0];
    for (depth, is_hidden) in [(0.1 / 5.1, true), (0.1 / 4.9, false)] {
        let mut color = Image::color_target(&gpu.device, "test.target", SIZE[0], SIZE[1], format)
            .expect("a target");
        let mut far = Image::depth(&gpu.device, "test.depth", SIZE[0], SIZE[1]).expect("depth");
        let shown = shown(&shell, &now, depth as f32);
        gpu.run(|rec| {
            let target = Target { color: &mut color, depth: Some(&mut far) };
            surfaces.record(rec, [&regions, &lit], target, &camera, 1)?;
            pass.record_show(
                rec,
                &shell_buffer,
                Target { color: &mut color, depth: Some(&mut far) },
                &shown,
            )
        });
        let values = read(&mut gpu, &mut color, format);
        let over = |(i, t): (usize, &f64)| match is_hidden {
            true => behind[i % 4],
            false => t + (1.0 - truths[i / 4 * 4 + 3]) * behind[i % 4],
        };
        let wanted: Vec<f64> = truths.iter().enumerate().map(over).collect();
        // Blending rounds a product and a sum.
        let bounds: Vec<f64> = (0..wanted.len())
            .map(|i| bounds[i] + bounds[i / 4 * 4 + 3] + 4.0 * U * (1.0 + wanted[i].abs()))
            .collect();
        assert_within_and_say(&format!("hidden: {is_hidden}"), &values, &wanted, &bounds);
    }
}

#[test]
fn what_is_far_and_what_is_near() {
    let mut gpu = Gpu::new();
    let n = 5000u32;
    // Keys that say nothing, each particle once.
    let entries: Vec<[u32; 2]> = (0..n).map(|k| [k / 7 * 3, (k * 2741 + 5) % n]).collect();
    // Sixteenths, many alike, so that the sums of products with the axis are exact.
    let sixteenth = |i: u32| f64::from(hashed(i) % 129) / 16.0 - 4.0;
    let places: Vec<DVec3> = (0..n)
        .map(|i| DVec3::new(sixteenth(3 * i), sixteenth(3 * i + 1), sixteenth(3 * i + 2)))
        .collect();
    let axis = DVec3::new(0.5, -0.25, 0.75);
    let depths: Vec<f64> = places.iter().map(|p| axis.dot(*p)).collect();
    let placed: Vec<PlacedRecord> = places
        .iter()
        .map(|p| PlacedRecord { position: p.as_vec3().to_array(), sigma: 1.0 })
        .collect();
    let turned: Vec<[u32; 2]> = (0..n).map(|k| [k, (k * 1999 + 77) % n]).collect();
    let run = |gpu: &mut Gpu, compiler: Option<&Compiler>, cut: f64| {
        let format = TargetFormat::Rgba16f;
        let pass = Impostors::new(&gpu.device, compiler.unwrap_or(&gpu.compiler), format, false)
            .expect("the pass");
        let [first, second] = [&entries, &turned].map(|e| gpu.upload(e));
        let (members, placed) = (gpu.upload(&vec![9u32; n as usize + 3]), gpu.upload(&placed));
        let [far, near] = [gpu.buffer::<[u32; 2]>(n as usize), gpu.buffer::<[u32; 2]>(n as usize)];
        let mut found = vec![];
        for (from, cut, n_drawn) in
            [(&first, Some(cut), n), (&second, None, n), (&second, None, n - 900)]
        {
            let (members, far, near, placed) = (&members, &far, &near, &placed);
            let part = PartBuffers { entries: from, members, far, near, placed };
            let cut = cut.map(|cut: f64| (axis.as_vec3().to_array(), cut as f32));
            gpu.run(|rec| pass.record_part(rec, part, n_drawn, cut));
            let count = n_drawn as usize;
            found.push((
                gpu.download::<[u32; 2]>(far, count),
                gpu.download::<[u32; 2]>(near, count),
            ));
        }
        (found, gpu.download::<u32>(&members, n as usize + 3))
    };
    let wanted = |cut: f64| {
        let mut members = vec![9; n as usize + 3];
        let mut found = vec![];
        for (from, cut, n_drawn) in
            [(&entries, Some(cut), n), (&turned, None, n), (&turned, None, n - 900)]
        {
            let cut = cut.map(|cut| (&depths[..], cut));
            let [far, near] = part(&from[..n_drawn as usize], &mut members, cut);
            found.push((far, near));
        }
        (found, members)
    };
    for cut in [-10.0, -1.25, 0.0, 0.75, 10.0] {
        assert!(run(&mut gpu, None, cut) == wanted(cut), "{cut}");
    }
    for (from, to) in [
        (".position) >= push.cut", ".position) > push.cut"),
        ("members[entry.y] != 0", "members[k] != 0"),
        ("is_far ? NO_PARTICLE : entry.y", "entry.y"),
        ("push.is_new != 0", "true"),
    ] {
        let compiler = Gpu::wrong_compiler("impostors_part.comp", from, to);
        assert!(run(&mut gpu, Some(&compiler), 0.75) != wanted(0.75), "{from} as {to}");
    }
}
