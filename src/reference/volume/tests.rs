//! The volume against closed forms, against thin sprites where both agree, and against plain sums.

use glam::DVec3;

use super::*;
use crate::model::camera::Pose;
use crate::model::cloud::{SQRT_TAU, Shape};
use crate::model::edge::Edge;
use crate::reference::sprites::{self, Sprites};

/// Integrates the whole picture before `behind`, one a pixel.
fn render(view: &View, behind: &[OpaquePixel], blobs: &[Blob], radiance: &[DVec3]) -> Vec<Pixel> {
    let volume = Volume::new(view, blobs, radiance);
    let rows = (0..view.height).zip(behind.chunks(view.width as usize));
    rows.flat_map(|(j, row)| volume.row(j, (0..view.width).zip(row.iter().copied()))).collect()
}

/// Eye at the origin, looking along −z. The middle pixel's ray is the axis for one pixel and for
/// three by three.
fn view(n: u32) -> View {
    View {
        width: n,
        height: n,
        pose: Pose { position: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z },
        fov_y_rad: 0.9,
        near: 1e-3,
        edge: Edge::at(9.0),
        smallest: 0.0,
        slice: 0.0,
        n_parts: 4,
        shift: glam::DVec2::ZERO,
    }
}

/// A blob at depth `z` on the axis whose optical depth through the centre is `tau`.
fn blob(z: f64, sigma: f64, tau: f64) -> Blob {
    Blob { shape: Shape::BALL, position: DVec3::NEG_Z * z, sigma, kappa: tau / (SQRT_TAU * sigma) }
}

fn one_pixel(blobs: &[Blob], colors: &[DVec3], behind: OpaquePixel) -> Pixel {
    render(&view(1), &[behind], blobs, colors)[0]
}

/// The middle pixel of blobs before an empty background.
fn alone(blobs: &[Blob], colors: &[DVec3]) -> Pixel {
    one_pixel(blobs, colors, OpaquePixel::EMPTY)
}

fn assert_is(pixel: Pixel, color: DVec3, alpha: f64, tolerance: f64) {
    let off = (DVec3::from_slice(&pixel.color) - color)
        .abs()
        .max_element()
        .max((pixel.color[3] - alpha).abs());
    assert!(off <= tolerance, "{pixel:?} against {color} {alpha}: {off:e}");
}

const COLOR: DVec3 = DVec3::new(0.25, 0.5, 2.0);
const RED: DVec3 = DVec3::new(1.0, 0.0, 0.125);
const BLUE: DVec3 = DVec3::new(0.0, 0.25, 3.0);

#[test]
fn one_blob_is_one_minus_e_to_the_minus_tau() {
    for tau in [1e-9, 0.3, 2.0, 40.0] {
        let covered = -f64::exp_m1(-tau);
        assert_is(alone(&[blob(5.0, 0.4, tau)], &[COLOR]), covered * COLOR, covered, 1e-11);
    }
    // Off the axis by b: τ e^{−b²/2σ²}; nine pixels, the outer eight by the definition of b.
    let (one, view) = (blob(5.0, 0.4, 1.5), view(3));
    let picture = render(&view, &[OpaquePixel::EMPTY; 9], &[one], &[COLOR]);
    for (pixel, k) in picture.iter().zip(0..) {
        let d = view.ray(k % 3, k / 3).normalize();
        let b2 = (one.position - one.position.dot(d) * d).length_squared();
        let covered = -f64::exp_m1(-1.5 * (-0.5 * b2 / 0.16).exp());
        assert_is(*pixel, covered * COLOR, covered, 1e-11);
    }
}

#[test]
fn an_eye_inside_sees_the_part_in_front() {
    // From the centre on half of it; from 1 σ behind the centre the share below +1 σ,
    // 0.8413447460685429. The near plane is at 1e-3: less by 1e-3/0.4 of a σ, of the density there.
    let near = |x: f64| 1e-3 / 0.4 * (-0.5 * x * x).exp() / SQRT_TAU;
    for (z, share) in
        [(0.0, 0.5), (0.4, 0.841_344_746_068_542_9), (-0.4, 1.0 - 0.841_344_746_068_542_9)]
    {
        let tau = 2.0 * (share - near(z / 0.4));
        let covered = -f64::exp_m1(-tau);
        // The density changes over the 1e-3 by 1e-3/0.4 of itself: (1e-3/0.4)² of τ.
        assert_is(alone(&[blob(z, 0.4, 2.0)], &[COLOR]), covered * COLOR, covered, 1e-5);
    }
}

