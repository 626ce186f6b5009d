//! The layers of `nimbus render --layers`.

use super::args::RenderArgs;
use crate::error::{Error, Result};
use crate::io::layers;
use crate::model::layers::Layers;
use crate::reference::picture::{PictureLayers, ReferenceKind, to_f32};

/// Fails if the arguments ask for layers that there are not, before any work.
///
/// # Errors
/// The file is no EXR, or the reference has no layers.
pub fn check(args: &RenderArgs) -> Result<()> {
    if !args.layers {
        return Ok(());
    }
    layers::check_path(&args.output)?;
    if let Some(kind) = args.reference.filter(|kind| *kind != ReferenceKind::Thin) {
        return Err(Error::usage(format!(
            "--layers: the reference \"{kind}\" is no picture of layers; expected --reference thin"
        )));
    }
    if args.samples.is_some_and(|n| n > 1) {
        return Err(Error::usage(
            "--layers: depths and numbers have no mean over a pixel; expected --samples 1",
        ));
    }
    Ok(())
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
