//! Sums over the thin sprites of a pixel, model.md §9 and passes.md "layers": optical depth, number
//! and depth of the nearest, in f64, with bounds on what a device may differ.
//!
//! In: blobs and eye relative to O. Out: a record for each pixel. No sum depends on the order.

use super::blob_layers::{Layer, Raster, Sprites, composed};
use super::composed::U;
use super::composite::{OpaquePixel, Rounding};
use super::view::View;

/// Roundings of f32 from a view depth to near/z, and back.
const N_INVERSIONS: f64 = 4.0;

/// A number with a bound on a device's difference.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sum {
    /// Exact value.
    pub value: f64,
    /// Bound on the difference.
    pub bound: f64,
}

/// The sums over the layers of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpriteSums {
    /// Σ τ of the blobs that are drawn in the pixel.
    pub optical_depth: Sum,
    /// Number of these blobs.
    pub n: Sum,
    /// Least view depth of their centres and of the opaque pixel; infinite if there is neither.
    pub depth: f64,
    /// The depths between which a device's lies.
    pub depth_range: [f64; 2],
}

impl SpriteSums {
    /// Returns the sums of a pixel without blobs.
    fn of(behind: &OpaquePixel) -> SpriteSums {
        let OpaquePixel { depth, depth_bound, .. } = *behind;
        let off = if depth.is_finite() { depth_bound + N_INVERSIONS * U * depth } else { 0.0 };
        SpriteSums {
            optical_depth: Sum::default(),
            n: Sum::default(),
            depth,
            depth_range: [depth - off, depth + off],
        }
    }

    /// Adds a layer, whose depth a device has within `off`.
    fn add(&mut self, layer: &Layer, off: f64, rounding: &Rounding) {
        // A blob without optical depth is no layer.
        if layer.tau.is_nan() || layer.tau <= 0.0 {
            return;
        }
        if layer.is_drawn {
            self.optical_depth.value += layer.tau;
            self.n.value += 1.0;
            self.depth = self.depth.min(layer.depth);
        }
        let uncertain = if layer.is_uncertain { 1.0 } else { 0.0 };
        self.n.bound += uncertain;
        let Sum { value, bound } = &mut self.optical_depth;
        *bound += (uncertain + rounding.alpha) * layer.tau;
        // Blending need only be faithful: 2 U of the sum.
        *bound += 2.0 * U * (*value + *bound);
        let off = off + N_INVERSIONS * U * layer.depth;
        let [least, most] = &mut self.depth_range;
        *least = least.min(layer.depth - off);
        if layer.is_drawn && !layer.is_uncertain {
            *most = most.min(layer.depth + off);
        }
    }
}

/// Returns the sums of the pixels of `raster`, over `opaque`, one each. A device errs as `rounding`
/// says: `alpha` bounds the relative error of an optical depth, and `depth` that of a view depth as
/// a share of the distances to O and to the eye.
pub fn sums_at(
    view: &View,
    raster: &Raster<'_>,
    opaque: &[OpaquePixel],
    sprites: &Sprites<'_>,
    rounding: &Rounding,
) -> Vec<SpriteSums> {
    let off = |j: usize| {
        let place = sprites.blobs[j].position;
        rounding.depth * (place.length() + (place - view.pose.position).length())
    };
    let over = |pixel: &mut SpriteSums, j: usize, layer: &Layer| pixel.add(layer, off(j), rounding);
    composed(
        view,
        raster,
        opaque,
        (sprites, rounding),
        SpriteSums::of,
        over,
        |_, sums| sums,
        &|_| (),
    )
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::model::cloud::{SQRT_TAU, Shape};
    use crate::reference::Blob;

    const VIEW: View = View::ONE_PIXEL;

    fn blob(z: f64, tau: f64) -> Blob {
        let kappa = tau / (SQRT_TAU * 0.25);
        Blob { shape: Shape::BALL, position: DVec3::NEG_Z * z, sigma: 0.25, kappa }
    }

    fn sums(blobs: &[Blob], behind: OpaquePixel, rounding: &Rounding) -> SpriteSums {
        let order: Vec<u32> = (0..blobs.len() as u32).collect();
        let sprites = Sprites {
            blobs,
            radiance: &[],
            order: &order,
            factor: None,
            shades: None,
            cells: None,
        };
        let raster = Raster { first: [0, 0], n_columns: 1, cell: 1, at: &[[0, 0]] };
        sums_at(&VIEW, &raster, &[behind], &sprites, rounding).remove(0)
    }

    #[test]
    fn three_blobs_by_hand() {
        // τ of 1, 2 and 4 through the centres, at the depths 4, 2 and 8; one more has none.
        let blobs = [blob(4.0, 1.0), blob(2.0, 2.0), blob(8.0, 4.0), blob(1.0, 0.0)];
        let of =
            |depth: f64| sums(&blobs, OpaquePixel { depth, ..OpaquePixel::EMPTY }, &Rounding::NONE);
        let are = |s: SpriteSums, tau: f64, n: f64, depth: f64| {
            let is_deep = (s.optical_depth.value - tau).abs() < 1e-14;
            is_deep && (s.n.value, s.depth) == (n, depth)
        };
        assert!(are(of(f64::INFINITY), 7.0, 3.0, 2.0));
        // An opaque pixel hides what is behind it, and is nearest where nothing is before it.
        assert!(are(of(5.0), 3.0, 2.0, 2.0) && are(of(1.5), 0.0, 0.0, 1.5));
        assert_eq!(sums(&[], OpaquePixel::EMPTY, &Rounding::NONE).depth, f64::INFINITY);
    }

    #[test]
    fn bounds_hold_what_rounding_may_decide() {
        let rounding = Rounding { alpha: 1e-3, depth: 1e-6, ..Rounding::NONE };
        let blobs = [blob(4.0, 1.0), blob(2.0, 2.0)];
        let sure = sums(&blobs, OpaquePixel::EMPTY, &rounding);
        assert!((sure.optical_depth.bound / 3e-3 - 1.0).abs() < 1e-3 && sure.n.bound == 0.0);
        let [least, most] = sure.depth_range;
        assert!(least < 2.0 && 2.0 < most && most - least < 2e-5);
        // The nearer blob is as deep as the opaque pixel: it may be drawn or not.
        let depth_bound = 1e-4;
        let behind = OpaquePixel { depth: 2.0, depth_bound, ..OpaquePixel::EMPTY };
        let either = sums(&blobs, behind, &rounding);
        assert_eq!((either.n.value, either.n.bound), (1.0, 1.0));
        assert!(either.optical_depth.bound > 2.0 && either.optical_depth.bound < 2.01);
    }
}
