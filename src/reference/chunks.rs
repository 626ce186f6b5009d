//! Sprites in chunks, passes.md "chunks": thin blobs composed near to far by blending each layer
//! under the picture, in f64, with a bound on what a device may differ that blends in f32.
//!
//! In: blobs and eye relative to O, an order far to near. Out: the same picture as `sprites`.

use super::composed::{Composed, U};
use super::composite::OpaquePixel;
use super::shine::Shine;
use super::sprites::Bounded;
use super::tiles::{Composition, render_by};

/// Blends a layer: C ← C + (1 − A) α L, A ← A + (1 − A) α. The device stores A, so the error of the
/// transmittance is a share of 1, not of itself.
fn under(pixel: &mut Composed, alpha: f64, off: f64, shine: Shine) {
    let Shine { radiance, off: off_radiance } = shine;
    let here = pixel.passed * alpha;
    let inherited = pixel.off_passed * (alpha + off) + pixel.passed * off;
    // Blending need only be faithful, 2 U an operation: 1 − A, the product, the sum.
    let off_here = inherited + 4.0 * U * (here + inherited);
    // α L before them is correctly rounded.
    let off_shine = radiance.abs() * (off_here + U * (here + inherited));
    pixel.off_color += off_shine + (here + off_here) * off_radiance;
    pixel.color += here * radiance;
    pixel.off_color += 2.0 * U * (pixel.color.abs() + pixel.off_color);
    pixel.passed -= here;
    pixel.off_passed = pixel.off_passed * (1.0 - alpha).abs()
        + pixel.off_passed * off
        + (pixel.passed + here) * off;
    pixel.off_passed +=
        4.0 * U * (here + off_here) + 2.0 * U * (1.0 - pixel.passed + pixel.off_passed);
}

/// Returns the picture over `behind`, one a pixel, and per channel a bound on what the device may
/// differ.
pub fn render_over(of: &Composition<'_>, behind: &[OpaquePixel]) -> Bounded {
    let (values, mut bounds) = render_by(of, behind, under);
    // The result is blended over the background in at least the film's bits: source and factor are
    // rounded, too.
    let r = &of.rounding;
    for ((bound, value), under) in bounds.iter_mut().zip(&values).zip(behind) {
        for k in 0..4 {
            bound[k] +=
                2.0 * r.unit * (value[k].abs() + 3.0 * under.color[k].abs()).max(r.least_normal)
                    + 2.0 * r.step;
        }
    }
    (values, bounds)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::model::cloud::{SQRT_TAU, Shape};
    use crate::reference::Blob;
    use crate::reference::composite::Rounding;
    use crate::reference::sprites::{Sprites, render_over as far_to_near};
    use crate::reference::view::View;

    const VIEW: View = View::ONE_PIXEL;

    fn layer(z: f64, tau: f64) -> Blob {
        Blob {
            shape: Shape::BALL,
            position: DVec3::new(0.0, 0.0, -z),
            sigma: 0.5,
            kappa: tau / (SQRT_TAU * 0.5),
        }
    }

    fn drawn(
        blobs: &[Blob],
        colors: &[DVec3],
        rounding: Rounding,
        behind: OpaquePixel,
    ) -> ([f64; 4], [f64; 4]) {
        let order: Vec<u32> = (0..blobs.len() as u32).collect();
        let sprites = Sprites {
            blobs,
            radiance: colors,
            order: &order,
            factor: None,
            shades: None,
            cells: None,
        };
        let of = Composition { view: &VIEW, sprites, rounding, saturated: 0.0 };
        let (values, bounds) = render_over(&of, &[behind]);
        (values[0], bounds[0])
    }

    #[test]
    fn two_layers_by_hand_and_far_to_near() {
        // τ = ln 2 and ln 4: opacities 1/2 (near, red) and 3/4 (far, green), over blue.
        let (blobs, colors) =
            ([layer(4.0, 4f64.ln()), layer(2.0, 2f64.ln())], [DVec3::Y, DVec3::X]);
        let behind = OpaquePixel { color: [0.0, 0.0, 1.0, 1.0], ..OpaquePixel::EMPTY };
        let (value, bound) = drawn(&blobs, &colors, Rounding::NONE, behind);
        for (v, by_hand) in value.iter().zip([0.5, 0.375, 0.125, 1.0]) {
            assert!((v - by_hand).abs() < 1e-15, "{value:?}");
        }
        assert!(bound.iter().all(|b| *b > 0.0 && *b < 2e-6), "{bound:?}");
        let (other, _) = {
            let sprites = Sprites {
                blobs: &blobs,
                radiance: &colors,
                order: &[0, 1],
                factor: None,
                shades: None,
                cells: None,
            };
            far_to_near(&VIEW, &[behind], &sprites, &Rounding::NONE)
        };
        assert!(value.iter().zip(other[0]).all(|(a, b)| (a - b).abs() < 1e-15));
    }

    /// Checks that the recurrence in f32, rounded correctly at each step, stays within the bound,
    /// and that the bound is not wide.
    #[test]
    fn f32_stays_within_the_bound() {
        let n = 4000;
        let taus: Vec<f64> = (0..n).map(|i| 1e-3 * (1.0 + f64::from(i % 7))).collect();
        let blobs: Vec<Blob> = taus.iter().rev().map(|tau| layer(3.0, *tau)).collect();
        let (value, bound) =
            drawn(&blobs, &vec![DVec3::ONE; n as usize], Rounding::NONE, OpaquePixel::EMPTY);
        let (mut c, mut a) = (0f32, 0f32);
        for tau in &taus {
            let alpha = (-libm::expm1(-tau)) as f32;
            (c, a) = (c + (1.0 - a) * alpha, a + (1.0 - a) * alpha);
        }
        let off = (f64::from(c) - value[0]).abs().max((f64::from(a) - value[3]).abs());
        // Each α is rounded to f32 as well: a share U of the whole opacity.
        assert!(off <= bound[3] + U, "{off:e} {bound:?}");
        assert!(bound[3] < 2e-4, "{bound:?}");
    }
}
