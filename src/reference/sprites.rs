//! Sprites, model.md §9 and §11 "sprites": thin blobs composed far to near with premultiplied
//! "over", in f64, with a bound on what a target of few bits may differ.
//!
//! In: blobs and eye relative to O, an order. Out: [row][column] of [C_r, C_g, C_b, A], row 0 at
//! the top.

use glam::{DVec2, DVec3};

use super::Blob;
use super::parallel::parallel_map;
use crate::model::camera::Pose;
use crate::model::film::FilmFormat;

/// A view: camera, picture size and cuts. `pose.position` is the eye relative to O.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pose of the camera.
    pub pose: Pose,
    /// Vertical field of view.
    pub fov_y_rad: f64,
    /// Least view depth of a drawn particle's centre.
    pub near: f64,
    /// Radius at which sprites end, σ.
    pub cutoff: f64,
    /// Optical depth below which sprites end.
    pub threshold: f64,
    /// Width in pixels of σ below which blobs are left out; 0 leaves out none.
    pub smallest: f64,
    /// Offset of the rays from the pixels' centres, to the right and down, pixels within ±½.
    pub shift: DVec2,
}

/// Permitted departures of a device from the mathematics while drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// u_t: unit round-off of the target's channels.
    pub unit: f64,
    /// Least normal number of the target: below it the error no longer shrinks with the value.
    pub least_normal: f64,
    /// Step of a target that holds 0 to 1 in equal steps, which clamps what it blends; 0 for
    /// floats.
    pub step: f64,
    /// Relative error of each α.
    pub alpha: f64,
    /// Relative error of b. Half the error of b²/2σ², as a share of its value at the cut, or of 1
    /// if that is less. Nearer to the cut a sprite may end or not.
    pub edge: f64,
    /// Error of a view depth where it decides on a size, as a share of the distance.
    pub depth: f64,
}

/// The opaque background of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpaquePixel {
    /// Premultiplied colour and alpha.
    pub color: [f64; 4],
    /// Bound on the target's difference, channel by channel.
    pub bound: [f64; 4],
    /// View depth. Particles whose centre lies beyond are hidden.
    pub depth: f64,
    /// Range about `depth` in which a particle may be hidden or not.
    pub depth_bound: f64,
}

impl OpaquePixel {
    /// No background.
    pub const EMPTY: OpaquePixel =
        OpaquePixel { color: [0.0; 4], bound: [0.0; 4], depth: f64::INFINITY, depth_bound: 0.0 };
}

impl Rounding {
    /// Returns the rounding of a format, with relative errors of each α and of the distances at
    /// edges.
    pub fn of(format: FilmFormat, alpha: f64, edge: f64) -> Rounding {
        let unit = format.unit_roundoff();
        let (unit, least_normal, step) = match format {
            FilmFormat::Rgba8 => (0.0, 0.0, 2.0 * unit),
            FilmFormat::Rgba16f => (unit, 2f64.powi(-14), 0.0),
            FilmFormat::Rgba32f => (unit, 2f64.powi(-126), 0.0),
        };
        Rounding { unit, least_normal, step, alpha, edge, depth: 0.0 }
    }

    /// Returns the distance from the cut beyond which rounding cannot move b²/2σ² across it.
    pub(super) fn slack(&self, cut: f64) -> f64 {
        (2.0 + self.edge) * self.edge * cut.max(1.0)
    }

    /// Exact arithmetic.
    pub const NONE: Rounding =
        Rounding { unit: 0.0, least_normal: 0.0, step: 0.0, alpha: 0.0, edge: 0.0, depth: 0.0 };

    /// Returns what the target holds of an opaque colour.
    pub fn stored(&self, behind: OpaquePixel) -> OpaquePixel {
        if self.step == 0.0 {
            return behind;
        }
        let color = behind.color.map(|v| v.clamp(0.0, 1.0));
        // It is rounded to one of the two neighbouring steps.
        OpaquePixel { color, bound: behind.bound.map(|e| e + self.step), ..behind }
    }
}

impl View {
    pub(super) fn half_slopes(&self) -> (f64, f64) {
        let tan = (0.5 * self.fov_y_rad).tan();
        (tan * f64::from(self.width) / f64::from(self.height), tan)
    }

