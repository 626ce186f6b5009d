//! Sprites in tiles, passes.md "tiles": thin blobs composed near to far, in f64, with a bound on
//! what f32 in that order may differ.
//!
//! In: blobs and eye relative to O, an order far to near. Out: the same picture as `sprites`.

use super::blob_layers::{Bounded, Seen, Sprites};
use super::composed::Composed;
use super::composite::{OpaquePixel, Rounding};
use super::shine::Shine;
use super::slices;
use super::view::View;
use crate::model::film::FilmFormat;

/// Returns the relative error of an opacity in tiles beyond the errors of the exact functions. A
/// picture of 16 bits a channel or fewer takes a power of two within 3e-6, and 1 − e^{−τ} within
/// 1.6e-5 (passes.md "tiles"). The relative error of 1 − e^{−τ} is at most that of τ.
pub fn off_alpha(format: FilmFormat) -> f64 {
    if format == FilmFormat::Rgba32f { 0.0 } else { 3e-6 + 1.6e-5 }
}

/// Adds a layer of an exact opacity under the composed ones; the device's opacity is within the
/// second number.
pub(super) type AddLayer = fn(&mut Composed, f64, f64, Shine);

/// A composition of sprites on a device.
#[derive(Clone, Copy)]
pub struct Composition<'a> {
    /// The view.
    pub view: &'a View,
    /// The sprites.
    pub sprites: Sprites<'a>,
    /// How the device may depart: opacities by `alpha` of themselves, edges by `edge`, the target
    /// by `unit`.
    pub rounding: Rounding,
    /// Transmittance below which the layers behind may be left out.
    pub saturated: f64,
}

/// Returns the picture over `behind`, one a pixel, and per channel a bound on what the device may
/// differ.
pub fn render_over(of: &Composition<'_>, behind: &[OpaquePixel]) -> Bounded {
    render_by(of, behind, Composed::under)
}

/// Composes as a device that uses another form of the law, with errors of its own.
pub(super) fn render_by(of: &Composition<'_>, behind: &[OpaquePixel], layer: AddLayer) -> Bounded {
    let (view, most) = (of.view, of.sprites.brightest());
    let pixel = |(i_pixel, under): (usize, &OpaquePixel)| {
        let (i, j) = (i_pixel as u32 % view.width, i_pixel as u32 / view.width);
        compose(of, [i, j], under, layer).over(under, &of.rounding, of.saturated, most)
    };
    behind.iter().enumerate().map(pixel).unzip()
}

fn compose(of: &Composition<'_>, at: [u32; 2], under: &OpaquePixel, layer: AddLayer) -> Composed {
    let Composition { view, sprites, rounding, .. } = of;
    let ray = view.ray(at[0], at[1]);
    let mut pixel = Composed::NOTHING;
    let opaque = (under.depth, under.depth_bound);
    let is_sliced = view.slice > 0.0;
    // Slices themselves end before what is opaque.
    let hides = if is_sliced { (f64::INFINITY, 0.0) } else { opaque };
    let mut layers = Vec::new();
    for &j in sprites.order.iter().rev() {
        let j = j as usize;
        let Some(seen) =
            Seen::new(view, &sprites.blobs[j], rounding).filter(|_| sprites.blobs[j].kappa > 0.0)
        else {
            continue;
        };
        match seen.layer(view, sprites, j, ray, hides, rounding) {
            Some(found) if is_sliced => layers.push((j, found)),
            Some(found) => {
                layer(&mut pixel, found.alpha, found.off, found.shine(sprites.radiance[j]));
            }
            None => {}
        }
    }
    match is_sliced {
        true => slices::pixel(view, sprites, &layers, at, opaque, rounding),
        false => pixel,
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::model::camera::Pose;
    use crate::model::cloud::{SQRT_TAU, Shape};
    use crate::model::edge::Edge;
    use crate::reference::{Blob, sprites};

    #[test]
    fn near_to_far_is_the_picture_of_far_to_near() {
        let pose =
            Pose { position: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z };
        let view = View {
            width: 3,
            height: 2,
            pose,
            fov_y_rad: 1.0,
            near: 0.5,
            edge: Edge::at(3.0),
            smallest: 0.0,
            slice: 0.0,
            n_parts: 4,
            shift: glam::DVec2::ZERO,
        };
        let at = |x: f64, z: f64, tau: f64| Blob {
            shape: Shape::BALL,
            position: DVec3::new(x, 0.1, -z),
            sigma: 0.5,
            kappa: tau / (SQRT_TAU * 0.5),
        };
        let (blobs, colors) =
            ([at(0.1, 2.0, 0.7), at(-0.2, 4.0, 3.0)], [DVec3::X, DVec3::new(0.2, 1.0, 2.0)]);
        let under = OpaquePixel { color: [0.0, 0.0, 1.0, 1.0], depth: 3.0, ..OpaquePixel::EMPTY };
        for under in [OpaquePixel::EMPTY, OpaquePixel { depth: 9.0, ..under }, under] {
            let behind = [under; 6];
            let none = Rounding::NONE;
            let sprites = Sprites {
                blobs: &blobs,
                radiance: &colors,
                order: &[1, 0],
                factor: None,
                shades: None,
                cells: None,
            };
            let of = Composition { view: &view, sprites, rounding: none, saturated: 0.0 };
            let (near_first, bound) = render_over(&of, &behind);
            let (far_first, _) = sprites::render_over(&view, &behind, &sprites, &none);
            for (a, b) in near_first.concat().iter().zip(far_first.concat()) {
                assert!((a - b).abs() < 1e-15, "{a} {b}");
            }
            assert!(bound.concat().iter().all(|b| *b < 1e-6));
        }
    }
}
