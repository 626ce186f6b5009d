//! impostors: what is far, drawn once into a picture (a shell), shown again from where the eye is
//! now.
//!
//! In: sorted entries, a shell's picture (four floats a texel), and how pixels lie in it. Out:
//! entries of what is far and of what is near; the shell under the near blobs, premultiplied linear
//! RGBA in the film's format. Law: a homography by the plane of one depth, Catmull and Rom's cubic.
//! Source: Harris & Lastra 2001, docs/model.md §11. Error: places to 1e-6 of the picture's extent,
//! and the target's rounding; what it shows of the truth is predicted by `model::impostor`.

use glam::{DMat3, DVec2, DVec3};

use crate::error::Result;
use crate::gpu::TargetFormat;
use crate::gpu::{
    BlendMode, Buffer, Compiler, Device, DrawPipeline, InstanceCount, Kernel, LoadOp, Recorder,
    Target,
};
use crate::layout::record;

record! {
    pub struct PartPush { n_entries: u32, last_key: u32, is_new: u32, unused: u32 }
}

record! {
    pub struct Push {
        column: [f32; 3],
        depth: f32,
        row: [f32; 3],
        width: u32,
        under: [f32; 3],
        height: u32,
        middle: [f32; 2],
        low: [f32; 2],
        high: [f32; 2],
    }
}

pub struct Impostors {
    part: Kernel,
    show: DrawPipeline,
}

/// A shell as it is shown now.
#[derive(Debug, Clone, Copy)]
pub struct Shown {
    /// From slopes of the view to slopes of the shell's picture.
    pub to_shell: DMat3,
    /// Greatest slopes of the view and of the shell's picture.
    pub tangents: [DVec2; 2],
    /// The shell's texels.
    pub size: [u32; 2],
    /// The slopes that it shows anything at, least and greatest; rounded outward by whoever gives
    /// them.
    pub bounds: [DVec2; 2],
    /// near/z of what stands for all of it; surfaces that are nearer hide it.
    pub depth: f32,
}

impl Impostors {
    /// `behind`: surfaces have been drawn, with depth.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        format: TargetFormat,
        behind: bool,
    ) -> Result<Impostors> {
        let meet = if behind { BlendMode::OverTested } else { BlendMode::Over };
        Ok(Impostors {
            part: Kernel::new(device, compiler, "impostors.part", PartPush::FIELDS, &[])?,
            show: DrawPipeline::new(
                device,
                compiler,
                "impostors",
                Push::FIELDS,
                &[],
                (format, meet),
            )?,
        })
    }

    /// Parts the first `n_entries` of `entries` ([key, particle]) into `far` and `near`, by
    /// `members` (u32 a particle), which is made anew where `last_key` says the last key of what is
    /// far.
    pub fn record_part(
        &self,
        rec: &mut Recorder<'_>,
        [entries, members, far, near]: [&Buffer; 4],
        n_entries: u32,
        last_key: Option<u32>,
    ) -> Result<()> {
        if last_key.is_some() {
            // Who is not drawn is not in it.
            rec.fill(members, 0);
        }
        let push = PartPush {
            n_entries,
            last_key: last_key.unwrap_or(0),
            is_new: u32::from(last_key.is_some()),
            unused: 0,
        };
        rec.dispatch(&self.part, &[entries, members, far, near], &push, n_entries)
    }

    /// Draws `shell` (four floats a texel, rows from the top) into `target`, over the surfaces
    /// where it has depth.
    pub fn record_show(
        &self,
        rec: &mut Recorder<'_>,
        shell: &Buffer,
        target: Target<'_>,
        shown: &Shown,
    ) -> Result<()> {
        let (width, height) = target.color.size();
        let push = push(shown, [width, height]);
        let start = if target.depth.is_some() { LoadOp::Load } else { LoadOp::Clear };
        rec.draw(&self.show, target, start, &[shell], &push, InstanceCount::Known(1))
    }
}

/// The homography between pixels: both counted from the middles of their pictures, so that f32
/// holds them best.
fn push(shown: &Shown, [width, height]: [u32; 2]) -> Push {
    let middle = 0.5 * DVec2::new(width.into(), height.into());
    let [view, shell] = shown.tangents;
    let slopes = DMat3::from_diagonal(DVec3::new(view.x / middle.x, -view.y / middle.y, 1.0));
    let texels = 0.5 * DVec2::new(shown.size[0].into(), shown.size[1].into()) / shell;
    let texels = DMat3::from_diagonal(DVec3::new(texels.x, -texels.y, 1.0));
    let of = (texels * shown.to_shell * slopes).transpose();
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
