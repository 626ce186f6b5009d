//! Sprites, and the bound on a target of few bits.

use super::one_box;
use glam::{DVec2, DVec3};
use half::f16;
use nimbus::model::boxes::{BoxLaw, Form};
use nimbus::model::camera::Pose;
use nimbus::model::cloud::{SQRT_TAU, Shape, box_kappa};
use nimbus::model::edge::Edge;
use nimbus::model::film::FilmFormat;
use nimbus::reference::Blob;
use nimbus::reference::composite::{OpaquePixel, Rounding};
use nimbus::reference::generate::{offset, radius, uniforms};
use nimbus::reference::sprites::{Bounded, Sprites, alpha, render, render_over};
use nimbus::reference::view::View;
use std::f64::consts::FRAC_PI_2;

/// Numbers in [0, 1) that select the tests' own inputs.
fn lots(i: u32) -> [f64; 4] {
    uniforms(0x7e57, 0, i, 0)
}

/// Blobs without textures.
fn plain<'a>(blobs: &'a [Blob], radiance: &'a [DVec3], order: &'a [u32]) -> Sprites<'a> {
    Sprites { blobs, radiance, order, factor: None, shades: None, cells: None }
}

/// The picture over nothing and its bound.
fn over_nothing(view: &View, sprites: &Sprites, rounding: &Rounding) -> Bounded {
    let nothing = vec![OpaquePixel::EMPTY; (view.width * view.height) as usize];
    render_over(view, &nothing, sprites, rounding)
}

fn view(width: u32, height: u32) -> View {
    let pose = Pose { position: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z };
    View {
        width,
        height,
        pose,
        fov_y_rad: FRAC_PI_2,
        near: 0.1,
        edge: Edge::at(3.0),
        smallest: 0.0,
        slice: 0.0,
        n_parts: 4,
        shift: DVec2::ZERO,
    }
}

/// Blobs before the camera, far to near, and a radiance each.
fn scattered(n: u32, nearest: f64) -> (Vec<Blob>, Vec<DVec3>) {
    let blob = |i: u32| {
        let [a, b, c, d] = lots(2 * i);
        let depth = nearest + 8.0 * f64::from(n - i) / f64::from(n);
        let position = DVec3::new((2.0 * a - 1.0) * depth, (2.0 * b - 1.0) * depth, -depth);
        Blob { shape: Shape::BALL, position, sigma: 0.1 + c, kappa: 0.4 * d }
    };
    let color = |i: u32| DVec3::from_slice(&lots(2 * i + 1)[..3]);
    ((0..n).map(blob).collect(), (0..n).map(color).collect())
}

#[test]
fn one_blob_at_two_pixels() {
    let blob = Blob { shape: Shape::BALL, position: DVec3::NEG_Z * 3.0, sigma: 1.0, kappa: 0.6 };
    let color = DVec3::new(0.2, 0.5, 2.0);
    let image = render(&view(5, 3), &plain(&[blob], &[color], &[0]));
    // Centre pixel: b = 0, τ = √(2π)κσ. Column 3 of the middle row: direction (2·3.5/5 − 1)·5/3 =
    // 2/3 to the right of forward, b = 3·(2/3)/√(1 + 4/9) = 6/√13, e^{−b²/2} = e^{−18/13}.
    for (i, tau) in [(7, 0.6 * SQRT_TAU), (8, 0.6 * SQRT_TAU * (-18.0f64 / 13.0).exp())] {
        let a = 1.0 - (-tau).exp();
        let expected = [0.2 * a, 0.5 * a, 2.0 * a, a];
        assert!((0..4).all(|k| (image[i][k] - expected[k]).abs() < 1e-15), "{i}");
    }
    // Eye and particle moved together give the same picture. Up in the picture is up in the scene.
    let mut moved = view(5, 3);
    moved.pose.position = DVec3::X;
    let raised = Blob { position: blob.position + DVec3::X + DVec3::Y, ..blob };
    let image = render(&moved, &plain(&[raised], &[color], &[0]));
    assert!(image[2][3] > image[12][3]);
    assert!((alpha(blob.deepest()) + (-0.6 * SQRT_TAU).exp_m1()).abs() < 1e-15);
}

#[test]
fn what_is_behind_near_or_absent_is_not_drawn() {
    let zeros = vec![[0.0; 4]; 15];
    let at = |z| Blob { shape: Shape::BALL, position: DVec3::Z * z, sigma: 1.0, kappa: 0.6 };
    for z in [3.0, 0.0, -0.0999, f64::NAN] {
        assert_eq!(render(&view(5, 3), &plain(&[at(z)], &[DVec3::ONE], &[0])), zeros);
    }
    assert_eq!(render(&view(5, 3), &plain(&[], &[], &[])), zeros);
    assert_ne!(render(&view(5, 3), &plain(&[at(-0.1)], &[DVec3::ONE], &[0])), zeros);
    // Beyond three σ the pixel is empty: b = 3·(4/5·5/3)/√(1 + 16/9) = 2.4 at column 4.
    let image =
        render(&view(5, 3), &plain(&[Blob { sigma: 0.79, ..at(-3.0) }], &[DVec3::ONE], &[0]));
    assert_eq!(image[9], [0.0; 4]);
    assert!(
        render(&view(5, 3), &plain(&[Blob { sigma: 0.81, ..at(-3.0) }], &[DVec3::ONE], &[0]))[9][3]
            > 0.0
    );
}