    /// Returns b²/2σ² where a sprite of central optical depth `tau` ends (model.md §11
    /// "threshold"). If it is not positive nothing is drawn.
    pub fn cut(&self, tau: f64) -> f64 {
        // Without a threshold the logarithm is infinite, or NaN for 0/0, which `min` ignores.
        (0.5 * self.cutoff * self.cutoff).min((tau / self.threshold).ln())
    }

    /// Returns by how much a blob's σ exceeds the smallest drawn width, `c` its offset from the
    /// eye; if negative the blob is not drawn (model.md §11 "cull"). The second value bounds a
    /// device's error, with `depth` as in [`Rounding`].
    pub fn above_smallest(&self, blob: &Blob, c: DVec3, depth: f64) -> (f64, f64) {
        let width = self.smallest * self.pixel();
        (blob.widest() - width * c.dot(self.pose.forward), width * depth * c.length())
    }

    /// Returns the ray through the pixel in column `i` and row `j`, at its centre plus `shift`. Its
    /// view depth is 1.
    pub fn ray(&self, i: u32, j: u32) -> DVec3 {
        let (slope_x, slope_y) = self.half_slopes();
        let x = 2.0 * (f64::from(i) + 0.5 + self.shift.x) / f64::from(self.width) - 1.0;
        let y = 1.0 - 2.0 * (f64::from(j) + 0.5 + self.shift.y) / f64::from(self.height);
        self.pose.forward + x * slope_x * self.pose.right + y * slope_y * self.pose.up
    }

    /// Returns the slopes of the direction `offset`.
    pub fn slopes_of(&self, offset: DVec3) -> DVec2 {
        DVec2::new(offset.dot(self.pose.right), offset.dot(self.pose.up))
            / offset.dot(self.pose.forward)
    }

    /// Returns the difference of slopes between neighbouring pixels.
    pub fn pixel(&self) -> f64 {
        2.0 * self.half_slopes().1 / f64::from(self.height)
    }

    /// Returns the columns and rows (first, end) outside which no ray meets `blob` out to `reach`
    /// σ, `c` its offset from the eye. The range may be too large, never too small.
    pub(super) fn rectangle(&self, blob: &Blob, c: DVec3, reach: f64) -> [(u32, u32); 2] {
        let (slope_x, slope_y) = self.half_slopes();
        let [x, y] = [self.pose.right, self.pose.up]
            .map(|side| blob.slopes(c, [side, self.pose.forward], reach));
        let pixels = |(low, high): (f64, f64), slope: f64, n: u32| {
            let at = |s: f64| 0.5 * (s / slope + 1.0) * f64::from(n);
            // One pixel to either side covers the rounding of the tangents and a shift of up to
            // half a pixel. `as` saturates, and `min` keeps it inside.
            let from = ((at(low) - 1.0).floor() as u32).min(n);
            (from, ((at(high) + 1.0).ceil() as u32).clamp(from, n))
        };
        // Rows count downward.
        [pixels(x, slope_x, self.width), pixels((-y.1, -y.0), slope_y, self.height)]
    }
}

/// A pixel while it is composed.
#[derive(Debug, Clone, Copy)]
struct Layered {
    value: [f64; 4],
    bound: [f64; 4],
    /// View depth of the background, and its bound.
    opaque: (f64, f64),
}

impl From<&OpaquePixel> for Layered {
    fn from(b: &OpaquePixel) -> Layered {
        Layered { value: b.color, bound: b.bound, opaque: (b.depth, b.depth_bound) }
    }
}

impl Layered {
    /// Composes C ← αL + (1−α)C, A ← α + (1−α)A. The target's α is within `off`, and it rounds the
    /// result.
    fn over(&mut self, alpha: f64, off: f64, radiance: DVec3, r: &Rounding) {
        let source = [radiance.x, radiance.y, radiance.z, 1.0];
        for ((v, e), s) in self.value.iter_mut().zip(&mut self.bound).zip(source) {
            if r.step > 0.0 {
                [*v, *e] = over_steps([*v, *e], s, alpha, off, r);
                continue;
            }
            // C' − C'_t = (1 − α)(C − C_t) + (α − α_t)(L − C_t), |C_t − C| ≤ e.
            let inherited = (1.0 - alpha) * *e + off * ((s - *v).abs() + *e);
            *v = alpha * s + (1.0 - alpha) * *v;
            // Correct rounding errs by u_t of the number written, faithful rounding by 2 u_t.
            *e = inherited + 2.0 * r.unit * (v.abs() + inherited).max(r.least_normal);
        }
    }
}

