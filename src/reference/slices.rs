//! Slices, passes.md "slices", in f64: overlapping blobs are dealt among shells of one thickness
//! about the eye, and the shells are composed near to far. A bound says how far a device may be
//! off.
//!
//! In: blobs and eye relative to O, the layers of a pixel. Out: the mixture in each slice, and the
//! pixel composed of them.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use glam::DVec3;

use super::blob_layers::{BRIGHTER, CellLight, Layer, Raster, Shares, Sprites, composed};
use super::composed::{Composed, U};
use super::composite::{OpaquePixel, Rounding};
use super::shade::below;
use super::view::View;
use crate::model::cloud::Shape;

/// Pixels of a row between whose first and last the light of cells is linear.
const LIGHT_RUN: u32 = 8;
/// Error of the device's share of a Gaussian below a boundary: half that of its erf.
const SHARE: f64 = 1.5e-6;
/// Greatest slope of that share.
const STEEPEST: f64 = 0.4;
/// Roundings of f32 in the distance of a boundary from a centre, as a share of the centre's, and in
/// σ: beside those of the blob's place.
const N_ROUNDINGS: f64 = 8.0;
/// Greatest optical depth of a blob in a pixel: nothing shows through, and sums of depths times
/// radiances stay finite in f32.
const DEEPEST: f64 = 1e15;
/// Relative error of the device's 1 − e^{−t}.
const OPACITY: f64 = 3.5e-7;

/// The part of a blob in a slice.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    /// The blob.
    j: u32,
    /// Its optical depth.
    tau: f64,
    /// By how much the device's may differ.
    off: f64,
    /// Optical depth times light, as a factor on the blob's radiance.
    shine: f64,
    /// By how much the device's may differ, beyond `off` times the light.
    off_shine: f64,
}

/// The blobs in one slice.
#[derive(Debug, Clone, PartialEq, Default)]
struct Mixture {
    parts: Vec<Part>,
}

/// A ray through the slices.
#[derive(Clone, Copy)]
struct Ray<'a> {
    view: &'a View,
    sprites: &'a Sprites<'a>,
    /// Unit direction.
    direction: DVec3,
    /// Unit directions of the first and the last pixel between which the light of cells is linear,
    /// and the pixel's place between them, 0 to 1.
    ends: [DVec3; 2],
    place: f64,
    /// Distance of the opaque pixel, and its bound.
    wall: (f64, f64),
}

/// Returns the pixels of `raster` composed by slices, over nothing, before `opaque`.
pub(super) fn composed_at(
    view: &View,
    raster: &Raster<'_>,
    opaque: &[OpaquePixel],
    sprites: &Sprites<'_>,
    rounding: &Rounding,
    on_row: &(dyn Fn(usize) + Sync),
) -> Vec<Composed> {
    each(view, raster, opaque, (sprites, rounding), on_row, |mixtures| {
        compose(mixtures, sprites.radiance)
    })
}

/// Returns the shares of blobs in the pixels of `raster`, as [`super::sprites::shares_at`] does.
pub(super) fn shares_at(
    view: &View,
    raster: &Raster<'_>,
    opaque: &[OpaquePixel],
    sprites: &Sprites<'_>,
) -> Vec<Shares> {
    each(view, raster, opaque, (sprites, &Rounding::NONE), &|_| (), |mixtures| {
        let mut shares = Shares { blobs: Vec::new(), behind: 1.0 };
        for mixture in mixtures {
            let tau = mixture.tau();
            let shown = shares.behind * -libm::expm1(-tau);
            let of = |part: &Part| (part.j, shown * part.shine / tau);
            shares.blobs.extend(mixture.parts.iter().filter(|p| p.tau > 0.0).map(of));
            shares.behind *= (-tau).exp();
        }
        shares
    })
}

