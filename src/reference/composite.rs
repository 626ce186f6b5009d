//! Composition of a layer over a pixel, model.md §9: premultiplied "over" on a target that rounds,
//! with a bound on the difference.

use super::shine::Shine;
use crate::model::film::FilmFormat;

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
    /// Relative error of each τ.
    pub tau: f64,
    /// Difference of depths within which two blobs may come in either order.
    pub order: f64,
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
        Rounding { unit, least_normal, step, alpha, tau: alpha, order: 0.0, edge, depth: 0.0 }
    }

    /// Returns the distance from the cut beyond which rounding cannot move b²/2σ² across it.
    pub(super) fn slack(&self, cut: f64) -> f64 {
        (2.0 + self.edge) * self.edge * cut.max(1.0)
    }

    /// Exact arithmetic.
    pub const NONE: Rounding = Rounding {
        unit: 0.0,
        least_normal: 0.0,
        step: 0.0,
        alpha: 0.0,
        tau: 0.0,
        order: 0.0,
        edge: 0.0,
        depth: 0.0,
    };

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

/// A pixel while it is composed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layered {
    /// [C_r, C_g, C_b, A].
    pub value: [f64; 4],
    /// By how much a device's value may differ.
    pub bound: [f64; 4],
}

impl From<&OpaquePixel> for Layered {
    fn from(b: &OpaquePixel) -> Layered {
        Layered { value: b.color, bound: b.bound }
    }
}

impl Layered {
    /// Composes C ← αL + (1−α)C, A ← α + (1−α)A. The target's α is within `off`, and it rounds the
    /// result. It may blend in its own few bits (Vulkan, "Blending": no less precise than the
    /// target): source, factor and product are then rounded, too.
    pub fn over(&mut self, alpha: f64, off: f64, shine: Shine, r: &Rounding) {
        let (source, off_source) = (shine.radiance.extend(1.0), shine.off.extend(0.0));
        let sources = source.to_array().into_iter().zip(off_source.to_array());
        for ((v, e), (s, off_s)) in self.value.iter_mut().zip(&mut self.bound).zip(sources) {
            *e += (alpha + off) * off_s;
            if r.step > 0.0 {
                [*v, *e] = over_steps([*v, *e], s, alpha, off, r);
                continue;
            }
            // C' − C'_t = (1 − α)(C − C_t) + (α − α_t)(L − C_t), |C_t − C| ≤ e.
            let inherited = (1.0 - alpha) * *e + off * ((s - *v).abs() + *e);
            let (source, passed) = (alpha * s, (1.0 - alpha) * *v);
            // α L; α and 1 − α as factors of C, whose errors are u_t C together; (1 − α) C.
            let parts = r.unit * (source.abs() + v.abs() + passed.abs() + *e);
            *v = source + passed;
            // Correct rounding errs by u_t of the number written, faithful rounding by 2 u_t.
            *e = inherited + parts + 2.0 * r.unit * (v.abs() + inherited).max(r.least_normal);
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
