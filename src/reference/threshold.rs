//! Layers that a threshold and a smallest size omit from a picture, passes.md "edges" and
//! "cull", in f64. In: blobs and eye relative to O. Out: number and optical depth of the omitted
//! layers of every pixel.

use super::Blob;
use super::composite::OpaquePixel;
use super::sprites::Factor;
use super::view::View;
use crate::model::edge::Edge;

/// Omitted layers of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Omitted {
    /// Number of sprites that would be drawn without threshold and smallest size.
    pub n_layers: u32,
    /// Their optical depth together.
    pub tau: f64,
}

impl Omitted {
    /// Returns the greatest change of a channel, as a share of the greatest difference between two
    /// radiances there.
    pub fn share(&self) -> f64 {
        -libm::expm1(-self.tau)
    }

    /// Returns the greater number of layers and the greater optical depth of two pixels.
    pub fn most(self, other: Omitted) -> Omitted {
        Omitted { n_layers: self.n_layers.max(other.n_layers), tau: self.tau.max(other.tau) }
    }
}

/// Returns the omitted layers of every pixel before `behind`, with `factor` on each blob's τ as its
/// texture has it.
pub fn omitted(
    view: &View,
    behind: &[OpaquePixel],
    blobs: &[Blob],
    factor: Option<Factor<'_>>,
) -> Vec<Omitted> {
    let mut pixels = vec![Omitted::default(); behind.len()];
    let whole = View { edge: Edge { tau: 0.0, ..view.edge }, smallest: 0.0, ..*view };
    for (k, blob) in blobs.iter().enumerate() {
        let c = blob.position - view.pose.position;
        let depth = c.dot(view.pose.forward);
        if !(depth >= view.near && blob.sigma > 0.0 && blob.kappa > 0.0) {
            continue;
        }
        let is_large = view.above_smallest(blob, c, 0.0).0 >= 0.0;
        let to = whole.edge.cut(blob.deepest());
        let [columns, rows] = view.rectangle(blob, c, (2.0 * to).sqrt());
        for row in rows.0..rows.1 {
            for column in columns.0..columns.1 {
                let i = (row * view.width + column) as usize;
                let ray = view.ray(column, row);
                let line = blob.along(c, ray);
                let e = 0.5 * line.off.powi(2);
                // Blobs that are too small are omitted entirely.
                let from = if is_large { view.edge.cut(line.depth) } else { 0.0 };
                if (e > from || from <= 0.0) && e <= to && depth <= behind[i].depth {
                    let delta = view.slopes_of(ray) - view.slopes_of(c);
                    let factor = factor.map_or(1.0, |f| f(k, delta));
                    pixels[i].n_layers += 1;
                    pixels[i].tau += factor * line.tau();
                }
            }
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::camera::Pose;
    use crate::model::cloud::{SQRT_TAU, Shape};
    use glam::{DVec2, DVec3};

    #[test]
    fn layers_between_threshold_and_cutoff_are_counted() {
        let pose =
            Pose { position: DVec3::ZERO, right: DVec3::X, up: DVec3::Y, forward: DVec3::NEG_Z };
        // Three pixels at slopes −1, 0 and 1.
        let (fov_y_rad, smallest) = (2.0 * 0.5f64.atan(), 0.0);
        let shift = DVec2::ZERO;
        let view = View {
            width: 3,
            height: 1,
            pose,
            fov_y_rad,
            near: 0.5,
            edge: Edge { tau: 0.1, ..Edge::at(3.0) },
            smallest,
            slice: 0.0,
            n_parts: 4,
            shift,
        };
        // From a centre at depth 2 the outer rays pass at b = √2: b²/2σ² = 1 at σ = 1.
        let blob = |tau: f64| Blob {
            shape: Shape::BALL,
            position: DVec3::NEG_Z * 2.0,
            sigma: 1.0,
            kappa: tau / SQRT_TAU,
        };
        let of = |blobs: &[Blob], depth: f64| {
            omitted(&view, &[OpaquePixel { depth, ..OpaquePixel::EMPTY }; 3], blobs, None)
        };
        let nothing = Omitted::default();
        // τ = 0.2/e there: below the threshold. 0.3/e: not. 0.09: nowhere above it.
        let [left, middle, right] = of(&[blob(0.2), blob(0.3), blob(0.09)], 9.0)[..] else {
            panic!("three pixels")
        };
        assert_eq!((left.n_layers, middle.n_layers, right.n_layers), (2, 1, 2));
        assert!(
            (left.tau - 0.29 / std::f64::consts::E).abs() < 1e-15
                && left == right
                && (middle.tau - 0.09).abs() < 1e-15
        );
        assert!((left.share() - (1.0 - (-left.tau).exp())).abs() < 1e-15);
        assert!(left.share() < -libm::expm1(-2.0 * 0.1) && left.most(nothing) == left);
        assert_eq!(of(&[blob(0.2)], 1.9), [nothing; 3], "hidden");
        // Pixels are one slope wide, σ = 1 at depth 2 half of one.
        let of = |smallest: f64| {
            let view = View { edge: Edge { tau: 0.0, ..view.edge }, smallest, ..view };
            omitted(&view, &[OpaquePixel::EMPTY; 3], &[blob(0.2)], None)
                .iter()
                .map(|c| c.n_layers)
                .sum::<u32>()
        };
        assert_eq!([of(0.0), of(0.499), of(0.501)], [0, 0, 3]);
    }
}
