//! The layers of blobs in the pixels of a picture, model.md §9, in f64. A layer says which blob a
//! ray meets, with which optical depth, and how far a device may be off.
//!
//! In: blobs and eye relative to O, an order. Out: what a caller makes of the layers of a pixel.

use glam::{DVec2, DVec3};

use super::Blob;
use super::composite::{OpaquePixel, Rounding};
use super::diffusion::SeenCells;
use super::shade::{SeenLight, SeenShade};
use super::shine::Shine;
use super::view::View;
use crate::model::parallel::parallel_map;
use crate::model::shade::Shade;

/// A factor on τ of blob `j`, given the difference of the ray's slopes from its centre's.
pub type Factor<'a> = &'a (dyn Fn(usize, DVec2) -> f64 + Sync);

/// Bound of the radiance of a part of a blob over that of its facet. Its centre has up to twice as
/// much, and the light changes by ¼ over a σ. A part is up to 8 σ to the side, which the angle of
/// view may double.
pub(super) const BRIGHTER: f64 = 11.0;

/// Blobs to draw, with their radiance, order and textures.
#[derive(Clone, Copy)]
pub struct Sprites<'a> {
    /// Placed blobs.
    pub blobs: &'a [Blob],
    /// Radiance by blob, W m⁻² sr⁻¹, linear RGB.
    pub radiance: &'a [DVec3],
    /// Indices of the drawn blobs, far to near.
    pub order: &'a [u32],
    /// Factor on τ; `None` for plain blobs.
    pub factor: Option<Factor<'a>>,
    /// Light inside of each blob; `None` where it is the same throughout.
    pub shades: Option<&'a [Shade]>,
    /// Light that slices have where they are; `None` where they have that of their blobs.
    pub cells: Option<&'a CellLight<'a>>,
}

/// Light of cells, which slices have where they are, in the blobs' colours.
#[derive(Debug, Clone)]
pub struct CellLight<'a> {
    /// Radiance toward the eye by cell.
    pub cells: &'a SeenCells,
    /// By blob, the mean over the channels of what cells show of it: its own radiance belongs to
    /// that.
    pub means: Vec<f64>,
}

impl CellLight<'_> {
    /// Returns the factor on the radiance of blob `j` at `p`, and its greatest in the cells around.
    pub(super) fn factor(&self, j: usize, p: DVec3) -> (f64, f64) {
        let mean = self.means[j];
        if mean <= 0.0 {
            return (0.0, 0.0);
        }
        (self.cells.mean_at(p) / mean, self.cells.greatest_about(p) / mean)
    }
}

impl Sprites<'_> {
    pub(super) fn factor(&self, j: usize, delta: DVec2) -> f64 {
        self.factor.map_or(1.0, |f| f(j, delta))
    }

    /// Returns the greatest radiance of any part of a blob.
    pub(super) fn brightest(&self) -> f64 {
        let brightest = self.radiance.iter().map(|l| l.abs().max_element()).fold(0.0, f64::max);
        if let Some(light) = self.cells {
            let of = |(l, mean): (&DVec3, &f64)| {
                if *mean > 0.0 { l.abs().max_element() / mean } else { 0.0 }
            };
            let most = self.radiance.iter().zip(&light.means).map(of).fold(0.0, f64::max);
            return brightest.max(most * light.cells.greatest());
        }
        if self.shades.is_some() { BRIGHTER * brightest } else { brightest }
    }
}

/// A picture as [C_r, C_g, C_b, A], and by how much a device's picture may differ, channel by
/// channel.
pub type Bounded = (Vec<[f64; 4]>, Vec<[f64; 4]>);

/// Pixels of a part of a picture, one in each cell of a grid.
#[derive(Debug, Clone, Copy)]
pub struct Raster<'a> {
    /// [column, row] of the part's first pixel.
    pub first: [u32; 2],
    /// Number of cells in a row.
    pub n_columns: u32,
    /// Side of a cell, pixels.
    pub cell: u32,
    /// [column, row] of every pixel in the picture, rows of cells from the top.
    pub at: &'a [[u32; 2]],
}

/// The shares of a pixel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shares {
    /// Blobs, and the share of each one's radiance in the pixel, far to near.
    pub blobs: Vec<(u32, f64)>,
    /// Share of what is behind all blobs.
    pub behind: f64,
}