#[test]
fn blobs_of_one_colour_hide_their_order() {
    let blobs =
        [blob(22.0, 0.5, 0.7), blob(22.3, 0.2, 3.0), blob(22.2, 0.9, 0.1), blob(29.0, 2.0, 0.5)];
    let covered = -f64::exp_m1(-4.3);
    let pixel = alone(&blobs, &[COLOR; 4]);
    assert_is(pixel, covered * COLOR, covered, 1e-11);
    assert!(pixel.error < 1e-10, "no quadrature is asked: {pixel:?}");
    let back: Vec<Blob> = blobs.into_iter().rev().collect();
    assert_is(alone(&back, &[COLOR; 4]), covered * COLOR, covered, 1e-11);
}

#[test]
fn concentric_blobs_mix_their_colours_by_their_extinction() {
    // Of equal σ the source is (κ₁L₁ + κ₂L₂)/(κ₁ + κ₂) everywhere: a quarter and three quarters.
    let covered = -f64::exp_m1(-2.0);
    let pixel = alone(&[blob(6.0, 0.6, 0.5), blob(6.0, 0.6, 1.5)], &[RED, BLUE]);
    assert_is(pixel, covered * (0.25 * RED + 0.75 * BLUE), covered, 1e-11);
}

#[test]
fn far_apart_blobs_are_thin_sprites() {
    // More than 8 σ of both lie between them, so the overlap is below 1e-14.
    let blobs =
        [blob(4.0, 0.2, 0.8), blob(8.0, 0.25, 1.7), blob(20.0, 0.6, 3.0), blob(30.0, 0.5, 0.02)];
    let colors = [RED, BLUE, COLOR, DVec3::ONE];
    let thin = |order: &[u32]| {
        let sprites = Sprites {
            blobs: &blobs,
            radiance: &colors,
            order,
            factor: None,
            shades: None,
            cells: None,
        };
        sprites::render(&view(3), &sprites)
    };
    let sorted = thin(&[3, 2, 1, 0]);
    let thick = render(&view(3), &[OpaquePixel::EMPTY; 9], &blobs, &colors);
    for (a, b) in thick.iter().zip(&sorted) {
        assert_is(*a, DVec3::from_slice(b), b[3], a.error);
        assert!(a.error < 4e-6);
    }
    // In reverse order they differ, so the comparison covers the order.
    let wrong = thin(&[0, 1, 2, 3]);
    assert!((wrong[4][0] - thick[4].color[0]).abs() > 0.1);
}

#[test]
fn a_surface_within_a_blob_hides_half_of_it() {
    let behind = OpaquePixel { color: [0.5, 0.25, 1.0, 1.0], depth: 3.0, ..OpaquePixel::EMPTY };
    let through = f64::exp(-0.6);
    let expected = (1.0 - through) * RED + through * DVec3::new(0.5, 0.25, 1.0);
    assert_is(one_pixel(&[blob(3.0, 0.3, 1.2)], &[RED], behind), expected, 1.0, 1e-11);
    let hidden = one_pixel(&[blob(9.0, 0.3, 1.2)], &[RED], behind);
    assert_is(hidden, DVec3::new(0.5, 0.25, 1.0), 1.0, 1e-11);
}

