//! Drawing, model.md §9 and §11 "sprites": thin blobs composed far to near with premultiplied "over", in f64;
//! beside it a bound on what a target of few bits may differ.
//! In: blobs and eye relative to O, an order. Out: [width × height] of [C_r, C_g, C_b, A], row 0 at the top.

use glam::DVec3;

use super::Blob;
use crate::model::camera::Pose;
use crate::model::cloud::SQRT_TAU;
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
}

/// How a GPU may depart from the mathematics while drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// u_t: unit round-off of the target's channels.
    pub unit: f64,
    /// Least normal number of the target: below it the error no longer shrinks with the value.
    pub least_normal: f64,
    /// Relative error of each α.
    pub alpha: f64,
    /// Relative error of b: where |b − cut| is below it times the cut, a sprite may end or not.
    pub edge: f64,
}

impl Rounding {
    pub fn of(format: FilmFormat, alpha: f64, edge: f64) -> Rounding {
        let least_normal = match format {
            FilmFormat::Rgba16f => 2f64.powi(-14),
            FilmFormat::Rgba32f => 2f64.powi(-126),
        };
        Rounding { unit: format.unit_roundoff(), least_normal, alpha, edge }
    }

    const NONE: Rounding = Rounding { unit: 0.0, least_normal: 0.0, alpha: 0.0, edge: 0.0 };
}

impl View {
    fn half_slopes(&self) -> (f64, f64) {
        let tan = (0.5 * self.fov_y_rad).tan();
        (tan * f64::from(self.width) / f64::from(self.height), tan)
    }

    /// Direction through the centre of pixel (column `i`, row `j` from the top); its view depth is 1.
    pub fn ray(&self, i: u32, j: u32) -> DVec3 {
        let (slope_x, slope_y) = self.half_slopes();
        let x = 2.0 * (f64::from(i) + 0.5) / f64::from(self.width) - 1.0;
        let y = 1.0 - 2.0 * (f64::from(j) + 0.5) / f64::from(self.height);
        self.pose.forward + x * slope_x * self.pose.right + y * slope_y * self.pose.up
    }

    /// Columns and rows (from, to; to excluded) outside which no ray comes within `reach` of offset `c` from the
    /// eye. May be too large, never too small.
    fn rectangle(&self, c: DVec3, reach: f64) -> [(u32, u32); 2] {
        let depth = c.dot(self.pose.forward);
        let (slope_x, slope_y) = self.half_slopes();
        let x = slopes(c.dot(self.pose.right), depth, reach);
        let y = slopes(c.dot(self.pose.up), depth, reach);
        let pixels = |(low, high): (f64, f64), slope: f64, n: u32| {
            let at = |s: f64| 0.5 * (s / slope + 1.0) * f64::from(n);
            // One pixel to either side for the rounding of the tangents; `as` saturates, and min keeps it inside.
            let from = ((at(low) - 1.0).floor() as u32).min(n);
            (from, ((at(high) + 1.0).ceil() as u32).clamp(from, n))
        };
        // Rows count downward.
        [pixels(x, slope_x, self.width), pixels((-y.1, -y.0), slope_y, self.height)]
    }
}

/// Slopes between which lines through the eye can touch a disc of radius `reach` at (`side`, `depth`).
fn slopes(side: f64, depth: f64, reach: f64) -> (f64, f64) {
    const ALL: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
    let sine = reach / side.hypot(depth);
    if sine.is_nan() || sine >= 1.0 {
        return ALL;
    }
    let (mid, spread) = (side.atan2(depth), sine.asin());
    // A disc that reaches beside or behind the eye is touched by lines of either sign.
    if mid.abs() + spread >= std::f64::consts::FRAC_PI_2 {
        return ALL;
    }
    ((mid - spread).tan(), (mid + spread).tan())
}

/// One pixel while it is composed.
#[derive(Debug, Clone, Copy, Default)]
struct Layered {
    value: [f64; 4],
    bound: [f64; 4],
}

