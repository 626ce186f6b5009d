//! Sprites, model.md §9 and passes.md "sprites": thin blobs composed far to near with premultiplied
//! "over", in f64, with a bound on what a target of few bits may differ.
//!
//! In: blobs and eye relative to O, an order. Out: [row][column] of [C_r, C_g, C_b, A], row 0 at
//! the top.

use super::blob_layers::{Layer, composed};
use super::composed::Composed;
use super::composite::{Layered, OpaquePixel, Rounding};
use super::slices;
use super::view::View;

pub use super::blob_layers::{Bounded, CellLight, Factor, Raster, Shares, Sprites, alpha};

/// Returns the picture of `sprites` over nothing.
pub fn render(view: &View, sprites: &Sprites<'_>) -> Vec<[f64; 4]> {
    let nothing = vec![OpaquePixel::EMPTY; view.width as usize * view.height as usize];
    render_over(view, &nothing, sprites, &Rounding::NONE).0
}

/// Returns the picture over `opaque`, one a pixel, and a bound on what a target that rounds as
/// `rounding` says may differ from it.
pub fn render_over(
    view: &View,
    opaque: &[OpaquePixel],
    sprites: &Sprites<'_>,
    rounding: &Rounding,
) -> Bounded {
    let (width, height) = (view.width, view.height);
    let at: Vec<[u32; 2]> = (0..width * height).map(|i| [i % width, i / width]).collect();
    let whole = Raster { first: [0, 0], n_columns: width, cell: 1, at: &at };
    render_over_at(view, &whole, opaque, sprites, rounding)
}

/// Returns the values and bounds of [`render_over`] at the pixels of `raster` alone, over `opaque`,
/// one each.
pub fn render_over_at(
    view: &View,
    raster: &Raster<'_>,
    opaque: &[OpaquePixel],
    sprites: &Sprites<'_>,
    rounding: &Rounding,
) -> Bounded {
    let pixels = layered(view, raster, opaque, sprites, rounding, &|_| ());
    pixels.iter().map(|p| (p.value, p.bound)).unzip()
}

/// Returns the values of [`render_over`] at the pixels of `raster` alone, over `opaque`, one each.
/// Calls `on_row` with the number of all rows of cells each time a row is done.
pub fn render_at(
    view: &View,
    raster: &Raster<'_>,
    opaque: &[OpaquePixel],
    sprites: &Sprites<'_>,
    on_row: &(dyn Fn(usize) + Sync),
) -> Vec<[f64; 4]> {
    let pixels = layered(view, raster, opaque, sprites, &Rounding::NONE, on_row);
    pixels.into_iter().map(|p| p.value).collect()
}

fn layered(
    view: &View,
    raster: &Raster<'_>,
    opaque: &[OpaquePixel],
    sprites: &Sprites<'_>,
    rounding: &Rounding,
    on_row: &(dyn Fn(usize) + Sync),
) -> Vec<Layered> {
    if view.slice > 0.0 {
        let brightest = sprites.brightest();
        // Half a step of the target below 1 hides what is behind.
        let saturated = 0.5 * rounding.unit.max(0.5 * rounding.step);
        let pixels = slices::composed_at(view, raster, opaque, sprites, rounding, on_row);
        let over = |(pixel, behind): (&Composed, &OpaquePixel)| {
            let (value, bound) = pixel.over(behind, rounding, saturated, brightest);
            Layered { value, bound }
        };
        return pixels.iter().zip(opaque).map(over).collect();
    }
    let over = |pixel: &mut Layered, j: usize, layer: &Layer| {
        pixel.over(layer.alpha, layer.off, layer.shine(sprites.radiance[j]), rounding);
    };
    let start = |behind: &OpaquePixel| Layered::from(behind);
    let whole = |_: usize, pixel: Layered| pixel;
    composed(view, raster, opaque, (sprites, rounding), start, over, whole, on_row)
}