/// Composes on a target of equal steps, which clamps source and result to [0, 1]; returns value and
/// bound. The target may blend in its own few bits (Vulkan, "Blending": no less precise than the
/// target). Source, factor, product and sum are then each rounded to a step, half a step off where
/// rounding is correct.
fn over_steps(
    [value, bound]: [f64; 2],
    source: f64,
    alpha: f64,
    off: f64,
    r: &Rounding,
) -> [f64; 2] {
    // The difference of source and target does not bound the error as in floats, since a clamped
    // source does not follow α.
    let inherited = (1.0 - alpha) * bound + off * (source.abs() + value.abs() + bound);
    let new = ((alpha * source).clamp(0.0, 1.0) + (1.0 - alpha) * value).clamp(0.0, 1.0);
    let bound =
        inherited + 2.0 * r.step + 2.0 * r.unit * (alpha * source.abs() + value + inherited);
    // Both values lie in [0, 1], so the bound is at most 1 unless it is infinite.
    [new, if bound.is_finite() { bound.min(1.0) } else { bound }]
}

/// A factor on τ of blob `j`, given the difference of the ray's slopes from its centre's.
pub type Factor<'a> = &'a (dyn Fn(usize, DVec2) -> f64 + Sync);

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
}

impl Sprites<'_> {
    pub(super) fn factor(&self, j: usize, delta: DVec2) -> f64 {
        self.factor.map_or(1.0, |f| f(j, delta))
    }
}

/// A picture as [C_r, C_g, C_b, A], and by how much a device's picture may differ, channel by
/// channel.
pub type Bounded = (Vec<[f64; 4]>, Vec<[f64; 4]>);

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
    let mut pixels: Vec<Layered> = opaque.iter().map(Layered::from).collect();
    let width = view.width as usize;
    let n_rows = view.height.div_ceil(N_THREADS).max(1);
    std::thread::scope(|scope| {
        for (band, i) in pixels.chunks_mut((width * n_rows as usize).max(1)).zip(0u32..) {
            scope.spawn(move || {
                for &j in sprites.order {
                    draw(view, sprites, j as usize, (&mut *band, i * n_rows), rounding);
                }
            });
        }
    });
    pixels.iter().map(|p| (p.value, p.bound)).unzip()
}

/// Number of bands of rows that are drawn in parallel. The result does not depend on it.
const N_THREADS: u32 = 2;

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

/// Returns the values of [`render_over`] at the pixels of `raster` alone, over `opaque`, one each.
/// `on_row` is called with the number of rows of cells done, after each.
pub fn render_at(
    view: &View,
    raster: &Raster<'_>,
    opaque: &[OpaquePixel],
    sprites: &Sprites<'_>,
    on_row: &(dyn Fn(usize) + Sync),
) -> Vec<[f64; 4]> {
    let none = Rounding::NONE;
    let footprint = |&j: &u32| Some((j as usize, sprites.footprint(view, j as usize, &none)?));
    let footprints: Vec<(usize, Footprint)> = sprites.order.iter().filter_map(footprint).collect();
    let Raster { first: [left, top], cell, at, .. } = *raster;
    let n_columns = raster.n_columns as usize;
    let n_rows = at.len().div_ceil(n_columns.max(1));
    let rows = parallel_map(n_rows, |i| {
        let here = i * n_columns..((i + 1) * n_columns).min(at.len());
        let mut pixels: Vec<Layered> = opaque[here.clone()].iter().map(Layered::from).collect();
        let (first, end) = (top + i as u32 * cell, top + (i as u32 + 1) * cell);
        for (j, f) in footprints.iter().filter(|(_, f)| f.rows.0 < end && f.rows.1 > first) {
            let [from, to] = [f.columns.0, f.columns.1].map(|column| column.saturating_sub(left));
            let (from, to) = (from / cell, to.div_ceil(cell));
            for (k, pixel) in pixels.iter_mut().enumerate().take(to as usize).skip(from as usize) {
                let [column, row] = at[here.start + k];
                if (f.columns.0..f.columns.1).contains(&column)
                    && (f.rows.0..f.rows.1).contains(&row)
                {
                    sprites.lay(view, *j, f, [column, row], pixel, &none);
                }
            }
        }
        on_row(n_rows);
        pixels
    });
    rows.into_iter().flatten().map(|p| p.value).collect()
}

