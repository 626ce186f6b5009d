//! The layers of `nimbus render --layers`.

use super::args::RenderArgs;
use crate::error::{Error, Result};
use crate::io::layers;
use crate::model::layers::Layers;
use crate::reference::picture::{PictureLayers, ReferenceKind, TransportLayers, to_f32};
use crate::reference::transport::N_LAYERS;

/// Fails if the arguments ask for layers that there are not, before any work.
///
/// # Errors
/// The file is no EXR, or the reference has no layers.
pub fn check(args: &RenderArgs) -> Result<()> {
    if !args.layers {
        return Ok(());
    }
    layers::check_path(&args.output)?;
    match args.reference {
        Some(ReferenceKind::Transport) => return Ok(()),
        None | Some(ReferenceKind::Thin) => (),
        Some(kind) => {
            return Err(Error::usage(format!(
                "--layers: the reference \"{kind}\" is no picture of layers; expected --reference \
                 thin or transport"
            )));
        }
    }
    if args.samples.is_some_and(|n| n > 1) {
        return Err(Error::usage(
            "--layers: depths and numbers have no mean over a pixel; expected --samples 1",
        ));
    }
    Ok(())
}

/// Channels of the layers of "transport": the picture, its light by how often it was scattered and
/// what it came from, and the standard error.
pub const TRANSPORT_CHANNELS: [&str; 4 + 3 * N_LAYERS + 3] = [
    "R",
    "G",
    "B",
    "A",
    "once_sun.R",
    "once_sun.G",
    "once_sun.B",
    "once_sky.R",
    "once_sky.G",
    "once_sky.B",
    "twice_sun.R",
    "twice_sun.G",
    "twice_sun.B",
    "twice_sky.R",
    "twice_sky.G",
    "twice_sky.B",
    "more_sun.R",
    "more_sun.G",
    "more_sun.B",
    "more_sky.R",
    "more_sky.G",
    "more_sky.B",
    "error.R",
    "error.G",
    "error.B",
];

/// Returns the samples of every channel, in the order of [`TRANSPORT_CHANNELS`].
pub fn of_transport(drawn: &TransportLayers) -> Vec<Vec<f32>> {
    let TransportLayers { rgba, layers, error } = drawn;
    let beauty = (0..4).map(|k| rgba.iter().map(|v| v[k] as f32).collect());
    let of_layer = |i: usize| (0..3).map(move |k| (i, k));
    let layers = (0..N_LAYERS)
        .flat_map(of_layer)
        .map(|(i, k)| layers.iter().map(|l| l[i][k] as f32).collect());
    let error = (0..3).map(|k| error.iter().map(|e| e[k] as f32).collect());
    beauty.chain(layers).chain(error).collect()
}

/// Returns the layers of a reference as a file has them.
pub fn of_reference(size: [u32; 2], layers: &PictureLayers) -> Layers {
    let rgb = |pixels: &[[f64; 4]]| -> Vec<f32> {
        pixels.iter().flat_map(|p| [p[0] as f32, p[1] as f32, p[2] as f32]).collect()
    };
    let sums = &layers.sums;
    Layers {
        size,
        beauty: to_f32(&layers.beauty),
        depth: sums.iter().map(|s| s.depth as f32).collect(),
        optical_depth: sums.iter().map(|s| s.optical_depth.value as f32).collect(),
        n_particles: sums.iter().map(|s| s.n.value as f32).collect(),
        first: rgb(&layers.first),
        second: rgb(&layers.second),
    }
}
