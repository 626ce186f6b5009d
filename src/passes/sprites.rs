//! sprites: draws the particles as thin Gaussian sprites, quads or points.
//!
//! In: sorted entries and the other buffers of blobs, and the depth of surfaces. Out: premultiplied
//! linear RGBA in the target's format. Law: α = 1 − exp(−√(2π) κ σ e^{−b²/2σ²}), b the distance to
//! the pixel's ray. Source: P §Rendering, model.md §9, passes.md. Error: α to a few 1e-6
//! relative, and the target's rounding at each layer.

use super::blobs::{BlobBuffers, BlobCount, BlobVariant, BlobView};
use crate::error::Result;
use crate::gpu::{
    BlendMode, Compiler, Device, DrawPipeline, InstanceCount, LoadOp, Primitives, RecordCount,
    Recorder, Target, TargetFormat,
};
use crate::layout::cull::KeptRecord;
use crate::layout::frame::CameraRecord;
use crate::layout::record;

record! {
    /// Push constants of `sprites.vert` and `sprites.frag`.
    pub struct Push {
        /// The camera.
        camera: CameraRecord,
        /// Sides of a pixel, as slopes.
        pixel: [f32; 2],
        /// Radius of a blob's footprint, in σ.
        cutoff: f32,
        /// Facet of the first particle.
        i_first_facet: u32,
        /// One over the optical depth at which a blob ends.
        inv_threshold: f32,
        /// Least b²/(2 σ²) at which a blob ends.
        least_cut: f32,
        /// First entry.
        i_first: u32,
    }
}

/// The specialization constant of `sprites.frag` that asks for sums in place of colours.
const SUMS: u32 = 8;
/// Format of a target of sums. Half floats would lose layers from 2048 on.
pub const SUMS_FORMAT: TargetFormat = TargetFormat::Rgba32f;

/// The specialization constant of `sprites.vert` that asks for points.
const POINTS: u32 = 10;
/// Pixels by which a sprite's quad or point may be wider than its blob: what snaps, and the step of
/// a point's side, with room.
const WIDENED: f64 = 1.0;

/// The pipelines of the pass.
pub struct Sprites {
    strips: DrawPipeline,
    points: Option<Points>,
}

/// Sprites drawn as points. llvmpipe runs the vertices of a draw side by side, and computes blocks
/// of fragments along a quad's diagonal twice (docs/explanation/performance.md, "Tiles or
/// sprites").
struct Points {
    pipeline: DrawPipeline,
    /// Pixels along a side of the largest point.
    most: f64,
}

/// A range of the sorted entries.
#[derive(Clone, Copy)]
pub struct Range<'a> {
    /// Number of entries.
    pub instances: InstanceCount<'a>,
    /// Index of the first entry.
    pub i_first: u32,
    /// Facet of the first particle.
    pub i_first_facet: u32,
}

