//! Drawing, model.md §9 and §11 "sprites": thin blobs composed far to near with premultiplied
//! "over", in f64; beside it a bound on what a target of few bits may differ. In: blobs and eye
//! relative to O, an order. Out: [width × height] of [C_r, C_g, C_b, A], row 0 at the top.

use glam::{DVec2, DVec3};

use super::Blob;
use super::area::mean::each;
use crate::model::camera::Pose;
use crate::model::film::FilmFormat;

/// What a picture is taken with; `pose.position` is the eye relative to O.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    pub width: u32,
    pub height: u32,
    pub pose: Pose,
    pub fov_y_rad: f64,
    /// Least view depth of a drawn particle's centre.
    pub near: f64,
    /// Sprites end at this many σ.
    pub cutoff: f64,
    /// And where their optical depth falls under this.
    pub threshold: f64,
    /// Blobs whose σ is narrower than so many pixels are left out; 0: none.
    pub smallest: f64,
    /// Where in a pixel its ray goes through: off its centre, to the right and down, pixels within
    /// ±½.
    pub shift: DVec2,
}

/// How a GPU may depart from the mathematics while drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// u_t: unit round-off of the target's channels.
    pub unit: f64,
    /// Least normal number of the target: below it the error no longer shrinks with the value.
    pub least_normal: f64,
    /// Of a target that holds 0 to 1 in equal steps, one of them; 0 of floats. What it blends is
    /// cut to that range.
    pub step: f64,
    /// Relative error of each α.
    pub alpha: f64,
    /// Error of b²/2σ², halved: a share of what that is at the cut, or of 1 where it is less there
    /// (so a relative error of b). Nearer to the cut a sprite may end or not.
    pub edge: f64,
    /// What a view depth may be off, as a share of the distance, where it decides on a size.
    pub depth: f64,
}

/// What stands behind the sprites in a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpaquePixel {
    pub color: [f64; 4],
    /// Per channel, what the target may differ from it.
    pub bound: [f64; 4],
    /// View depth: of particles whose centre lies beyond it nothing is drawn.
    pub depth: f64,
    /// A particle within this of `depth` may be drawn or not.
    pub depth_bound: f64,
}

impl OpaquePixel {
    pub const EMPTY: OpaquePixel =
        OpaquePixel { color: [0.0; 4], bound: [0.0; 4], depth: f64::INFINITY, depth_bound: 0.0 };
}

impl Rounding {
    pub fn of(format: FilmFormat, alpha: f64, edge: f64) -> Rounding {
        let unit = format.unit_roundoff();
        let (unit, least_normal, step) = match format {
            FilmFormat::Rgba8 => (0.0, 0.0, 2.0 * unit),
            FilmFormat::Rgba16f => (unit, 2f64.powi(-14), 0.0),
            FilmFormat::Rgba32f => (unit, 2f64.powi(-126), 0.0),
        };
        Rounding { unit, least_normal, step, alpha, edge, depth: 0.0 }
    }

    /// How far from the cut b²/2σ² is sure to lie on its side of it.
    pub(super) fn slack(&self, cut: f64) -> f64 {
        (2.0 + self.edge) * self.edge * cut.max(1.0)
    }

    pub const NONE: Rounding =
        Rounding { unit: 0.0, least_normal: 0.0, step: 0.0, alpha: 0.0, edge: 0.0, depth: 0.0 };

    /// What the target holds of an opaque colour.
    pub fn stored(&self, behind: OpaquePixel) -> OpaquePixel {
        if self.step == 0.0 {
            return behind;
        }
        let color = behind.color.map(|v| v.clamp(0.0, 1.0));
        // To one of the two steps beside it.
        OpaquePixel { color, bound: behind.bound.map(|e| e + self.step), ..behind }
    }
}

impl View {
    pub(super) fn half_slopes(&self) -> (f64, f64) {
        let tan = (0.5 * self.fov_y_rad).tan();
        (tan * f64::from(self.width) / f64::from(self.height), tan)
    }

    /// b²/2σ² where a sprite ends whose centre has the optical depth `tau` (model.md §11
    /// "threshold"); where it is not above 0 nothing is drawn.
    pub fn cut(&self, tau: f64) -> f64 {
        // Without a threshold the logarithm is infinite, or of 0/0 no number, which `min` leaves
        // out.
        (0.5 * self.cutoff * self.cutoff).min((tau / self.threshold).ln())
    }

    /// How much wider than the smallest one, over the eye's offset `c` from it, a blob's σ is:
    /// where that is below 0 nothing of it is drawn (model.md §11 "cull"). And how far a GPU's
    /// answer may lie from it, `depth` as in [`Rounding`].
    pub fn above_smallest(&self, blob: &Blob, c: DVec3, depth: f64) -> (f64, f64) {
        let width = self.smallest * self.pixel();
        (blob.widest() - width * c.dot(self.pose.forward), width * depth * c.length())
    }

