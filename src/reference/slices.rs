//! Slices, passes.md "slices", in f64: overlapping blobs are dealt among shells of one thickness
//! about the eye, and the shells are composed near to far. A bound says how far a device may be
//! off.
//!
//! In: blobs and eye relative to O, the layers of a pixel. Out: the mixture in each slice, and the
//! pixel composed of them.

use std::collections::BTreeMap;

use glam::DVec3;

use super::blob_layers::{BRIGHTER, Layer, Raster, Shares, Sprites, composed};
use super::composed::{Composed, U};
use super::composite::{OpaquePixel, Rounding};
use super::shade::below;
use super::view::View;

/// Boundaries of slices that part a blob, before and at the one nearest to its centre.
const BOUNDARIES: [i64; 3] = [-2, -1, 0];
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
        let [i, j] = raster.at[k];
        let wall = (opaque[k].depth, opaque[k].depth_bound);
        finish(mixtures(view, sprites, &pixel, view.ray(i, j), wall, rounding))
    };
    composed(view, raster, &hides_none, (sprites, rounding), |_| Vec::new(), layers, of, on_row)
}

/// Returns the pixel whose `layers` lie along `ray`, before an opaque one of the view depth `wall`,
/// given with its bound.
pub(super) fn pixel(
    view: &View,
    sprites: &Sprites<'_>,
    layers: &[(usize, Layer)],
    ray: DVec3,
    wall: (f64, f64),
    rounding: &Rounding,
) -> Composed {
    compose(mixtures(view, sprites, layers, ray, wall, rounding), sprites.radiance)
}

/// Returns the mixtures near to far.
fn mixtures(
    view: &View,
    sprites: &Sprites<'_>,
    layers: &[(usize, Layer)],
    ray: DVec3,
    (depth, depth_bound): (f64, f64),
    rounding: &Rounding,
) -> Vec<Mixture> {
    let length = ray.length();
    let wall = (depth * length, depth_bound * length);
    let ray = Ray { view, sprites, direction: ray / length, wall };
    let mut slices: BTreeMap<i64, Mixture> = BTreeMap::new();
    for (j, layer) in layers {
        for (i_slice, part) in ray.dealt(*j, layer, rounding) {
            slices.entry(i_slice).or_default().parts.push(part);
        }
    }
    slices.into_values().collect()
}

