//! impostors: shows distant blobs from a picture of them that was drawn once.
//!
//! In: sorted entries; an impostor layer (a picture, four floats a texel) and how pixels map to it.
//! Out: the entries of far and near blobs; the layer under the near blobs, premultiplied linear
//! RGBA in the film's format. Law: a homography through the plane of one depth, Catmull and Rom's
//! cubic. Source: Harris & Lastra 2001, passes.md. Error: positions to 1e-6 of the
//! picture's extent, and the target's rounding; `model::impostor` predicts the error against the
//! true view.

use glam::{DMat3, DVec2, DVec3};

use crate::error::Result;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, InstanceCount, Kernel, LoadOp, Recorder,
    Target, TargetFormat,
};
use crate::layout::record;

record! {
    /// Push constants of `impostors_part.comp`.
    pub struct PartPush {
        /// The camera's forward axis.
        forward: [f32; 3],
        /// Least depth of a far particle, relative to the lighting origin.
        cut: f32,
        /// Number of entries.
        n_entries: u32,
        /// 1: entries are parted by their depths; 0: by the last decision.
        is_new: u32,
        /// Padding.
        unused: [u32; 2],
    }
}

record! {
    /// Push constants of `impostors.vert` and `impostors.frag`.
    pub struct Push {
        /// First row of the homography: columns of the layer.
        column: [f32; 3],
        /// near/z of the layer.
        depth: f32,
        /// Second row of the homography: rows of the layer.
        row: [f32; 3],
        /// Columns of the layer.
        width: u32,
        /// Third row of the homography, the divisor.
        under: [f32; 3],
        /// Rows of the layer.
        height: u32,
        /// Middle of the picture, in pixels.
        middle: [f32; 2],
        /// Least clip coordinates of the layer.
        low: [f32; 2],
        /// Greatest clip coordinates of the layer.
        high: [f32; 2],
    }
}

/// The pipelines of the pass.
pub struct Impostors {
    part: Kernel,
    show: DrawPipeline,
}

/// How an impostor layer appears in the current view.
#[derive(Debug, Clone, Copy)]
pub struct LayerView {
    /// Maps slopes of the view to slopes of the layer's picture.
    pub to_layer: DMat3,
    /// Greatest slopes of the view.
    pub view_tangents: DVec2,
    /// Greatest slopes of the layer's picture.
    pub layer_tangents: DVec2,
    /// Texels of the layer.
    pub size: [u32; 2],
    /// Least and greatest slopes of the view at which the layer shows anything; the caller rounds
    /// them outward.
    pub bounds: [DVec2; 2],
    /// near/z of the whole layer; nearer surfaces hide it.
    pub depth: f32,
}

bindings! {
    /// The buffers that entries are parted by.
    pub struct PartBuffers {
        /// `[u32; 2]`: sort key and particle, far to near.
        entries,
        /// Input and output, `u32` by particle: whether it belongs to the layer.
        members,
        /// Output, `[u32; 2]`: entries of the layer.
        far,
        /// Output, `[u32; 2]`: the other entries.
        near,
        /// `PlacedRecord` by particle.
        placed,
    }
}

impl Impostors {
    /// Creates the pipelines; `over_solids` if surfaces have been drawn into the target before.
    ///
    /// # Errors
    /// Fails if a shader does not compile or a pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        over_solids: bool,
    ) -> Result<Impostors> {
        let blend = (format, if over_solids { BlendMode::OverTested } else { BlendMode::Over });
        Ok(Impostors {
            part: Kernel::new(device, compiler, "impostors.part", PartPush::FIELDS)?,
            show: DrawPipeline::new(device, compiler, "impostors", Push::FIELDS, &[], blend)?,
        })
    }

    /// Parts the first `n_entries` entries into those of the layer and the others.
    ///
    /// With `cut`, an axis and a depth relative to the lighting origin, particles of at least that
    /// depth along the axis become the new members of the layer; without, the members stay.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_part(
        &self,
        rec: &mut Recorder<'_>,
        buffers: PartBuffers<'_>,
        n_entries: u32,
        cut: Option<([f32; 3], f32)>,
    ) -> Result<()> {
        if cut.is_some() {
            // A particle that is not drawn is not a member.
            rec.fill(buffers.members, 0);
        }
        let (forward, depth) = cut.unwrap_or_default();
        let is_new = u32::from(cut.is_some());
        let push = PartPush { forward, cut: depth, n_entries, is_new, unused: [0; 2] };
        rec.dispatch(&self.part, &buffers.by_binding(), &push, n_entries)
    }

    /// Draws `layer` (`[f32; 4]` by texel, rows from the top) into `target`, over the surfaces if
    /// `target` has depth.
    ///
    /// # Errors
    /// Fails if `target` does not fit the pipeline.
    pub fn record_show(
        &self,
        rec: &mut Recorder<'_>,
        layer: &Buffer,
        target: Target<'_>,
        view: &LayerView,
    ) -> Result<()> {
        let (width, height) = target.color.size();
        let push = push(view, [width, height]);
        let start = if target.depth.is_some() { LoadOp::Load } else { LoadOp::Clear };
        rec.draw(&self.show, target, start, &[layer], &push, InstanceCount::Known(1))
    }
}

/// Returns the homography between pixels. Both pictures' pixels count from the center, so that f32
/// holds them best.
fn push(shown: &LayerView, [width, height]: [u32; 2]) -> Push {
    let middle = 0.5 * DVec2::new(width.into(), height.into());
    let (view, layer) = (shown.view_tangents, shown.layer_tangents);
    let slopes = DMat3::from_diagonal(DVec3::new(view.x / middle.x, -view.y / middle.y, 1.0));
    let texels = 0.5 * DVec2::new(shown.size[0].into(), shown.size[1].into()) / layer;
    let texels = DMat3::from_diagonal(DVec3::new(texels.x, -texels.y, 1.0));
    let of = (texels * shown.to_layer * slopes).transpose();
    // Rows count downward, in slopes and on the screen.
    let down = DVec2::new(1.0, -1.0);
    let on_screen =
        shown.bounds.map(|slopes| (down * slopes / view).clamp(DVec2::NEG_ONE, DVec2::ONE));
    let (low, high) = (on_screen[0].min(on_screen[1]), on_screen[0].max(on_screen[1]));
    let f32s = |v: DVec3| v.as_vec3().to_array();
    Push {
        column: f32s(of.x_axis),
        depth: shown.depth,
        row: f32s(of.y_axis),
        width: shown.size[0],
        under: f32s(of.z_axis),
        height: shown.size[1],
        middle: middle.as_vec2().to_array(),
        low: low.as_vec2().to_array(),
        high: high.as_vec2().to_array(),
    }
}