/// Returns the shares of the pixels of `raster` in the picture of [`render_at`], whatever the
/// blobs' radiance is.
pub fn shares_at(
    view: &View,
    raster: &Raster<'_>,
    opaque: &[OpaquePixel],
    sprites: &Sprites<'_>,
) -> Vec<Shares> {
    if view.slice > 0.0 {
        return slices::shares_at(view, raster, opaque, sprites);
    }
    let over = |pixel: &mut Vec<(u32, f64, f64)>, j: usize, layer: &Layer| {
        pixel.push((j as u32, layer.alpha, layer.light.whole(layer.tau).0));
    };
    let exact = (sprites, &Rounding::NONE);
    let whole = |_: usize, layers: Vec<(u32, f64, f64)>| {
        let mut behind = 1.0;
        let share = |&(j, alpha, light): &(u32, f64, f64)| {
            let share = alpha * behind * light;
            behind *= 1.0 - alpha;
            (j, share)
        };
        let mut blobs: Vec<(u32, f64)> = layers.iter().rev().map(share).collect();
        blobs.reverse();
        Shares { blobs, behind }
    };
    composed(view, raster, opaque, exact, |_| Vec::new(), over, whole, &|_| ())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::model::cloud::{SQRT_TAU, Shape};
    use crate::reference::Blob;

    const VIEW: View = View::ONE_PIXEL;

    #[test]
    fn shares_are_those_of_opacities_near_before_far() {
        // α = ½ of both blobs: the near one has ½, the far one ½ of what is left, the background
        // the rest.
        let kappa = std::f64::consts::LN_2 / (SQRT_TAU * 0.25);
        let at =
            |z: f64| Blob { shape: Shape::BALL, position: DVec3::NEG_Z * z, sigma: 0.25, kappa };
        let blobs = [at(2.0), at(4.0)];
        let sprites = Sprites {
            blobs: &blobs,
            radiance: &[],
            order: &[1, 0],
            factor: None,
            shades: None,
            cells: None,
        };
        let of = |depth: f64| {
            let raster = Raster { first: [0, 0], n_columns: 1, cell: 1, at: &[[0, 0]] };
            let behind = OpaquePixel { depth, ..OpaquePixel::EMPTY };
            shares_at(&VIEW, &raster, &[behind], &sprites).remove(0)
        };
        let is = |found: Shares, blobs: &[(u32, f64)], behind: f64| {
            let same = |(a, b): (&(u32, f64), &(u32, f64))| a.0 == b.0 && (a.1 - b.1).abs() < 1e-15;
            found.blobs.len() == blobs.len()
                && found.blobs.iter().zip(blobs).all(same)
                && (found.behind - behind).abs() < 1e-15
        };
        assert!(is(of(5.0), &[(1, 0.25), (0, 0.5)], 0.25));
        // An opaque pixel between them hides the far one.
        assert!(is(of(3.0), &[(0, 0.5)], 0.5) && is(of(1.0), &[], 1.0));
    }

    #[test]
    fn the_background_shows_through_and_hides() {
        // α = 1 − e^{−ln 2} = ½ through the centres; colours (1, 0, 0) at depth 2 and (0, 1, 0) at
        // depth 4.
        let kappa = std::f64::consts::LN_2 / (SQRT_TAU * 0.25);
        let at =
            |z: f64| Blob { shape: Shape::BALL, position: DVec3::NEG_Z * z, sigma: 0.25, kappa };
        let (blobs, colors) = ([at(2.0), at(4.0)], [DVec3::X, DVec3::Y]);
        let over = |depth: f64, depth_bound: f64| {
            let behind = OpaquePixel {
                color: [0.0, 0.0, 1.0, 1.0],
                depth,
                depth_bound,
                ..OpaquePixel::EMPTY
            };
            let (value, bound) = {
                let sprites = Sprites {
                    blobs: &blobs,
                    radiance: &colors,
                    order: &[1, 0],
                    factor: None,
                    shades: None,
                    cells: None,
                };
                render_over(&VIEW, &[behind], &sprites, &Rounding::NONE)
            };
            (value[0], bound[0])
        };
        let is = |a: [f64; 4], b: [f64; 4]| (0..4).all(|k| (a[k] - b[k]).abs() < 1e-15);
        assert!(is(over(5.0, 0.0).0, [0.5, 0.25, 0.25, 1.0]));
        assert!(is(over(3.0, 0.0).0, [0.5, 0.0, 0.5, 1.0]));
        assert!(is(over(1.0, 0.0).0, [0.0, 0.0, 1.0, 1.0]));
        // A blob at equal depth is drawn. If that is uncertain the bound covers both results: (0.5,
        // 0.25, 0.25) and (0.5, 0, 0.5).
        assert!(is(over(4.0, 0.0).0, [0.5, 0.25, 0.25, 1.0]) && is(over(4.0, 0.0).1, [0.0; 4]));
        assert!(is(over(4.0, 1e-9).1, [0.0, 0.25, 0.25, 0.0]));
        let (value, bound) = over(4.0 - 1e-10, 1e-9);
        assert!(is(value, [0.5, 0.0, 0.5, 1.0]) && is(bound, [0.0, 0.25, 0.25, 0.0]));
    }
}
