//! The volume that sprites stand for, model.md §11 "volume": emission and absorption of overlapping
//! Gaussian blobs along every pixel's ray, in f64, with an error estimate. In: blobs and eye
//! relative to O, a radiance a blob, what stands behind. Out: [C_r, C_g, C_b, A] a pixel, row 0 at
//! the top.

mod piece;
#[cfg(test)]
mod tests;

use glam::DVec3;

use super::Blob;
use super::parallel::parallel_map;
use super::sprites::{OpaquePixel, View};
use piece::{RayBlob, RayIntegral, RayIntegrator};

/// One pixel: premultiplied colour and alpha.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixel {
    pub color: [f64; 4],
    /// What its radiance may be off, greatest channel: an estimate (model.md §11 "volume").
    pub error: f64,
}

/// Optical depth that all blobs together may have where they are taken to have ended: each its
/// share, on either side or wherever its line passes.
const OMITTED: f64 = 1e-12;
/// What this changes of a picture, by its greatest radiance: a blob's share on either side, once as
/// light and once as shadow; and the rounding of sums of erfs, which is of the same order.
const OMITTED_ERROR: f64 = 8.0 * OMITTED;
/// Of the greatest radiance: the error that a pixel's pieces share.
const ACCURACY: f64 = 1e-6;

/// A picture of blobs, row by row.
pub struct Volume<'a> {
    view: View,
    blobs: &'a [Blob],
    radiance: &'a [DVec3],
    /// Of every blob the columns and rows that its rays lie in.
    places: Vec<[(u32, u32); 2]>,
    /// Greatest magnitude of a channel of a blob's radiance.
    brightest: f64,
    omitted: f64,
}

impl<'a> Volume<'a> {
    /// Of the view the cutoff does not count.
    pub fn new(view: &View, blobs: &'a [Blob], radiance: &'a [DVec3]) -> Volume<'a> {
        let omitted = OMITTED / blobs.len().max(1) as f64;
        let place = |blob: &Blob| {
            let reach = reach(blob.deepest(), omitted);
            match reach > 0.0 {
                true => view.rectangle(blob, blob.position - view.pose.position, reach),
                false => [(0, 0); 2],
            }
        };
        let places = blobs.iter().map(place).collect();
        let brightest = radiance.iter().map(|l| l.abs().max_element()).fold(0.0, f64::max);
        Volume { view: *view, blobs, radiance, places, brightest, omitted }
    }

    /// Row `j` before `behind`, a pixel each.
    pub fn row(&self, j: u32, behind: &[OpaquePixel]) -> Vec<Pixel> {
        self.of_row(j, (0..self.view.width).zip(behind.iter().copied()))
    }

    /// Some pixels of row `j`: their columns, and what is behind each.
    pub fn of_row(&self, j: u32, columns: impl Iterator<Item = (u32, OpaquePixel)>) -> Vec<Pixel> {
        let inside = |(from, to): (u32, u32), i: u32| (from..to).contains(&i);
        let of_row: Vec<usize> =
            (0..self.blobs.len()).filter(|&k| inside(self.places[k][1], j)).collect();
        let mut integrator = RayIntegrator::default();
        let pixel = |(i, behind): (u32, OpaquePixel)| {
            let ray = self.view.ray(i, j);
            let near = of_row.iter().filter(|&&k| inside(self.places[k][0], i));
            let passed = near.filter_map(|&k| self.pass(k, ray, behind.depth)).collect();
            self.pixel(&mut integrator, passed, &behind)
        };
        columns.map(pixel).collect()
    }

    /// Blob `k` along `ray` from the near plane to `end`, where it is there at all.
    fn pass(&self, k: usize, ray: DVec3, end: f64) -> Option<RayBlob> {
        let blob = &self.blobs[k];
        let c = blob.position - self.view.pose.position;
        let depth = blob.along(c, ray).tau();
        let white = blob.whiten(ray);
        let (center, width) =
            (blob.whiten(c).dot(white) / white.length_squared(), blob.sigma / white.length());
        let reach = reach(depth, self.omitted) * width;
        let (from, to) = ((center - reach).max(self.view.near), (center + reach).min(end));
        (from < to).then_some(RayBlob {
            center,
            width,
            depth,
            radiance: self.radiance[k],
            from,
            to,
        })
    }

    fn pixel(
        &self,
        integrator: &mut RayIntegrator,
        passed: Vec<RayBlob>,
        behind: &OpaquePixel,
    ) -> Pixel {
        let RayIntegral { color, tau, error } =
            integrator.integrate(&passed, ACCURACY * self.brightest);
        let through = (-tau).exp();
        let [r, g, b, a] = behind.color;
        let shown = color + through * DVec3::new(r, g, b);
        let brightest = behind.color.iter().fold(self.brightest, |most, v| most.max(v.abs()));
        // 1 − T (1 − A_s), without losing a thin cloud's digits.
        let alpha = -libm::expm1(-tau) + through * a;
        Pixel {
            color: [shown.x, shown.y, shown.z, alpha],
            error: error + OMITTED_ERROR * brightest,
        }
    }
}

/// From how many σ on a blob of optical depth `depth` has less than `omitted` left; 0 where it
/// never has more (or is no blob). The tail beyond x is below e^{−x²/2}/2 of the whole.
fn reach(depth: f64, omitted: f64) -> f64 {
    if depth > omitted { (2.0 * (depth / omitted).ln()).sqrt() } else { 0.0 }
}

/// The whole picture before `behind`, a pixel each, and nothing said in between.
pub fn render(
    view: &View,
    behind: &[OpaquePixel],
    blobs: &[Blob],
    radiance: &[DVec3],
) -> Vec<Pixel> {
    let volume = Volume::new(view, blobs, radiance);
    let width = view.width as usize;
    parallel_map(view.height as usize, |j| volume.row(j as u32, &behind[j * width..][..width]))
        .concat()
}