/// Composes the layers of every pixel of `raster` far to near: `start` makes a pixel of what is
/// behind, `over` lays a blob's layer over it, `finish` takes the whole one and its number.
#[expect(clippy::too_many_arguments, reason = "three of them are the parts of one fold")]
pub(super) fn composed<P: Clone, T: Send + Clone>(
    view: &View,
    raster: &Raster<'_>,
    opaque: &[OpaquePixel],
    (sprites, rounding): (&Sprites<'_>, &Rounding),
    start: impl Fn(&OpaquePixel) -> P + Sync + Send,
    over: impl Fn(&mut P, usize, &Layer) + Sync + Send,
    finish: impl Fn(usize, P) -> T + Sync + Send,
    on_row: &(dyn Fn(usize) + Sync),
) -> Vec<T> {
    let footprint = |&j: &u32| Some((j as usize, sprites.footprint(view, j as usize, rounding)?));
    let footprints: Vec<(usize, Footprint)> = sprites.order.iter().filter_map(footprint).collect();
    let Raster { first: [left, top], cell, at, .. } = *raster;
    let n_columns = raster.n_columns as usize;
    let n_rows = at.len().div_ceil(n_columns.max(1));
    let rows = parallel_map(n_rows, |i| {
        let here = i * n_columns..((i + 1) * n_columns).min(at.len());
        let opaque = &opaque[here.clone()];
        let mut pixels: Vec<P> = opaque.iter().map(&start).collect();
        let (first, end) = (top + i as u32 * cell, top + (i as u32 + 1) * cell);
        for (j, f) in footprints.iter().filter(|(_, f)| f.rows.0 < end && f.rows.1 > first) {
            let [from, to] = [f.columns.0, f.columns.1].map(|column| column.saturating_sub(left));
            let (from, to) = (from / cell, to.div_ceil(cell));
            for (k, pixel) in pixels.iter_mut().enumerate().take(to as usize).skip(from as usize) {
                let [column, row] = at[here.start + k];
                if (f.columns.0..f.columns.1).contains(&column)
                    && (f.rows.0..f.rows.1).contains(&row)
                {
                    let (ray, behind) = (view.ray(column, row), &opaque[k]);
                    let behind = (behind.depth, behind.depth_bound);
                    if let Some(layer) = f.seen.layer(view, sprites, *j, ray, behind, rounding) {
                        over(pixel, *j, &layer);
                    }
                }
            }
        }
        on_row(n_rows);
        here.zip(pixels).map(|(k, pixel)| finish(k, pixel)).collect::<Vec<T>>()
    });
    rows.concat()
}

/// A blob as a view sees it.
struct Footprint {
    seen: Seen,
    /// Columns and rows (first, end) outside which the blob is not seen.
    columns: (u32, u32),
    rows: (u32, u32),
}

/// A blob in front of the eye.
pub(super) struct Seen {
    /// Offset from the eye, and view depth.
    c: DVec3,
    depth: f64,
    /// How much wider than the smallest size it is, and whether rounding decides that.
    above: f64,
    of_size: bool,
}

/// A blob's layer in one pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layer {
    /// Opacity that is drawn: 0 where only rounding could draw the blob.
    pub alpha: f64,
    /// By how much a device's opacity may differ.
    pub off: f64,
    /// Optical depth, whether or not it is drawn.
    pub tau: f64,
    /// View depth of the blob's centre.
    pub depth: f64,
    /// Whether the law draws the layer.
    pub is_drawn: bool,
    /// Whether rounding decides if the layer is drawn.
    pub is_uncertain: bool,
    /// Light along the ray, as a factor on the blob's radiance.
    pub light: SeenLight,
}

impl Layer {
    /// Returns the radiance of the layer of a blob of `radiance`, composed as a whole.
    pub fn shine(&self, radiance: DVec3) -> Shine {
        let (tint, off) = self.light.whole(self.tau);
        Shine { radiance: tint * radiance, off: off * radiance.abs() }
    }
}

impl Seen {
    /// Returns `None` if the blob is in front of the near plane, has no size, or is too small.
    pub fn new(view: &View, blob: &Blob, r: &Rounding) -> Option<Seen> {
        let c = blob.position - view.pose.position;
        let depth = c.dot(view.pose.forward);
        if !(depth >= view.near && blob.sigma > 0.0) {
            return None;
        }
        let (above, off_size) = view.above_smallest(blob, c, r.depth);
        (above >= -off_size).then_some(Seen { c, depth, above, of_size: above.abs() < off_size })
    }

    /// Returns blob `j`'s layer along `ray` before an opaque pixel of that depth, given with its
    /// bound; `None` if neither the law nor rounding draws it.
    pub fn layer(
        &self,
        view: &View,
        sprites: &Sprites<'_>,
        j: usize,
        ray: DVec3,
        (opaque, opaque_bound): (f64, f64),
        r: &Rounding,
    ) -> Option<Layer> {
        let line = sprites.blobs[j].along(self.c, ray);
        let cut = view.edge.cut(line.depth);
        // A sprite ends in a step at its edge, and rounding decides on which side a pixel lies. The
        // depth of the opaque pixel decides likewise.
        let beyond = 0.5 * line.off.powi(2) - cut;
        let (on_edge, at_opaque) =
            (beyond.abs() <= r.slack(cut), (self.depth - opaque).abs() < opaque_bound);
        let is_in = beyond <= 0.0 && cut > 0.0;
        if (!is_in && !on_edge) || (self.depth > opaque && !at_opaque) {
            return None;
        }
        let delta = view.slopes_of(ray) - view.slopes_of(self.c);
        let tau = sprites.factor(j, delta) * line.tau();
        let alpha = alpha(tau);
        let is_uncertain = on_edge || at_opaque || self.of_size;
        let off = if is_uncertain { (1.0 + r.alpha) * alpha } else { r.alpha * alpha };
        let is_drawn = is_in && self.depth <= opaque && self.above >= 0.0;
        let alpha = if is_drawn { alpha } else { 0.0 };
        let light = sprites.shades.map_or(SeenLight::PLAIN, |shades| {
            SeenShade::new(view, &sprites.blobs[j], self.c, &shades[j]).toward(delta, r)
        });
        Some(Layer { alpha, off, tau, depth: self.depth, is_drawn, is_uncertain, light })
    }
}

impl Sprites<'_> {
    fn footprint(&self, view: &View, j: usize, r: &Rounding) -> Option<Footprint> {
        let blob = &self.blobs[j];
        let seen = Seen::new(view, blob, r)?;
        let most = view.edge.cut(blob.deepest());
        let reach = (2.0 * (most + r.slack(most)).max(0.0)).sqrt();
        if reach <= 0.0 {
            return None;
        }
        let [columns, rows] = view.rectangle(blob, seen.c, reach);
        Some(Footprint { seen, columns, rows })
    }
}

/// Returns α = 1 − e^{−τ}.
pub fn alpha(tau: f64) -> f64 {
    -libm::expm1(-tau)
}
