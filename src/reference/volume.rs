//! The volume that sprites approximate, passes.md "volume": emission and absorption of
//! overlapping Gaussian blobs along every pixel's ray, in f64, with an error estimate.
//!
//! In: blobs and eye relative to O, a radiance a blob, the background. Out: [C_r, C_g, C_b, A] a
//! pixel, row 0 at the top.

mod piece;
#[cfg(test)]
mod tests;

use glam::DVec3;

use super::Blob;
use super::composite::{OpaquePixel, Rounding};
use super::shade::{SeenLight, SeenShade};
use super::view::View;
use crate::model::shade::Shade;
use piece::{RayBlob, RayIntegral, RayIntegrator};

/// A pixel of the volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixel {
    /// Premultiplied colour and alpha.
    pub color: [f64; 4],
    /// Estimated error of the radiance, greatest channel (passes.md "volume").
    pub error: f64,
}

/// Optical depth of all blobs together that is omitted beyond their ends. Each blob has its share
/// on either side, or where its line passes.
const OMITTED: f64 = 1e-12;
/// Effect of the omission, as a share of the greatest radiance: a blob's share on either side, once
/// as light and once as shadow, and the rounding of sums of erfs, which is of the same order.
const OMITTED_ERROR: f64 = 8.0 * OMITTED;
/// Error that a pixel's pieces share, relative to the greatest radiance.
const ACCURACY: f64 = 1e-6;

/// Blobs with their radiance, integrated row by row.
pub struct Volume<'a> {
    view: View,
    blobs: &'a [Blob],
    radiance: &'a [DVec3],
    /// Light inside of each blob; `None` where it is the same throughout.
    shades: Option<&'a [Shade]>,
    /// Columns and rows of every blob's rays.
    places: Vec<[(u32, u32); 2]>,
    /// Greatest magnitude of a channel of a blob's radiance.
    brightest: f64,
    omitted: f64,
}

impl<'a> Volume<'a> {
    /// Prepares the blobs for a view, whose cutoff is ignored.
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
        Volume { view: *view, blobs, radiance, shades: None, places, brightest, omitted }
    }

    /// Returns the volume with light inside of each blob.
    pub fn shaded(self, shades: Option<&'a [Shade]>) -> Volume<'a> {
        Volume { shades, ..self }
    }

    /// Integrates some pixels of row `j`, given by column and background.
    pub fn row(&self, j: u32, columns: impl Iterator<Item = (u32, OpaquePixel)>) -> Vec<Pixel> {
        let inside = |(from, to): (u32, u32), i: u32| (from..to).contains(&i);
        let in_row: Vec<usize> =
            (0..self.blobs.len()).filter(|&k| inside(self.places[k][1], j)).collect();
        let mut integrator = RayIntegrator::default();
        let pixel = |(i, behind): (u32, OpaquePixel)| {
            let ray = self.view.ray(i, j);
            let near = in_row.iter().filter(|&&k| inside(self.places[k][0], i));
            let passed = near.filter_map(|&k| self.pass(k, ray, behind.depth)).collect();
            self.pixel(&mut integrator, passed, &behind)
        };
        columns.map(pixel).collect()
    }

    /// Returns blob `k` along `ray` from the near plane to `end`; `None` if it is not there.
    fn pass(&self, k: usize, ray: DVec3, end: f64) -> Option<RayBlob> {
        let blob = &self.blobs[k];
        let c = blob.position - self.view.pose.position;
        let depth = blob.along(c, ray).tau();
        let white = blob.whiten(ray);
        let (center, width) =
            (blob.whiten(c).dot(white) / white.length_squared(), blob.sigma / white.length());
        let reach = reach(depth, self.omitted) * width;
        let (from, to) = ((center - reach).max(self.view.near), (center + reach).min(end));
        let light = self.shades.map_or(SeenLight::PLAIN, |shades| {
            let delta = self.view.slopes_of(ray) - self.view.slopes_of(c);
            SeenShade::new(&self.view, blob, c, &shades[k]).toward(delta, &Rounding::NONE)
        });
        let radiance = self.radiance[k];
        (from < to).then_some(RayBlob { center, width, depth, radiance, light, from, to })
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
        // 1 − T (1 − A_s), accurate for thin clouds.
        let alpha = -libm::expm1(-tau) + through * a;
        Pixel {
            color: [shown.x, shown.y, shown.z, alpha],
            error: error + OMITTED_ERROR * brightest,
        }
    }
}

/// Returns the number of σ beyond which a blob of optical depth `depth` has less than `omitted`
/// left; 0 if it never has more. The tail beyond x is below e^{−x²/2}/2 of the whole.
fn reach(depth: f64, omitted: f64) -> f64 {
    if depth > omitted { (2.0 * (depth / omitted).ln()).sqrt() } else { 0.0 }
}