#[test]
fn equal_colors_hide_the_order_and_equal_layers_multiply() {
    let (blobs, _) = scattered(60, 0.5);
    let color = DVec3::new(0.3, 0.6, 0.9);
    let view = view(24, 16);
    let forth: Vec<u32> = (0..60).collect();
    let back: Vec<u32> = (0..60).rev().collect();
    let a = render(&view, &plain(&blobs, &[color; 60], &forth));
    let b = render(&view, &plain(&blobs, &[color; 60], &back));
    // C = c(1 − T) whatever the order; 60 layers of a few roundings of numbers below 1.
    for (a, b) in a.iter().zip(&b) {
        assert!((0..4).all(|k| (a[k] - b[k]).abs() < 1e-13) && (a[2] - 0.9 * a[3]).abs() < 1e-13);
    }
    let layer = Blob { shape: Shape::BALL, position: DVec3::NEG_Z * 3.0, sigma: 1.0, kappa: 0.1 };
    let image = render(&view, &plain(&[layer; 7], &[color; 7], &[0, 1, 2, 3, 4, 5, 6]));
    let one = render(&view, &plain(&[layer], &[color], &[0]));
    assert!(
        image
            .iter()
            .zip(&one)
            .all(|(n, one)| (n[3] - (1.0 - (1.0 - one[3]).powi(7))).abs() < 1e-14)
    );
}

/// The pixel's layers by definition, without bounding rectangles: α and radiance of every blob, far
/// to near.
fn layers(view: &View, blobs: &[Blob], radiance: &[DVec3], i: u32, j: u32) -> Vec<(f64, DVec3)> {
    let d = view.ray(i, j);
    let seen =
        blobs.iter().zip(radiance).filter(|(b, _)| b.position.dot(view.pose.forward) >= view.near);
    let lines = seen.map(|(blob, l)| (blob.along(blob.position, d), *l));
    lines
        .filter(|(line, _)| line.off <= view.edge.radius)
        .map(|(line, l)| (alpha(line.tau()), l))
        .collect()
}

#[test]
fn no_rectangle_is_too_small() {
    // Many of these blobs reach beside or behind the eye.
    let (blobs, radiance) = scattered(300, 0.05);
    let view = view(40, 30);
    let order: Vec<u32> = (0..300).collect();
    let image = render(&view, &plain(&blobs, &radiance, &order));
    for (pixel, k) in image.iter().zip(0..) {
        let composed = layers(&view, &blobs, &radiance, k % 40, k / 40)
            .iter()
            .fold((DVec3::ZERO, 0.0), |(c, a), &(alpha, l)| {
                (alpha * l + (1.0 - alpha) * c, alpha + (1.0 - alpha) * a)
            });
        // The same operations in the same order.
        assert_eq!((DVec3::from_slice(pixel), pixel[3]), composed);
    }
}

#[test]
fn half_float_targets_stay_within_their_bound() {
    let (blobs, radiance) = scattered(600, 0.5);
    let view = view(40, 30);
    let order: Vec<u32> = (0..600).collect();
    const ALPHA: f64 = 1e-4;
    let rounding = Rounding::of(FilmFormat::Rgba16f, ALPHA, 0.0);
    let (image, bounds) = over_nothing(&view, &plain(&blobs, &radiance, &order), &rounding);
    assert_eq!(image, render(&view, &plain(&blobs, &radiance, &order)));
    let mut ratios = Vec::new();
    for k in 0..1200 {
        let mut stored = [0.0; 4];
        for (i, &(alpha, l)) in layers(&view, &blobs, &radiance, k % 40, k / 40).iter().enumerate()
        {
            // α errs by as much as allowed, with random sign.
            let alpha = alpha * (1.0 + ALPHA * (2.0 * lots(i as u32)[0].round() - 1.0));
            for (c, s) in stored.iter_mut().zip([l.x, l.y, l.z, 1.0]) {
                *c = f16::from_f64(alpha * s + (1.0 - alpha) * *c).to_f64();
            }
        }
        for c in 0..4 {
            let actual = (stored[c] - image[k as usize][c]).abs();
            assert!(actual <= bounds[k as usize][c], "pixel {k} channel {c}");
            ratios.push(bounds[k as usize][c] / actual.max(1e-30));
        }
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "half float: bound/actual least {:.2}, median {:.1}",
        ratios[0],
        ratios[ratios.len() / 2]
    );
    assert!(ratios[ratios.len() / 2] < 1000.0);
}

#[test]
fn a_sprites_edge_may_fall_either_way() {
    // b = 2.4 at column 4 (see above): the cut at 3σ lies 1e-7 inside, then outside.
    for sigma in [0.8 * (1.0 - 1e-7), 0.8 * (1.0 + 1e-7)] {
        let blob = Blob { shape: Shape::BALL, position: DVec3::NEG_Z * 3.0, sigma, kappa: 0.6 };
        let bound = |edge| {
            let rounding = Rounding::of(FilmFormat::Rgba32f, 0.0, edge);
            over_nothing(&view(5, 3), &plain(&[blob], &[DVec3::ONE], &[0]), &rounding).1[9][3]
        };
        let step = alpha(blob.deepest() * (-0.5 * (2.4 / sigma).powi(2)).exp());
        assert!(bound(1e-8) < 1e-6 && (bound(1e-6) - step).abs() < 1e-6);
    }
    let kappa = box_kappa(&one_box(1, DVec3::ONE, 2.0), &BoxLaw::new(Form::Centred));
    assert!(kappa > 0.0 && radius(Form::Printed, 2.0, 0.0) == 0.0);
    assert_eq!(offset(DVec3::ONE, Form::Centred, [0.5; 3]), DVec3::ZERO);
}
