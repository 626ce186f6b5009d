//! Counts of defects of a frame: values that are not finite or at the end of their format's range,
//! particles that were folded back, negative light, and lost sources. A count of zero is reported
//! too.

use serde::{Deserialize, Serialize};

use super::renderer::Renderer;
use crate::error::Result;
use crate::gpu::Device;
use crate::layout::facet::LitRecord;
use crate::model::film::FilmFormat;
use crate::model::scene::{LightingMode, Scene};
use crate::passes::generate::FOLDED;

/// Counts of a frame's values and of their defects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counts {
    /// Numbers of the picture, four a pixel.
    pub values: u64,
    /// Numbers of the picture that are NaN or infinite.
    pub not_finite: u64,
    /// Colors at the end of the format's range (1 of "rgba8", 65504 of "rgba16f"), which may have
    /// been clipped.
    pub saturated: u64,
    /// Particles of boxes.
    pub particles: u64,
    /// Particles that no attempt found a place for, so that they were folded back into their box.
    pub folded: u64,
    /// Lit facets.
    pub facets: u64,
    /// Facets with light that is NaN or infinite.
    pub facets_not_finite: u64,
    /// Facets with negative radiance, from a basis that is cut off.
    pub facets_negative: u64,
    /// Pairs of facets that stayed wider than `lighting.pair_size` asks for.
    pub pairs_unresolved: u64,
    /// Sources that the driver's loops ended before.
    pub sources_lost: u64,
}

/// The least colour that counts as the end of half floats: four steps below the greatest, which
/// rounded sums of layers reach.
const LEAST_HALF_END: f32 = 65504.0 - 4.0 * 32.0;

impl Counts {
    /// Returns the counts of the last frame that `renderer` drew of `scene`.
    ///
    /// # Errors
    /// Fails if a frame is in flight or the device is lost.
    pub fn new(renderer: &mut Renderer, device: &Device, scene: &Scene) -> Result<Counts> {
        let rgba = renderer.image()?;
        let mut counts = Counts::of_picture(&rgba, scene.film.format);
        let status = renderer.status(device)?;
        // Particles of lists have no attempts.
        counts.particles = status.iter().filter(|s| **s & !FOLDED != 0).count() as u64;
        counts.folded = status.iter().filter(|s| **s & FOLDED != 0).count() as u64;
        if scene.lighting.mode != LightingMode::None {
            counts.add_light(&renderer.facets(device)?.1);
        }
        Ok(counts)
    }

    fn of_picture(rgba: &[f32], format: FilmFormat) -> Counts {
        let end = match format {
            FilmFormat::Rgba8 => 1.0,
            FilmFormat::Rgba16f => LEAST_HALF_END,
            FilmFormat::Rgba32f => f32::MAX,
        };
        let count =
            |is_odd: &dyn Fn(f32) -> bool| rgba.iter().filter(|v| is_odd(**v)).count() as u64;
        // Alpha is 1 where a pixel is opaque, which is no defect.
        let colours = rgba.chunks_exact(4).flat_map(|p| &p[..3]);
        Counts {
            values: rgba.len() as u64,
            not_finite: count(&|v| !v.is_finite()),
            saturated: colours.filter(|v| v.is_finite() && v.abs() >= end).count() as u64,
            ..Counts::default()
        }
    }

    fn add_light(&mut self, lit: &[LitRecord]) {
        let any = |l: &LitRecord, is_odd: fn(f32) -> bool| {
            [l.direct, l.indirect, l.first, l.second].iter().flatten().any(|v| is_odd(*v))
        };
        self.facets = lit.len() as u64;
        self.facets_not_finite = lit.iter().filter(|l| any(l, |v| !v.is_finite())).count() as u64;
        self.facets_negative = lit.iter().filter(|l| any(l, |v| v < 0.0)).count() as u64;
        self.pairs_unresolved = lit.iter().map(|l| f64::from(l.n_unresolved)).sum::<f64>() as u64;
        self.sources_lost = lit.iter().map(|l| f64::from(l.n_lost)).sum::<f64>() as u64;
    }

    /// Returns the counts as one line.
    pub fn text(&self) -> String {
        let mut parts = vec![format!(
            "of {} numbers of the picture {} not finite, {} at the format's end",
            self.values, self.not_finite, self.saturated
        )];
        if self.particles > 0 {
            parts.push(format!("of {} particles {} folded back", self.particles, self.folded));
        }
        if self.facets > 0 {
            parts.push(format!(
                "of {} lit facets {} not finite, {} negative; {} pairs unresolved, {} sources lost",
                self.facets,
                self.facets_not_finite,
                self.facets_negative,
                self.pairs_unresolved,
                self.sources_lost
            ));
        }
        parts.join("; ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defects_and_nothing_else_are_counted() {
        let rgba =
            [0.5, 1.0, 0.2, 1.0, f32::NAN, 0.0, 65504.0, 1.0, f32::INFINITY, -70000.0, 1.0, 0.3];
        let of = |format| {
            let c = Counts::of_picture(&rgba, format);
            (c.values, c.not_finite, c.saturated)
        };
        assert_eq!(of(FilmFormat::Rgba8), (12, 2, 4));
        assert_eq!(of(FilmFormat::Rgba16f), (12, 2, 2));
        assert_eq!(of(FilmFormat::Rgba32f), (12, 2, 0));
        let lit = |first: f32, second: f32, n_lost: f32| LitRecord {
            first: [first; 3],
            second: [0.0, second, 0.0],
            n_lost,
            n_unresolved: 2.0,
            ..LitRecord::default()
        };
        let mut counts = Counts::default();
        counts.add_light(&[
            lit(1.0, 0.0, 0.0),
            lit(-0.1, 0.0, 3.0),
            lit(f32::NAN, -1.0, 0.0),
            lit(0.0, f32::INFINITY, 0.0),
        ]);
        assert_eq!((counts.facets, counts.facets_not_finite, counts.facets_negative), (4, 2, 2));
        assert_eq!((counts.pairs_unresolved, counts.sources_lost), (8, 3));
        assert!(
            Counts::default().text().contains("0 not finite, 0 at the format's end"),
            "zero is reported as zero"
        );
    }
}