    /// Direction through pixel (column `i`, row `j` from the top), at its centre but for `shift`;
    /// its view depth is 1.
    pub fn ray(&self, i: u32, j: u32) -> DVec3 {
        let (slope_x, slope_y) = self.half_slopes();
        let x = 2.0 * (f64::from(i) + 0.5 + self.shift.x) / f64::from(self.width) - 1.0;
        let y = 1.0 - 2.0 * (f64::from(j) + 0.5 + self.shift.y) / f64::from(self.height);
        self.pose.forward + x * slope_x * self.pose.right + y * slope_y * self.pose.up
    }

    /// Slopes of the way `offset` from the eye.
    pub fn slopes_of(&self, offset: DVec3) -> DVec2 {
        DVec2::new(offset.dot(self.pose.right), offset.dot(self.pose.up))
            / offset.dot(self.pose.forward)
    }

    /// Difference of slopes from a pixel to the next.
    pub fn pixel(&self) -> f64 {
        2.0 * self.half_slopes().1 / f64::from(self.height)
    }

    /// Columns and rows (from, to; to excluded) outside which no ray meets `blob`, `c` off the eye,
    /// out to `reach` σ. May be too large, never too small.
    pub(super) fn rectangle(&self, blob: &Blob, c: DVec3, reach: f64) -> [(u32, u32); 2] {
        let (slope_x, slope_y) = self.half_slopes();
        let [x, y] = [self.pose.right, self.pose.up]
            .map(|side| blob.slopes(c, [side, self.pose.forward], reach));
        let pixels = |(low, high): (f64, f64), slope: f64, n: u32| {
            let at = |s: f64| 0.5 * (s / slope + 1.0) * f64::from(n);
            // One pixel to either side, of which a shift takes up to half, for the rounding of the
            // tangents; `as` saturates, and min keeps it inside.
            let from = ((at(low) - 1.0).floor() as u32).min(n);
            (from, ((at(high) + 1.0).ceil() as u32).clamp(from, n))
        };
        // Rows count downward.
        [pixels(x, slope_x, self.width), pixels((-y.1, -y.0), slope_y, self.height)]
    }
}

/// One pixel while it is composed.
#[derive(Debug, Clone, Copy)]
struct Layered {
    value: [f64; 4],
    bound: [f64; 4],
    /// View depth of what stands behind, and how far that may be off.
    behind: (f64, f64),
}

impl From<&OpaquePixel> for Layered {
    fn from(b: &OpaquePixel) -> Layered {
        Layered { value: b.color, bound: b.bound, behind: (b.depth, b.depth_bound) }
    }
}

impl Layered {
    /// C ← αL + (1−α)C, A ← α + (1−α)A, in true numbers; the target has `off` instead of α and
    /// rounds the result.
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
            // Correct rounding errs by u_t, faithful by 2 u_t, of the number written.
            *e = inherited + 2.0 * r.unit * (v.abs() + inherited).max(r.least_normal);
        }
    }
}

/// The same of a target of equal steps, which cuts source and result to [0, 1]; value and bound. It
/// may blend in its own few bits (Vulkan, "Blending": no less precise than the target): source,
/// factor, product and sum are then each rounded to a step, half a step off where rounding is
/// correct.
fn over_steps(
    [value, bound]: [f64; 2],
    source: f64,
    alpha: f64,
    off: f64,
    r: &Rounding,
) -> [f64; 2] {
    // No difference of source and target as in floats: a source that is cut does not follow α.
    let inherited = (1.0 - alpha) * bound + off * (source.abs() + value.abs() + bound);
    let new = ((alpha * source).clamp(0.0, 1.0) + (1.0 - alpha) * value).clamp(0.0, 1.0);
    let bound =
        inherited + 2.0 * r.step + 2.0 * r.unit * (alpha * source.abs() + value + inherited);
    // Both lie in [0, 1]; what has no bound keeps none.
    [new, if bound.is_finite() { bound.min(1.0) } else { bound }]
}

/// Picture of `blobs` in the order given (far to near), blob j of radiance `radiance[j]`.
pub fn render(view: &View, blobs: &[Blob], radiance: &[DVec3], order: &[u32]) -> Vec<[f64; 4]> {
    render_with_bound(view, blobs, radiance, order, &Rounding::NONE).0
}

/// The picture, and per channel a bound on what a target that rounds as `rounding` says may differ
/// from it.
pub fn render_with_bound(
    view: &View,
    blobs: &[Blob],
    radiance: &[DVec3],
    order: &[u32],
    rounding: &Rounding,
) -> (Vec<[f64; 4]>, Vec<[f64; 4]>) {
    let nothing = vec![OpaquePixel::EMPTY; view.width as usize * view.height as usize];
    render_over(view, &nothing, blobs, radiance, order, rounding)
}