/// Calls `finish` with the mixtures of every pixel, near to far.
fn each<T: Send + Clone>(
    view: &View,
    raster: &Raster<'_>,
    opaque: &[OpaquePixel],
    (sprites, rounding): (&Sprites<'_>, &Rounding),
    on_row: &(dyn Fn(usize) + Sync),
    finish: impl Fn(Vec<Mixture>) -> T + Sync + Send,
) -> Vec<T> {
    let layers = |pixel: &mut Vec<(usize, Layer)>, j: usize, layer: &Layer| pixel.push((j, *layer));
    // A blob whose centre is hidden may reach before what hides it.
    let hides_none: Vec<OpaquePixel> = opaque
        .iter()
        .map(|pixel| OpaquePixel { depth: f64::INFINITY, depth_bound: 0.0, ..*pixel })
        .collect();
    let of = |k: usize, pixel: Vec<(usize, Layer)>| {
        let wall = (opaque[k].depth, opaque[k].depth_bound);
        finish(mixtures(view, sprites, &pixel, raster.at[k], wall, rounding))
    };
    composed(view, raster, &hides_none, (sprites, rounding), |_| Vec::new(), layers, of, on_row)
}

/// Returns the pixel `at` [column, row] with these layers, before an opaque one of the view depth
/// `wall`, given with its bound.
pub(super) fn pixel(
    view: &View,
    sprites: &Sprites<'_>,
    layers: &[(usize, Layer)],
    at: [u32; 2],
    wall: (f64, f64),
    rounding: &Rounding,
) -> Composed {
    compose(mixtures(view, sprites, layers, at, wall, rounding), sprites.radiance)
}

/// Returns the mixtures near to far.
fn mixtures(
    view: &View,
    sprites: &Sprites<'_>,
    layers: &[(usize, Layer)],
    [i, j]: [u32; 2],
    (depth, depth_bound): (f64, f64),
    rounding: &Rounding,
) -> Vec<Mixture> {
    let ray = view.ray(i, j);
    let length = ray.length();
    let wall = (depth * length, depth_bound * length);
    let first = i / LIGHT_RUN * LIGHT_RUN;
    let ends = [first, first + LIGHT_RUN - 1].map(|i| view.ray(i, j).normalize());
    let place = f64::from(i - first) / f64::from(LIGHT_RUN - 1);
    let ray = Ray { view, sprites, direction: ray / length, ends, place, wall };
    let mut slices: BTreeMap<i64, Mixture> = BTreeMap::new();
    for (j, layer) in layers {
        for (i_slice, part) in ray.dealt(*j, layer, rounding) {
            slices.entry(i_slice).or_default().parts.push(part);
        }
    }
    slices.into_values().collect()
}

impl Ray<'_> {
    /// Returns the light of blob `j` in the middle of a slice, over its own, and by how much a
    /// device's may differ. That is the error of the place in cells, and of the sum of eight.
    fn light_of(&self, cells: &CellLight<'_>, j: usize, i_slice: i64) -> (f64, f64) {
        let (eye, slice) = (self.view.pose.position, self.view.slice);
        // The last slice of a blob begins at the boundary nearest to its centre.
        let along = (i_slice as f64 + 1.5 - f64::from(self.view.n_parts)) * slice;
        let [first, last] = self.ends.map(|d| cells.factor(j, eye + along * d));
        let light = first.0 + self.place * (last.0 - first.0);
        let greatest = first.1.max(last.1);
        let in_cells = (eye.length() + along.abs()) / cells.cells.edge();
        (light, N_ROUNDINGS * U * (in_cells + 4.0) * greatest)
    }

    /// Returns the part that `layer` of blob `j` has in each slice, with the slice's number.
    fn dealt(&self, j: usize, layer: &Layer, r: &Rounding) -> Vec<(i64, Part)> {
        let (blob, slice) = (&self.sprites.blobs[j], self.view.slice);
        let c = blob.position - self.view.pose.position;
        let distance = c.length();
        // Along the ray, a ball lies as along the one through its centre.
        let white = blob.whiten(self.direction);
        let (foot, width) = match blob.shape == Shape::BALL {
            true => (distance, blob.sigma),
            false => {
                (blob.whiten(c).dot(white) / white.length_squared(), blob.sigma / white.length())
            }
        };
        let place = (r.depth + N_ROUNDINGS * U) * distance;
        // x e^{−x²/2}/√(2π) is below 1/4: what an error of σ does.
        let off_share = SHARE + STEEPEST * place / width + 0.25 * N_ROUNDINGS * U;
        // Where the opaque pixel is infinitely far, its distance has no error.
        let off_hidden = if self.wall.0.is_finite() {
            off_share + STEEPEST * self.wall.1 / width
        } else {
            off_share
        };
        let wall = (self.wall.0 - foot) / width;
        // The share of each slice, and the light of the part times that.
        let n_parts = i64::from(self.view.n_parts);
        let at = |i_boundary: i64| -> Vec<(f64, (f64, f64))> {
            // The end of part m; the first begins at the eye.
            let end = |m: i64| match m {
                m if m < 0 => f64::NEG_INFINITY,
                m if m + 1 == n_parts => wall,
                m => (((i_boundary + m + 2 - n_parts) as f64 * slice - foot) / width).min(wall),
            };
            let part = |m: i64| {
                let [from, to] = [end(m - 1), end(m)];
                let share = below(to) - below(from);
                let light = match self.sprites.cells {
                    None => layer.light.between([from, to], share, off_share + off_hidden),
                    Some(cells) => {
                        let (light, off) = self.light_of(cells, j, i_boundary + m);
                        (share * light, (share + off_share + off_hidden) * off)
                    }
                };
                (share, light)
            };
            (0..n_parts).map(part).collect()
        };
        let place_in_slices = distance / slice;
        let nearest = place_in_slices.round();
        let mut found: Vec<(i64, Part)> = Vec::new();
        let shares = at(nearest as i64);
        let whole = layer.tau.min(DEEPEST);
        for (m, (share, (light, off_light))) in shares.iter().enumerate() {
            let tau = whole * share;
            let off = r.tau * tau + whole * (off_share + off_hidden);
            let (shine, off_shine) = (whole * light, whole * off_light);
            found.push((
                nearest as i64 + m as i64,
                Part { j: j as u32, tau, off, shine, off_shine },
            ));
        }
        // Another boundary may be as near.
        let other = nearest + (place_in_slices - nearest).signum();
        if 0.5 - (place_in_slices - nearest).abs() <= (place + r.order) / slice {
            for (m, (share, (light, off_light))) in at(other as i64).into_iter().enumerate() {
                let (i_slice, tau, shine) = (other as i64 + m as i64, whole * share, whole * light);
                match found.iter_mut().find(|(i, ..)| *i == i_slice) {
                    Some((_, here)) => {
                        here.off += (tau - here.tau).abs();
                        let light = if here.tau > 0.0 { here.shine / here.tau } else { 1.0 };
                        here.off_shine += (shine - here.shine - light * (tau - here.tau)).abs();
                    }
                    None => {
                        let off_shine = (shine - tau).abs() + whole * off_light;
                        let part = Part { j: j as u32, tau: 0.0, off: tau, shine: 0.0, off_shine };
                        found.push((i_slice, part));
                    }
                }
            }
            // A slice that only the nearest boundary has.
            let lost = |i: i64| !(0..n_parts).contains(&(i - other as i64));
            for (_, part) in found.iter_mut().filter(|(i, _)| lost(*i)) {
                part.off += part.tau;
            }
        }
        for (_, part) in &mut found {
            // Only rounding may draw the layer, or leave it out.
            part.off += if layer.is_uncertain { part.tau } else { 0.0 };
            if !layer.is_drawn {
                (part.tau, part.shine) = (0.0, 0.0);
            }
        }
        found
    }
}

