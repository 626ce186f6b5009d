//! Layers of a picture in one EXR file, with the names that other programs look for.

use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec,
    WritableImage,
};

use super::atomic::write_atomic;
use super::image::ImageKind;
use crate::error::{Error, Result};
use crate::model::layers::Layers;

/// The channels of the file, in the order of [`Layers`].
pub const CHANNELS: [&str; 13] = [
    "R",
    "G",
    "B",
    "A",
    "Z",
    "optical_depth.Y",
    "particles.Y",
    "first.R",
    "first.G",
    "first.B",
    "second.R",
    "second.G",
    "second.B",
];

/// Returns the samples of every channel, in the order of [`CHANNELS`].
fn channels_of(layers: &Layers) -> [Vec<f32>; CHANNELS.len()] {
    let of = |pixels: &[f32], n: usize, k: usize| {
        pixels.iter().skip(k).step_by(n).copied().collect::<Vec<f32>>()
    };
    let Layers { beauty, depth, optical_depth, n_particles, first, second, .. } = layers;
    let [r, g, b, a] = [0, 1, 2, 3].map(|k| of(beauty, 4, k));
    let [z, tau, n] = [depth, optical_depth, n_particles].map(Vec::clone);
    let [first_r, first_g, first_b] = [0, 1, 2].map(|k| of(first, 3, k));
    let [second_r, second_g, second_b] = [0, 1, 2].map(|k| of(second, 3, k));
    [r, g, b, a, z, tau, n, first_r, first_g, first_b, second_r, second_g, second_b]
}

/// Fails unless `path` names a file that can hold layers. Callers ask before they render.
///
/// # Errors
/// When the extension is not .exr.
pub fn check_path(path: &Path) -> Result<()> {
    match ImageKind::of(path)? {
        ImageKind::Exr => Ok(()),
        ImageKind::Png => Err(Error::usage(format!(
            "{}: a PNG has no layers; expected a file name that ends in .exr with --layers",
            path.display()
        ))),
    }
}

/// Writes the layers to an EXR file: one part with the channels of [`CHANNELS`], 32-bit floats.
///
/// # Errors
/// When the extension is not .exr, or the file cannot be written.
pub fn write(path: &Path, layers: &Layers) -> Result<()> {
    write_channels(path, layers.size, CHANNELS.into_iter().zip(channels_of(layers)))
}

/// Writes channels, each of a name and of one number a pixel, row 0 at the top, to an EXR file of
/// 32-bit floats.
///
/// # Errors
/// As [`write`].
pub fn write_channels<'a>(
    path: &Path,
    size: [u32; 2],
    channels: impl Iterator<Item = (&'a str, Vec<f32>)>,
) -> Result<()> {
    check_path(path)?;
    let [width, height] = size.map(|n| n as usize);
    let channel =
        |(name, samples): (&str, Vec<f32>)| AnyChannel::new(name, FlatSamples::F32(samples));
    let list: SmallVec<_> = channels.map(channel).collect();
    let attributes =
        LayerAttributes { software_name: Some("nimbus".into()), ..LayerAttributes::default() };
    let channels = AnyChannels::sort(list);
    // Lines, not tiles: every reader knows them.
    let encoding = Encoding::SMALL_LOSSLESS;
    let layer = Layer::new((width, height), attributes, encoding, channels);
    write_atomic(path, |writer| Image::from_layer(layer).write().to_buffered(writer))
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::read_first_flat_layer_from_file;

    fn layers() -> Layers {
        let numbers =
            |n: usize, from: f32| (0..n).map(|i| from + i as f32 * 0.37).collect::<Vec<f32>>();
        Layers {
            size: [3, 2],
            beauty: numbers(24, 1.0),
            depth: [numbers(5, 100.0), vec![f32::INFINITY]].concat(),
            optical_depth: numbers(6, 200.0),
            n_particles: numbers(6, 300.0),
            first: numbers(18, 400.0),
            second: numbers(18, 500.0),
        }
    }

    #[test]
    fn another_reader_finds_every_channel_by_its_name() {
        let dir = tempfile::tempdir().unwrap();
        let (path, layers) = (dir.path().join("a.exr"), layers());
        write(&path, &layers).unwrap();
        let read = read_first_flat_layer_from_file(&path).unwrap().layer_data;
        assert_eq!((read.size.0, read.size.1), (3, 2));
        let names: Vec<String> =
            read.channel_data.list.iter().map(|c| c.name.to_string()).collect();
        let mut sorted = CHANNELS.map(str::to_owned);
        sorted.sort();
        assert_eq!(names, sorted);
        let of = |name: &str| -> Vec<f32> {
            let channel = read.channel_data.list.iter().find(|c| c.name == *name).unwrap();
            channel.sample_data.values_as_f32().collect()
        };
        let every = |pixels: &[f32], n: usize, k: usize| -> Vec<f32> {
            pixels.chunks(n).map(|p| p[k]).collect()
        };
        assert_eq!((of("R"), of("A")), (every(&layers.beauty, 4, 0), every(&layers.beauty, 4, 3)));
        assert_eq!(
            (of("Z"), of("particles.Y")),
            (layers.depth.clone(), layers.n_particles.clone())
        );
        assert_eq!(of("optical_depth.Y"), layers.optical_depth);
        assert_eq!(of("first.G"), every(&layers.first, 3, 1));
        assert_eq!(of("second.B"), every(&layers.second, 3, 2));
        // A reader that knows colours only finds the picture.
        let picture = crate::io::image::read(&path).unwrap();
        let beauty: Vec<f32> = picture.rgba.iter().flatten().map(|v| *v as f32).collect();
        assert_eq!(beauty, layers.beauty);
    }

    #[test]
    fn a_png_is_refused_before_anything_is_written() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        let error = write(&path, &layers()).unwrap_err();
        assert!(error.to_string().contains("ends in .exr"), "{error}");
        assert_eq!(error.exit_code(), 2);
        assert!(!path.exists());
    }
}