/// The same over `behind`, a pixel each.
pub fn render_over(
    view: &View,
    behind: &[OpaquePixel],
    blobs: &[Blob],
    radiance: &[DVec3],
    order: &[u32],
    rounding: &Rounding,
) -> (Vec<[f64; 4]>, Vec<[f64; 4]>) {
    render_textured(view, behind, blobs, radiance, order, rounding, None)
}

/// Factor on τ of blob j where the ray's slopes from the eye are those of its centre and a
/// difference.
pub type Factor<'a> = &'a (dyn Fn(usize, DVec2) -> f64 + Sync);

/// The same with a factor on each blob's τ.
pub fn render_textured(
    view: &View,
    behind: &[OpaquePixel],
    blobs: &[Blob],
    radiance: &[DVec3],
    order: &[u32],
    rounding: &Rounding,
    factor: Option<Factor<'_>>,
) -> (Vec<[f64; 4]>, Vec<[f64; 4]>) {
    let mut pixels: Vec<Layered> = behind.iter().map(Layered::from).collect();
    let width = view.width as usize;
    let n_rows = view.height.div_ceil(N_THREADS).max(1);
    std::thread::scope(|scope| {
        for (band, i) in pixels.chunks_mut((width * n_rows as usize).max(1)).zip(0u32..) {
            scope.spawn(move || {
                for &j in order {
                    let j = j as usize;
                    let of_blob = |delta: DVec2| factor.map_or(1.0, |f| f(j, delta));
                    draw(
                        view,
                        &blobs[j],
                        radiance[j],
                        &of_blob,
                        (&mut *band, i * n_rows),
                        rounding,
                    );
                }
            });
        }
    });
    pixels.iter().map(|p| (p.value, p.bound)).unzip()
}

/// Bands of rows that are drawn side by side; the result does not depend on it.
const N_THREADS: u32 = 2;

/// Blobs, their radiance, in which order they are drawn (far to near), and the factor on the τ of
/// each.
#[derive(Clone, Copy)]
pub struct Layers<'a> {
    pub blobs: &'a [Blob],
    pub radiance: &'a [DVec3],
    pub order: &'a [u32],
    pub factor: Option<Factor<'a>>,
}

/// Pixels one in each cell of a part of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Raster<'a> {
    /// [column, row] of the part's first pixel.
    pub first: [u32; 2],
    /// Cells in a row of them.
    pub n_columns: u32,
    /// Pixels along a side of a cell.
    pub cell: u32,
    /// [column, row] of the picture, rows of cells from the top.
    pub at: &'a [[u32; 2]],
}

/// The values of [`render_textured`] at the pixels of `raster` alone, over `behind`, one each.
/// `on_row` hears how many rows of cells there are each time that one more is done.
pub fn render_at(
    view: &View,
    raster: &Raster<'_>,
    behind: &[OpaquePixel],
    layers: &Layers<'_>,
    on_row: &(dyn Fn(usize) + Sync),
) -> Vec<[f64; 4]> {
    let met =
        |&j: &u32| Some((j as usize, Met::new(view, &layers.blobs[j as usize], &Rounding::NONE)?));
    let met: Vec<(usize, Met)> = layers.order.iter().filter_map(met).collect();
    let Raster { first: [left, top], cell, at, .. } = *raster;
    let n_columns = raster.n_columns as usize;
    let n_rows = at.len().div_ceil(n_columns.max(1));
    let rows = each(n_rows, |i| {
        let here = i * n_columns..((i + 1) * n_columns).min(at.len());
        let mut pixels: Vec<Layered> = behind[here.clone()].iter().map(Layered::from).collect();
        let (first, end) = (top + i as u32 * cell, top + (i as u32 + 1) * cell);
        for (j, met) in met.iter().filter(|(_, met)| met.rows.0 < end && met.rows.1 > first) {
            let [from, to] =
                [met.columns.0, met.columns.1].map(|column| column.saturating_sub(left));
            let (from, to) = (from / cell, to.div_ceil(cell));
            for (k, pixel) in pixels.iter_mut().enumerate().take(to as usize).skip(from as usize) {
                let [column, row] = at[here.start + k];
                let is_met = (met.columns.0..met.columns.1).contains(&column)
                    && (met.rows.0..met.rows.1).contains(&row);
                if is_met {
                    let of_blob = |delta: DVec2| layers.factor.map_or(1.0, |f| f(*j, delta));
                    met.lay(
                        view,
                        (&layers.blobs[*j], layers.radiance[*j]),
                        &of_blob,
                        ([column, row], pixel),
                        &Rounding::NONE,
                    );
                }
            }
        }
        on_row(n_rows);
        pixels
    });
    rows.into_iter().flatten().map(|p| p.value).collect()
}