impl Mixture {
    fn tau(&self) -> f64 {
        self.parts.iter().map(|p| p.tau).sum()
    }
}

/// Composes mixtures near to far.
fn compose(mixtures: Vec<Mixture>, radiance: &[DVec3]) -> Composed {
    let mut pixel = Composed::NOTHING;
    for mixture in mixtures {
        let tau = mixture.tau();
        let n = mixture.parts.len() as f64;
        let own = |part: &Part| radiance[part.j as usize];
        let of = |p: &Part| if p.tau > 0.0 { p.shine / p.tau * own(p) } else { own(p) };
        let sum = |f: &dyn Fn(&Part) -> DVec3| mixture.parts.iter().map(f).sum::<DVec3>();
        let mean = if tau > 0.0 { sum(&|p| p.shine * own(p)) / tau } else { DVec3::ZERO };
        let off_tau = mixture.parts.iter().map(|p| p.off).sum::<f64>() + (n + 2.0) * U * tau;
        let alpha = -libm::expm1(-tau);
        let off_alpha = (-(tau - off_tau).max(0.0)).exp() * off_tau + OPACITY * alpha;
        // d mean = Σ dp (L − mean)/t to first order; the sum that divides may be less by its own
        // error. The mean is never outside the radiances.
        let least = (tau - off_tau).max(1e-300);
        let moved = sum(&|p| p.off * (of(p) - mean).abs()) / least;
        let widest =
            mixture.parts.iter().map(|p| (of(p) - mean).abs()).fold(DVec3::ZERO, DVec3::max);
        let bright = |p: &Part| own(p).abs().max(of(p).abs());
        let brightest = mixture.parts.iter().map(bright).fold(DVec3::ZERO, DVec3::max);
        let of_light = sum(&|p| p.off_shine * own(p).abs()) / least;
        let of_light = of_light.min(BRIGHTER * brightest);
        let off_mean = moved.min(widest) + of_light + (n + 6.0) * U * mean.abs();
        pixel.off_color += (pixel.passed + pixel.off_passed) * (alpha + off_alpha) * off_mean;
        pixel.under(alpha, off_alpha, mean.into());
    }
    pixel
}
