//! What is far, drawn into a picture of its own and shown from there as long as that is near enough
//! to the truth.

use super::buffers::Buffers;
use super::packet::Packet;
use super::plan::{Decision, Pass, Plan, Reason, skip};
use super::settings::Settings;
use super::shells::{Keeper, Kept, Rules, Step, view_of};
use super::tiling::Tiling;
use crate::error::{Error, Result};
use crate::gpu::TargetFormat;
use crate::gpu::{Buffer, Compiler, Device, Image, MemoryUsage, RecordCount, Recorder, Target};
use crate::model::film::FilmFormat;
use crate::model::scene::{DrawPath, Scene};
use crate::passes;
use crate::passes::impostors::Shown;
use crate::passes::sprites::Sprites;
use crate::passes::tiles::View;

use super::tiling::saturated;

/// A shell's picture is drawn and kept in floats: no layer of it is lost.
const FORMAT: TargetFormat = TargetFormat::Rgba32f;

pub(super) struct Impostors {
    pass: passes::impostors::Impostors,
    keeper: Keeper,
    /// What the frame that is recorded shows.
    now: Step,
    /// None where tiles draw.
    sprites: Option<OfSprites>,
    /// None where sprites draw.
    tiling: Option<Tiling>,
    /// By particle whether it is in the shell.
    members: Buffer,
    /// Sorted entries of what is far, and of what is near.
    far: Buffer,
    near: Buffer,
}

/// What draws a shell by sprites, and its picture.
struct OfSprites {
    sprites: Sprites,
    image: Image,
    texels: Buffer,
}

impl Impostors {
    /// `variant`: of the sprites, as [`Sprites::new`] has it but for what is behind.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        format: TargetFormat,
        (lit, variant): (bool, [bool; 5]),
    ) -> Result<Impostors> {
        let rules = Rules::of(scene);
        let ([width, height], n) = (rules.shell_size, scene.n_particles());
        let [grouped, counted, textured, threshold, ellipsoids] = variant;
        let of_sprites = || -> Result<OfSprites> {
            let n_texels = u64::from(width) * u64::from(height);
            Ok(OfSprites {
                sprites: Sprites::new(
                    device,
                    compiler,
                    FORMAT,
                    lit,
                    [false, grouped, counted, textured, threshold, ellipsoids],
                )?,
                image: Image::color_target(device, "impostors.drawn", width, height, FORMAT)
                    .map_err(|e| match e {
                        Error::Limit { what } => Error::limit(format!("draw.impostors: {what}")),
                        e => e,
                    })?,
                texels: Buffer::new::<[f32; 4]>(
                    device,
                    "impostors.texels",
                    n_texels,
                    MemoryUsage::Device,
                )?,
            })
        };
        let path = scene.draw.path;
        let tiling = match path {
            DrawPath::Tiles => {
                Some(Tiling::of_size(device, compiler, scene, rules.shell_size, (FORMAT, false))?)
            }
            _ => None,
        };
        let entries = |name| Buffer::new::<[u32; 2]>(device, name, n, MemoryUsage::Device);
        Ok(Impostors {
            pass: passes::impostors::Impostors::new(device, compiler, format, scene.has_solids())?,
            keeper: Keeper::new(rules),
            now: Step::Nothing("there is no frame before"),
            sprites: (path != DrawPath::Tiles).then(of_sprites).transpose()?,
            tiling,
            members: Buffer::new::<u32>(device, "impostors.members", n, MemoryUsage::Device)?,
            far: entries("impostors.far")?,
            near: entries("impostors.near")?,
        })
    }

    /// Settles what `packet`'s frame shows; `plan` as it comes out of that.
    pub fn decide(&mut self, plan: Plan, packet: &Packet) -> Plan {
        if plan.changed() == Some("there is no frame before") {
            self.keeper.reset();
        }
        if !plan.runs(Pass::Impostors) {
            self.now = Step::Nothing("nothing is drawn");
            return plan;
        }
        self.now = self.keeper.step(packet, plan.changed());
        plan.with_impostors(match self.now {
            Step::Nothing(why) => skip(why),
            Step::Made { why, .. } => Decision { run: true, reason: Reason::Made(why) },
            Step::Reused { pixels, .. } => Decision {
                run: true,
                reason: Reason::Reused { milli_px: (1e3 * pixels).ceil() as u32 },
            },
        })
    }

    /// Entries of the blobs that are drawn over the shell; none where there is no shell, and all
    /// are.
    pub fn near(&self) -> Option<&Buffer> {
        match self.now {
            Step::Nothing(_) => None,
            Step::Made { .. } | Step::Reused { .. } => Some(&self.near),
        }
    }

    /// Parts what is sorted, draws what is far where the shell is made anew, and shows it in
    /// `target`.
    pub fn record(
        &mut self,
        rec: &mut Recorder<'_>,
        path: DrawPath,
        b: &Buffers,
        target: Target<'_>,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        let (kept, is_new) = match self.now {
            Step::Nothing(_) => return Ok(()),
            Step::Made { kept, .. } => (kept, true),
            Step::Reused { kept, .. } => (kept, false),
        };
        let lists = [&b.entries, &self.members, &self.far, &self.near];
        self.pass.record_part(rec, lists, packet.n_drawn, is_new.then_some(kept.last_key))?;
        if is_new {
            self.record_shell(
                rec,
                path,
                b,
                &kept,
                (RecordCount::Known(packet.n_drawn), s.n_solid_facets),
                s,
            )?;
        }
        let texels = match (&self.tiling, &self.sprites) {
            (Some(tiling), _) if path == DrawPath::Tiles => &tiling.pictures[0],
            (_, Some(of)) => &of.texels,
            _ => return Err(no_shells()),
        };
        let now = view_of(&packet.camera);
        let shown = Shown {
            to_shell: kept.shell.homography(&now),
            tangents: [now.tangents, kept.shell.view.tangents],
            size: self.keeper.rules.shell_size,
            bounds: kept.bounds,
            depth: (f64::from(packet.camera.near) / kept.depth) as f32,
        };
        self.pass.record_show(rec, texels, target, &shown)
    }

    /// Draws what is far.
    fn record_shell(
        &mut self,
        rec: &mut Recorder<'_>,
        path: DrawPath,
        b: &Buffers,
        kept: &Kept,
        counts: (RecordCount<'_>, u32),
        s: &Settings,
    ) -> Result<()> {
        let buffers = b.of_sprites_from(&self.far);
        let (cutoff, threshold) = (s.cutoff, s.threshold);
        match (path, &self.tiling, &mut self.sprites) {
            (DrawPath::Tiles, Some(tiling), _) => {
                let view = View {
                    camera: &kept.camera,
                    cutoff,
                    threshold,
                    saturated: saturated(FilmFormat::Rgba32f),
                };
                tiling.record(rec, 0, None, buffers, &view, counts)
            }
            (_, _, Some(OfSprites { sprites, image, texels })) => {
                sprites.record(
                    rec,
                    buffers,
                    Target::color(image),
                    &kept.camera,
                    [cutoff, threshold],
                    counts,
                )?;
                rec.copy_image(image, texels);
                Ok(())
            }
            _ => Err(no_shells()),
        }
    }
}

fn no_shells() -> Error {
    Error::usage("nothing that draws the shells was made")
}