impl Ray<'_> {
    /// Returns the part that `layer` of blob `j` has in each slice, with the slice's number.
    fn dealt(&self, j: usize, layer: &Layer, r: &Rounding) -> Vec<(i64, Part)> {
        let (blob, slice) = (&self.sprites.blobs[j], self.view.slice);
        let c = blob.position - self.view.pose.position;
        let distance = c.length();
        // Along the ray, a ball lies as along the one through its centre.
        let white = blob.whiten(self.direction);
        let (foot, width) = match blob.aspect == 1.0 {
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
        let at = |i_boundary: i64| {
            let [a, b, c] =
                BOUNDARIES.map(|k| (((i_boundary + k) as f64 * slice - foot) / width).min(wall));
            [[f64::NEG_INFINITY, a], [a, b], [b, c], [c, wall]].map(|[from, to]| {
                let share = below(to) - below(from);
                (share, layer.light.between([from, to], share, off_share + off_hidden))
            })
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
            let lost = |i: i64| !(0..4).contains(&(i - other as i64));
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
        let brightest = mixture.parts.iter().map(|p| own(p).abs()).fold(DVec3::ZERO, DVec3::max);
        let of_light = sum(&|p| p.off_shine * own(p).abs()) / least;
        let of_light = of_light.min(BRIGHTER * brightest);
        let off_mean = moved.min(widest) + of_light + (n + 6.0) * U * mean.abs();
        pixel.off_color += (pixel.passed + pixel.off_passed) * (alpha + off_alpha) * off_mean;
        pixel.under(alpha, off_alpha, mean.into());
    }
    pixel
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::cloud::SQRT_TAU;
    use crate::reference::Blob;
    use crate::reference::sprites::{render_over, shares_at};
    use crate::reference::volume::Volume;

    const VIEW: View = View { slice: 1.0, ..View::ONE_PIXEL };

    fn at(z: f64, sigma: f64, tau: f64) -> Blob {
        let kappa = tau / (SQRT_TAU * sigma);
        Blob { aspect: 1.0, position: DVec3::NEG_Z * z, sigma, kappa }
    }

    fn drawn(view: &View, blobs: &[Blob], behind: OpaquePixel) -> [f64; 4] {
        let colors = [DVec3::X, DVec3::Y, DVec3::Z];
        let mut order: Vec<u32> = (0..blobs.len() as u32).collect();
        order.sort_by(|i, j| {
            let z = |k: &u32| blobs[*k as usize].position.length();
            z(j).total_cmp(&z(i))
        });
        let sprites = Sprites {
            blobs,
            radiance: &colors[..blobs.len()],
            order: &order,
            factor: None,
            shades: None,
        };
        let drawn = render_over(view, &[behind], &sprites, &Rounding::NONE).0[0];
        // Shares are those of the picture.
        let raster = Raster { first: [0, 0], n_columns: 1, cell: 1, at: &[[0, 0]] };
        let shares = shares_at(view, &raster, &[behind], &sprites).remove(0);
        let sum: DVec3 = shares.blobs.iter().map(|(j, s)| *s * colors[*j as usize]).sum();
        let shown = sum + shares.behind * DVec3::from_slice(&behind.color[..3]);
        assert!((shown - DVec3::from_slice(&drawn[..3])).abs().max_element() < 1e-14);
        drawn
    }

    fn is(a: [f64; 4], b: [f64; 4]) -> bool {
        (0..4).all(|k| (a[k] - b[k]).abs() < 1e-12)
    }

    #[test]
    fn blobs_in_one_place_are_mixed_and_blobs_apart_are_not() {
        // Small blobs inside of one slice: half of each, 1 − e^{−(ln 2 + ln 2)} = 3/4 together.
        let ln2 = std::f64::consts::LN_2;
        let mixed = drawn(&VIEW, &[at(5.5, 0.01, ln2), at(5.4, 0.01, ln2)], OpaquePixel::EMPTY);
        assert!(is(mixed, [0.375, 0.375, 0.0, 0.75]), "{mixed:?}");
        // Slices apart: ½, and ½ of what is left.
        let apart = drawn(&VIEW, &[at(5.5, 0.01, ln2), at(2.5, 0.01, ln2)], OpaquePixel::EMPTY);
        assert!(is(apart, [0.25, 0.5, 0.0, 0.75]), "{apart:?}");
    }

    #[test]
    fn a_blob_is_dealt_by_its_share_of_a_gaussian() {
        // σ = 1 about the boundary at 5: half of it on either side, of which Φ(−1) = 0.158655 lies
        // more than a slice before. A thin blob in the slice from 4 to 5 sees that before it.
        let tau = 1e-6;
        let [before, own] = [0.158_655_253_931_457_05, 0.341_344_746_068_543];
        let seen = drawn(&VIEW, &[at(5.0, 1.0, tau), at(4.5, 1e-3, 40.0)], OpaquePixel::EMPTY);
        // All of the opaque blob shows, but for what is before it. Behind it nothing does. In its
        // own slice the share of the thin one is that of the mixture, next to nothing.
        assert!((seen[0] / tau - before - own / 40.0).abs() < 1e-4, "{seen:?}");
    }

    #[test]
    fn what_is_behind_a_surface_is_cut_off() {
        let behind = OpaquePixel { color: [0.0, 0.0, 1.0, 1.0], depth: 5.0, ..OpaquePixel::EMPTY };
        let half = drawn(&VIEW, &[at(5.0, 0.3, 2.0)], behind);
        let through = (-1.0f64).exp();
        assert!(is(half, [1.0 - through, 0.0, through, 1.0]), "{half:?}");
        let none = drawn(&VIEW, &[at(7.0, 0.1, 2.0)], behind);
        assert!(is(none, behind.color));
    }

    /// Error against the integral over the volume, and that of thin sprites.
    fn errors(view: &View, blobs: &[Blob]) -> [f64; 2] {
        let colors = [DVec3::X, DVec3::Y, DVec3::Z];
        let volume = Volume::new(view, blobs, &colors[..blobs.len()]);
        let truth = volume.row(0, [(0, OpaquePixel::EMPTY)].into_iter())[0].color;
        [view.slice, 0.0].map(|slice| {
            let found = drawn(&View { slice, ..*view }, blobs, OpaquePixel::EMPTY);
            (0..3).map(|k| (found[k] - truth[k]).powi(2)).sum::<f64>().sqrt()
        })
    }

    #[test]
    fn slices_are_nearer_to_the_volume_than_thin_sprites() {
        let mut all = [0.0f64; 2];
        for shift in [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9] {
            let blobs =
                [at(6.0 + shift, 0.8, 1.5), at(6.3 + shift, 0.9, 1.0), at(7.1 + shift, 0.8, 2.0)];
            let view = View { edge: crate::model::edge::Edge::NONE, ..VIEW };
            let [slices, thin] = errors(&view, &blobs);
            all = [all[0] + slices * slices, all[1] + thin * thin];
        }
        assert!(all[0] < 0.15 * 0.15 * all[1], "{all:?}");
    }

    #[test]
    fn a_boundary_that_rounding_may_choose_is_in_the_bound() {
        let rounding = Rounding { depth: 1e-6, ..Rounding::NONE };
        let blobs = [at(5.5, 0.9, 1.0), at(5.1, 0.9, 1.0)];
        let off = |z: f64| {
            let blobs = [at(z, 0.9, 1.0), blobs[1]];
            let (radiance, order) = ([DVec3::X, DVec3::Y], [0, 1]);
            let sprites = Sprites {
                blobs: &blobs,
                radiance: &radiance,
                order: &order,
                factor: None,
                shades: None,
            };
            let behind = [OpaquePixel::EMPTY];
            let (value, bound) = render_over(&VIEW, &behind, &sprites, &rounding);
            (value[0], bound[0])
        };
        let (below, wide) = off(5.5 - 1e-7);
        let (above, _) = off(5.5 + 1e-7);
        let (_, narrow) = off(5.6);
        assert!(narrow[0] < 1e-4 && wide[0] < 0.5, "{narrow:?} {wide:?}");
        for k in 0..4 {
            assert!((below[k] - above[k]).abs() <= wide[k], "{k}: {below:?} {above:?} {wide:?}");
        }
        assert!((below[0] - above[0]).abs() > narrow[0], "the choice shows: {below:?} {above:?}");
    }
}