impl Sprites {
    /// Creates the pipelines. `Over` draws far to near into a color target, `OverTested` far to
    /// near over surfaces with depth, and `UnderTested` near to far into a target with depth. With
    /// `Points`, sprites are points where the device takes them, and strips elsewhere.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the pipeline cannot be created.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        variant: BlobVariant,
        (blend, primitives): (BlendMode, Primitives),
    ) -> Result<Sprites> {
        let of = |primitives: Primitives| {
            let is_points = primitives == Primitives::Points;
            let own = [(1, blend != BlendMode::Over), (POINTS, is_points)];
            let own = own.map(|(id, is_on)| (id, u32::from(is_on)));
            let constants = [&own[..], &variant.constants()[..]].concat();
            let (name, target) = (("sprites", primitives), (format, blend));
            DrawPipeline::of(device, compiler, name, Push::FIELDS, &constants, target)
        };
        let most = f64::from(device.limits().max_point_size);
        let takes_points = device.info().kind == "cpu" && most > WIDENED;
        let points = || Ok(Points { pipeline: of(Primitives::Points)?, most });
        let has_points = takes_points && primitives == Primitives::Points;
        Ok(Sprites {
            strips: of(Primitives::Strips)?,
            points: has_points.then(points).transpose()?,
        })
    }

    /// Creates the pipeline that sums over the layers of each pixel: it adds up optical depths in
    /// the first channel and layers in the second, and keeps the greatest near/z in the fourth.
    ///
    /// # Errors
    /// Fails if a shader does not compile or the pipeline cannot be created.
    pub fn sums(
        device: &Device,
        compiler: &Compiler,
        variant: BlobVariant,
        has_depth: bool,
    ) -> Result<Sprites> {
        let constants = [&[(1, 1), (SUMS, 1)], &variant.constants()[..]].concat();
        let blend = if has_depth { BlendMode::SumTested } else { BlendMode::Sum };
        let (fields, target) = (Push::FIELDS, (SUMS_FORMAT, blend));
        let strips = DrawPipeline::new(device, compiler, "sprites", fields, &constants, target)?;
        Ok(Sprites { strips, points: None })
    }

    /// Returns the primitives that [`Sprites::record`] draws a picture of this size by: points
    /// where the device takes them, and none can be larger than its largest.
    pub fn primitives(&self, view: &BlobView<'_>, [width, height]: [u32; 2]) -> Primitives {
        let [across, up] = view.widest();
        let [x, y] = view.camera.pixel_slopes(width, height).map(f64::from);
        // Parts of a sprite beyond the picture's edge are not drawn.
        let side = (across / x).min(width.into()).max((up / y).min(height.into())) + WIDENED;
        let fits = |points: &Points| side <= points.most;
        if self.points.as_ref().is_some_and(fits) { Primitives::Points } else { Primitives::Strips }
    }

    /// Draws the first `count` entries over what `start` leaves of `target`.
    ///
    /// # Errors
    /// Fails if `target` does not fit the pipeline.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &BlobBuffers<'_>,
        (target, start): (Target<'_>, LoadOp),
        view: &BlobView<'_>,
        BlobCount { n, i_first_facet }: BlobCount<'_>,
    ) -> Result<()> {
        let (width, height) = target.color.size();
        let (pipeline, word) = match (&self.points, self.primitives(view, [width, height])) {
            (Some(points), Primitives::Points) => (&points.pipeline, KeptRecord::I_POINTS),
            _ => (&self.strips, KeptRecord::I_DRAW),
        };
        let instances = match n {
            RecordCount::Known(n) => InstanceCount::Known(n),
            RecordCount::Indirect(kept) => InstanceCount::Indirect(kept, word),
        };
        let range = Range { instances, i_first: 0, i_first_facet };
        record_by(pipeline, rec, buffers, (target, start), view, range)
    }

    /// Draws a range of the entries as quads over what `start` leaves of `target`.
    ///
    /// # Errors
    /// Fails if `target` does not fit the pipeline.
    pub fn record_range(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &BlobBuffers<'_>,
        target: (Target<'_>, LoadOp),
        view: &BlobView<'_>,
        range: Range<'_>,
    ) -> Result<()> {
        record_by(&self.strips, rec, buffers, target, view, range)
    }
}

fn record_by(
    pipeline: &DrawPipeline,
    rec: &mut Recorder<'_>,
    buffers: &BlobBuffers<'_>,
    (target, start): (Target<'_>, LoadOp),
    view: &BlobView<'_>,
    Range { instances, i_first, i_first_facet }: Range<'_>,
) -> Result<()> {
    let (width, height) = target.color.size();
    let push = Push {
        camera: *view.camera,
        pixel: view.camera.pixel_slopes(width, height),
        cutoff: view.cutoff as f32,
        i_first_facet,
        inv_threshold: view.inv_threshold(),
        least_cut: view.least_cut() as f32,
        i_first,
    };
    // Slices alone have the light of cells.
    let [bound @ .., _cells] = &buffers.by_binding();
    rec.draw(pipeline, target, start, bound, &push, instances)
}
