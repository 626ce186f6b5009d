//! The bound on a picture that `tiles` draws: composed near to far in f32, rounded to the target once.

use nimbus::model::film::FilmFormat;
use nimbus::reference::sprites::{Behind, Rounding, alpha};
use nimbus::reference::tiles;

use crate::bounded::{Bounded, U};
use crate::picture::Picture;

/// What `opacity` promises, both forms.
const OPACITY: f64 = 1e-6;

impl Picture {
    /// The truth, and the bound on what `tiles` may make of it.
    pub fn tiled_truth(&self, format: FilmFormat, saturated: f64) -> (Vec<f64>, Vec<f64>) {
        let (off_alpha, edge) = self.tiled_rounding();
        let rounding = Rounding::of(format, off_alpha, edge);
        let (blobs, radiance, order) = (self.blobs(), self.radiance(), self.order());
        let behind: Vec<Behind> = match &self.scenery {
            None => vec![Behind::NOTHING; self.view.width as usize * self.view.height as usize],
            Some(_) => self.behind(format).iter().map(|c| self.widened(c)).collect(),
        };
        let (value, bound) = tiles::render_over(&self.view, &behind, &blobs, &radiance, &order, (&rounding, saturated));
        (value.concat(), bound.concat())
    }

    /// Relative error of an opacity, and of a sprite's edge: the worst of all pixels in all blobs, each by a running bound.
    fn tiled_rounding(&self) -> (f64, f64) {
        let (mut off_alpha, mut edge) = (OPACITY, 8.0 * U);
        for (blob, placed) in self.blobs().iter().zip(&self.placed) {
            let c = blob.position - self.view.pose.position;
            if !(c.dot(self.view.pose.forward) >= self.view.near && blob.sigma > 0.0 && blob.kappa > 0.0) {
                continue;
            }
            let sprite = self.sprite(placed, blob);
            // log2 e is one more factor.
            let scale = sprite.z.times(Bounded::once(std::f64::consts::LOG2_E));
            let cut = self.view.cutoff * blob.sigma;
            for (j, i) in (0..self.view.height).flat_map(|j| (0..self.view.width).map(move |i| (j, i))) {
                let d = self.view.ray(i, j);
                let b = c.cross(d).length() / d.length();
                if b > 1.1 * cut {
                    continue;
                }
                let e = exponent(&sprite.s, scale, self.ray(i, j));
                if b > 0.9 * cut {
                    edge = edge.max(0.51 * e.error / e.value + 4.0 * U);
                }
                let true_alpha = alpha(blob, b);
                let t = sprite.tau.times(e.scaled(-1.0).exp2());
                let off = (-(t.value - t.error)).exp() * t.error + OPACITY * true_alpha;
                off_alpha = off_alpha.max(off / true_alpha);
            }
        }
        (off_alpha, edge)
    }
}

/// b^2/(2 sigma^2) in powers of two, as the compose kernel evaluates it.
fn exponent(s: &[Bounded; 2], scale: Bounded, ray: [Bounded; 2]) -> Bounded {
    let one = Bounded::exact(1.0);
    let [dx, dy] = [ray[0].minus(s[0]), ray[1].minus(s[1])];
    let a = scale.times(one.plus(s[1].squared()));
    let b = scale.scaled(-2.0).times(s[0]).times(s[1]).times(dy);
    let c = scale.times(one.plus(s[0].squared())).times(dy).times(dy);
    let norm = one.plus(ray[0].squared()).plus(ray[1].squared());
    a.times(dx).plus(b).times(dx).plus(c).times(one.over(norm))
}