/// Integrates the definition by the midpoint rule in `n` steps from the near plane to `end`, from
/// the extinction alone.
fn by_steps(blobs: &[Blob], colors: &[DVec3], ray: DVec3, end: f64, n: u32) -> (DVec3, f64) {
    let (near, length) = (view(1).near, ray.length());
    let step = (end - near) / f64::from(n);
    let (mut color, mut tau) = (DVec3::ZERO, 0f64);
    for k in 0..n {
        let x = (near + (f64::from(k) + 0.5) * step) * ray;
        let at = |b: &Blob| {
            b.kappa * (-0.5 * ((x - b.position) / b.sigma).length_squared()).exp() * length * step
        };
        let (own, sum) = blobs
            .iter()
            .zip(colors)
            .fold((0.0, DVec3::ZERO), |(t, s), (b, l)| (t + at(b), s + at(b) * *l));
        // Within a step extinction and colour are constant.
        if own > 0.0 {
            color += (-tau).exp() * -f64::exp_m1(-own) / own * sum;
        }
        tau += own;
    }
    (color, -f64::exp_m1(-tau))
}

/// `n` overlapping blobs of many sizes, densities and colours, from sines alone.
fn crowd(n: u32, scale: f64) -> (Vec<Blob>, Vec<DVec3>) {
    let lot = |k: u32, m: u32| (f64::from(k * 7 + m) * 12.9898).sin().abs();
    let one = |k| {
        let (x, y) = (lot(k, 0) - 0.5, lot(k, 1) - 0.5);
        let position = DVec3::new(x, y, -(2.0 + 2.0 * lot(k, 2)));
        let sigma = 0.03 + 0.5 * lot(k, 3) * lot(k, 3);
        let kappa = scale * lot(k, 4) / (SQRT_TAU * sigma);
        (
            Blob { shape: Shape::BALL, position, sigma, kappa },
            3.0 * DVec3::new(lot(k, 5), lot(k, 6), lot(k, 5) * lot(k, 2)),
        )
    };
    (0..n).map(one).unzip()
}

#[test]
fn overlapping_blobs_agree_with_small_steps() {
    for (n, scale) in [(2, 2.0), (40, 0.2), (40, 5.0)] {
        let (blobs, colors) = crowd(n, scale);
        let view = view(3);
        let picture = render(&view, &[OpaquePixel::EMPTY; 9], &blobs, &colors);
        for (pixel, k) in picture.iter().zip(0..) {
            let ray = view.ray(k % 3, k / 3);
            let (fine, alpha) = by_steps(&blobs, &colors, ray, 9.0, 60_000);
            let (coarse, _) = by_steps(&blobs, &colors, ray, 9.0, 30_000);
            // The rule is of second order: the fine result is off by a third of their difference.
            let unsure = (fine - coarse).abs().max_element();
            assert!(unsure < 1e-6, "{unsure:e}");
            assert_is(*pixel, fine, alpha, pixel.error + unsure);
            assert!(pixel.error < 1e-5, "{pixel:?}");
        }
    }
}

#[test]
fn dense_blobs_around_the_eye_are_resolved() {
    // τ = 10⁶ on either side: light comes from the first hundred-thousandth of σ. Its mixture is
    // that at the near plane: κ g of the red blob over that of both.
    let (red, blue) = (blob(0.3, 0.4, 1e6), blob(-0.2, 0.4, 2e6));
    let density = |b: &Blob| b.kappa * (-0.5 * ((b.position.z + 1e-3) / b.sigma).powi(2)).exp();
    let share = density(&red) / (density(&red) + density(&blue));
    let pixel = alone(&[red, blue], &[RED, BLUE]);
    // The mixture changes over the depth of 1e-6 by about that much.
    assert_is(pixel, RED.lerp(BLUE, 1.0 - share), 1.0, 1e-5 + pixel.error);
    assert!(pixel.error < 1e-5);
}

#[test]
fn degenerate_blobs_are_not_drawn() {
    let nothing =
        [blob(3.0, 0.5, 0.0), Blob { sigma: 0.0, ..blob(3.0, 0.5, 1.0) }, blob(-30.0, 0.5, 1.0)];
    assert_is(alone(&nothing, &[COLOR; 3]), DVec3::ZERO, 0.0, 0.0);
    assert_is(alone(&[], &[]), DVec3::ZERO, 0.0, 0.0);
    let among = [nothing[0], blob(5.0, 0.5, 1.0), nothing[1]];
    let covered = -f64::exp_m1(-1.0);
    assert_is(alone(&among, &[RED, COLOR, RED]), covered * COLOR, covered, 1e-11);
}