/// Draws blob `j` over the rows that `band` holds, from `first_row` on.
fn draw(
    view: &View,
    sprites: &Sprites<'_>,
    j: usize,
    (band, first_row): (&mut [Layered], u32),
    r: &Rounding,
) {
    let Some(footprint) = sprites.footprint(view, j, r) else { return };
    let n_rows = (band.len() / view.width as usize) as u32;
    for row in footprint.rows.0.max(first_row)..footprint.rows.1.min(first_row + n_rows) {
        for column in footprint.columns.0..footprint.columns.1 {
            let pixel = &mut band[((row - first_row) * view.width + column) as usize];
            sprites.lay(view, j, &footprint, [column, row], pixel, r);
        }
    }
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
pub(super) struct Layer {
    /// Opacity that is drawn: 0 where only rounding could draw the blob.
    pub alpha: f64,
    /// By how much a device's opacity may differ.
    pub off: f64,
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
        let cut = view.cut(line.depth);
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
        let alpha = alpha(sprites.factor(j, delta) * line.tau());
        let is_uncertain = on_edge || at_opaque || self.of_size;
        let off = if is_uncertain { (1.0 + r.alpha) * alpha } else { r.alpha * alpha };
        let is_drawn = is_in && self.depth <= opaque && self.above >= 0.0;
        Some(Layer { alpha: if is_drawn { alpha } else { 0.0 }, off })
    }
}

impl Sprites<'_> {
    fn footprint(&self, view: &View, j: usize, r: &Rounding) -> Option<Footprint> {
        let blob = &self.blobs[j];
        let seen = Seen::new(view, blob, r)?;
        let most = view.cut(blob.deepest());
        let reach = (2.0 * (most + r.slack(most)).max(0.0)).sqrt();
        if reach <= 0.0 {
            return None;
        }
        let [columns, rows] = view.rectangle(blob, seen.c, reach);
        Some(Footprint { seen, columns, rows })
    }

    /// Lays blob `j` over a pixel.
    fn lay(
        &self,
        view: &View,
        j: usize,
        footprint: &Footprint,
        [column, row]: [u32; 2],
        pixel: &mut Layered,
        r: &Rounding,
    ) {
        let ray = view.ray(column, row);
        if let Some(layer) = footprint.seen.layer(view, self, j, ray, pixel.opaque, r) {
            pixel.over(layer.alpha, layer.off, self.radiance[j], r);
        }
    }
}

/// Returns α = 1 − e^{−τ}.
pub fn alpha(tau: f64) -> f64 {
    -libm::expm1(-tau)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::cloud::SQRT_TAU;

    /// Eye at the origin, looking along −z, one pixel.
    const VIEW: View = View {
        width: 1,
        height: 1,
        pose: Pose { position: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z },
        fov_y_rad: 1.0,
        near: 0.5,
        cutoff: 3.0,
        threshold: 0.0,
        smallest: 0.0,
        shift: DVec2::ZERO,
    };

    #[test]
    fn the_background_shows_through_and_hides() {
        // α = 1 − e^{−ln 2} = ½ through the centres; colours (1, 0, 0) at depth 2 and (0, 1, 0) at
        // depth 4.
        let kappa = std::f64::consts::LN_2 / (SQRT_TAU * 0.25);
        let at = |z: f64| Blob { aspect: 1.0, position: DVec3::NEG_Z * z, sigma: 0.25, kappa };
        let (blobs, colors) = ([at(2.0), at(4.0)], [DVec3::X, DVec3::Y]);
        let over = |depth: f64, depth_bound: f64| {
            let behind = OpaquePixel {
                color: [0.0, 0.0, 1.0, 1.0],
                depth,
                depth_bound,
                ..OpaquePixel::EMPTY
            };
            let (value, bound) = {
                let sprites =
                    Sprites { blobs: &blobs, radiance: &colors, order: &[1, 0], factor: None };
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
