//! Layers of a picture by radiative transfer: its light by order of scattering and by source.

use glam::DVec3;

use super::frame::FrameReference;
use super::kind::ReferenceKind;
use super::limits::check_sums;
use super::pixels::Pixels;
use super::sample_sums::SampleSums;
use super::samples::{Grown, shift};
use super::scene_light::PixelSample;
use super::transport::TransportPicture;
use crate::error::Result;
use crate::model::parallel::parallel_map;
use crate::model::scene::Scene;
use crate::reference::transport::N_LAYERS;

/// Numbers of a pixel in the sums of layers: R, G, B, A; the layers' RGB; the squares of R, G, B.
pub const N_LAYER_VALUES: usize = 4 + 3 * N_LAYERS + 3;

/// A picture by how often its light was scattered, and by what shone.
#[derive(Debug, Clone, PartialEq)]
pub struct TransportLayers {
    /// Premultiplied linear RGBA, row 0 at the top: the same as without layers.
    pub rgba: Vec<[f64; 4]>,
    /// Radiance of each layer: scattered once by suns and lamps, once by the sky, twice, more.
    pub layers: Vec<[DVec3; N_LAYERS]>,
    /// Standard error of R, G and B; 0 of a single sample.
    pub error: Vec<DVec3>,
}

/// Draws `scene` by `n_samples` random paths a pixel, with its layers. The paths add to the sums in
/// `grown`, whose pixels have [`N_LAYER_VALUES`] numbers.
///
/// # Errors
/// As [`super::sums`] of "transport", or there are no samples.
pub fn transport_layers(
    scene: &Scene,
    time_s: f64,
    n_samples: u32,
    grown: &Grown<'_>,
) -> Result<TransportLayers> {
    ReferenceKind::Transport.check(scene, time_s)?;
    let n_pixels = u64::from(scene.film.width) * u64::from(scene.film.height);
    check_sums(n_pixels, n_samples, scene.n_particles(), 8 * N_LAYER_VALUES as u64)?;
    let picture = TransportPicture::new(scene, &FrameReference::unlit(scene, time_s)?);
    let pixels = Pixels::all(scene.film.width, scene.film.height);
    let sums = grown.grow(
        0..n_samples,
        |_| false,
        |i| {
            let values = parallel_map(pixels.at.len(), |k| {
                let number = pixels.number(k) as u32;
                let light = picture.path(pixels.at[k], number, PixelSample { i, shift: shift(i) });
                let all = light.radiance();
                let mut values = [0.0; N_LAYER_VALUES];
                values[..4].copy_from_slice(&all.extend(light.alpha).to_array());
                for (place, layer) in values[4..].chunks_exact_mut(3).zip(light.layers) {
                    place.copy_from_slice(&layer.to_array());
                }
                values[N_LAYER_VALUES - 3..].copy_from_slice(&(all * all).to_array());
                values
            });
            SampleSums { n_samples: 1, values: values.concat() }
        },
    )?;
    let n = f64::from(n_samples);
    let pixels = || sums.values.chunks_exact(N_LAYER_VALUES);
    let rgb = |v: &[f64]| DVec3::new(v[0], v[1], v[2]) / n;
    let layers = |v: &[f64]| std::array::from_fn(|k| rgb(&v[4 + 3 * k..]));
    let error = |v: &[f64]| {
        let variance = rgb(&v[N_LAYER_VALUES - 3..]) - rgb(v) * rgb(v);
        (variance.max(DVec3::ZERO) / (n - 1.0).max(1.0)).map(f64::sqrt)
    };
    Ok(TransportLayers {
        rgba: pixels().map(|v| [v[0] / n, v[1] / n, v[2] / n, v[3] / n]).collect(),
        layers: pixels().map(layers).collect(),
        error: pixels().map(error).collect(),
    })
}