impl Layered {
    /// C ← αL + (1−α)C, A ← α + (1−α)A, in true numbers; the target has `off` instead of α and rounds the result.
    fn over(&mut self, alpha: f64, off: f64, radiance: DVec3, r: &Rounding) {
        let source = [radiance.x, radiance.y, radiance.z, 1.0];
        for ((v, e), s) in self.value.iter_mut().zip(&mut self.bound).zip(source) {
            // C' − C'_t = (1 − α)(C − C_t) + (α − α_t)(L − C_t), |C_t − C| ≤ e.
            let inherited = (1.0 - alpha) * *e + off * ((s - *v).abs() + *e);
            *v = alpha * s + (1.0 - alpha) * *v;
            // Correct rounding errs by u_t, faithful by 2 u_t, of the number written.
            *e = inherited + 2.0 * r.unit * (v.abs() + inherited).max(r.least_normal);
        }
    }
}

/// Picture of `blobs` in the order given (far to near), blob j of radiance `radiance[j]`.
pub fn render(view: &View, blobs: &[Blob], radiance: &[DVec3], order: &[u32]) -> Vec<[f64; 4]> {
    compose(view, blobs, radiance, order, &Rounding::NONE).iter().map(|p| p.value).collect()
}

/// The picture, and per channel a bound on what a target that rounds as `rounding` says may differ from it.
pub fn render_with_bound(
    view: &View,
    blobs: &[Blob],
    radiance: &[DVec3],
    order: &[u32],
    rounding: &Rounding,
) -> (Vec<[f64; 4]>, Vec<[f64; 4]>) {
    compose(view, blobs, radiance, order, rounding).iter().map(|p| (p.value, p.bound)).unzip()
}

fn compose(view: &View, blobs: &[Blob], radiance: &[DVec3], order: &[u32], rounding: &Rounding) -> Vec<Layered> {
    let width = view.width as usize;
    let mut pixels = vec![Layered::default(); width * view.height as usize];
    let n_rows = view.height.div_ceil(N_THREADS).max(1);
    std::thread::scope(|scope| {
        for (band, i) in pixels.chunks_mut((width * n_rows as usize).max(1)).zip(0u32..) {
            scope.spawn(move || {
                for &j in order {
                    let j = j as usize;
                    draw(view, &blobs[j], radiance[j], band, i * n_rows, rounding);
                }
            });
        }
    });
    pixels
}

/// Bands of rows that are drawn side by side; the result does not depend on it.
const N_THREADS: u32 = 2;

/// One blob over the rows from `first_row` that `band` holds.
fn draw(view: &View, blob: &Blob, radiance: DVec3, band: &mut [Layered], first_row: u32, r: &Rounding) {
    let c = blob.position - view.pose.position;
    if !(c.dot(view.pose.forward) >= view.near && blob.sigma > 0.0) {
        return;
    }
    let cut = view.cutoff * blob.sigma;
    let n_rows = (band.len() / view.width as usize) as u32;
    let [columns, rows] = view.rectangle(c, cut * (1.0 + r.edge));
    for row in rows.0.max(first_row)..rows.1.min(first_row + n_rows) {
        for column in columns.0..columns.1 {
            let pixel = &mut band[((row - first_row) * view.width + column) as usize];
            let d = view.ray(column, row);
            let b = c.cross(d).length() / d.length();
            let alpha = alpha(blob, b);
            // At its edge a sprite ends in a step, and b's rounding decides on which side a pixel lies.
            let on_edge = (b - cut).abs() <= r.edge * cut;
            if b <= cut {
                pixel.over(alpha, if on_edge { alpha } else { r.alpha * alpha }, radiance, r);
            } else if on_edge {
                pixel.over(0.0, alpha, radiance, r);
            }
        }
    }
}

/// α = 1 − e^{−τ}, τ = √(2π) κ σ exp(−b²/2σ²), of a ray that passes a blob's centre at distance `b`.
pub fn alpha(blob: &Blob, b: f64) -> f64 {
    let x = b / blob.sigma;
    -libm::expm1(-SQRT_TAU * blob.kappa * blob.sigma * (-0.5 * x * x).exp())
}