/// One blob over the rows from `first_row` that `band` holds. `factor` on its τ, by the difference
/// of slopes.
fn draw(
    view: &View,
    blob: &Blob,
    radiance: DVec3,
    factor: &dyn Fn(DVec2) -> f64,
    (band, first_row): (&mut [Layered], u32),
    r: &Rounding,
) {
    let Some(met) = Met::new(view, blob, r) else { return };
    let n_rows = (band.len() / view.width as usize) as u32;
    for row in met.rows.0.max(first_row)..met.rows.1.min(first_row + n_rows) {
        for column in met.columns.0..met.columns.1 {
            let pixel = &mut band[((row - first_row) * view.width + column) as usize];
            met.lay(view, (blob, radiance), factor, ([column, row], pixel), r);
        }
    }
}

/// A blob as a view meets it.
struct Met {
    /// Off the eye, and along the view.
    c: DVec3,
    depth: f64,
    /// How far it is above the smallest size, and whether rounding decides that.
    above: f64,
    of_size: bool,
    /// Outside of which it is not seen.
    columns: (u32, u32),
    rows: (u32, u32),
}

impl Met {
    /// None where nothing of it is seen.
    fn new(view: &View, blob: &Blob, r: &Rounding) -> Option<Met> {
        let c = blob.position - view.pose.position;
        let depth = c.dot(view.pose.forward);
        if !(depth >= view.near && blob.sigma > 0.0) {
            return None;
        }
        let most = view.cut(blob.deepest());
        let reach = (2.0 * (most + r.slack(most)).max(0.0)).sqrt();
        if reach <= 0.0 {
            return None;
        }
        let (above, off_size) = view.above_smallest(blob, c, r.depth);
        if above < -off_size {
            return None;
        }
        let [columns, rows] = view.rectangle(blob, c, reach);
        Some(Met { c, depth, above, of_size: above.abs() < off_size, columns, rows })
    }

    /// Lays the blob over a pixel.
    fn lay(
        &self,
        view: &View,
        (blob, radiance): (&Blob, DVec3),
        factor: &dyn Fn(DVec2) -> f64,
        ([column, row], pixel): ([u32; 2], &mut Layered),
        r: &Rounding,
    ) {
        let Met { c, depth, above, of_size, .. } = *self;
        let d = view.ray(column, row);
        let line = blob.along(c, d);
        let (cut, delta) = (view.cut(line.depth), view.slopes_of(d) - view.slopes_of(c));
        let slack = r.slack(cut);
        let alpha = alpha(factor(delta) * line.tau());
        let (behind, behind_bound) = pixel.behind;
        // At its edge a sprite ends in a step, and b's rounding decides on which side a pixel lies.
        // The depth of what stands behind decides likewise.
        let beyond = 0.5 * line.off.powi(2) - cut;
        let (on_edge, at_behind) = (beyond.abs() <= slack, (depth - behind).abs() < behind_bound);
        let is_in = beyond <= 0.0 && cut > 0.0;
        if (!is_in && !on_edge) || (depth > behind && !at_behind) {
            return;
        }
        let off =
            if on_edge || at_behind || of_size { (1.0 + r.alpha) * alpha } else { r.alpha * alpha };
        pixel.over(
            if is_in && depth <= behind && above >= 0.0 { alpha } else { 0.0 },
            off,
            radiance,
            r,
        );
    }
}

/// α = 1 − e^{−τ}.
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
    fn what_stands_behind_shows_through_and_hides() {
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
            let (value, bound) =
                render_over(&VIEW, &[behind], &blobs, &colors, &[1, 0], &Rounding::NONE);
            (value[0], bound[0])
        };
        let is = |a: [f64; 4], b: [f64; 4]| (0..4).all(|k| (a[k] - b[k]).abs() < 1e-15);
        assert!(is(over(5.0, 0.0).0, [0.5, 0.25, 0.25, 1.0]));
        assert!(is(over(3.0, 0.0).0, [0.5, 0.0, 0.5, 1.0]));
        assert!(is(over(1.0, 0.0).0, [0.0, 0.0, 1.0, 1.0]));
        // Equal depth is drawn; where that is uncertain, the bound covers both: (0.5, 0.25, 0.25)
        // and (0.5, 0, 0.5).
        assert!(is(over(4.0, 0.0).0, [0.5, 0.25, 0.25, 1.0]) && is(over(4.0, 0.0).1, [0.0; 4]));
        assert!(is(over(4.0, 1e-9).1, [0.0, 0.25, 0.25, 0.0]));
        let (value, bound) = over(4.0 - 1e-10, 1e-9);
        assert!(is(value, [0.5, 0.0, 0.5, 1.0]) && is(bound, [0.0, 0.25, 0.25, 0.0]));
    }
}
