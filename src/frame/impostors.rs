//! Impostors: distant blobs are drawn into a layer, a picture of its own, and shown from there
//! while that is near enough to the true view.

use super::blob_target::{BlobTarget, TargetSpec};
use super::features::{saturation_bound, target_format};
use super::impostor_cache::{CacheRules, CachedLayer, ImpostorCache, LayerUse, view_of};
use super::packet::Packet;
use super::plan::{Decision, Pass, Plan, Reason};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferSpec, Compiler, Device, Recorder, Target, TargetFormat, buffers};
use crate::model::film::FilmFormat;
use crate::model::scene::Scene;
use crate::passes::blobs::{BlobBuffers, BlobCount, BlobView};
use crate::passes::impostors::{self, LayerView, PartBuffers};

/// A layer is drawn and kept in floats, so that no thin blob is lost.
const FORMAT: FilmFormat = FilmFormat::Rgba32f;

buffers! {
    /// The entries of near and distant blobs, and the layer.
    pub(super) struct LayerBuffers(n_texels: u64, n_particles: u64) {
        /// Pixels of the layer.
        texels: Buffer => [f32; 4], n_texels, "impostors.texels", Texels;
        /// Whether a particle belongs to the layer.
        members: Buffer => u32, n_particles, "impostors.members";
        /// Sorted entries of the layer.
        far: Buffer => [u32; 2], n_particles, "impostors.far";
        /// Sorted entries of all other blobs.
        near: Buffer => [u32; 2], n_particles, "impostors.near";
    }
}

/// The impostor layer of a scene.
pub(super) struct Impostors {
    pass: impostors::Impostors,
    cache: ImpostorCache,
    /// The layer that the frame being recorded shows.
    now: LayerUse,
    target: BlobTarget,
    pub buffers: LayerBuffers,
}

fn target_spec(rules: &CacheRules) -> TargetSpec {
    TargetSpec {
        size: rules.layer_size,
        format: TargetFormat::Rgba32f,
        n_pictures: 1,
        has_depth: false,
        has_layer: false,
        has_blobs: true,
        n_chunks: 0,
    }
}

fn n_texels(rules: &CacheRules) -> u64 {
    rules.layer_size.map(u64::from).iter().product()
}

impl Impostors {
    /// Creates the layer of `scene`, in which no knob is "auto".
    pub fn new(device: &Device, compiler: &Compiler, scene: &Scene) -> Result<Impostors> {
        let (rules, format) = (CacheRules::new(scene), target_format(scene.film.format));
        let target = BlobTarget::new(device, compiler, scene, &target_spec(&rules));
        Ok(Impostors {
            pass: impostors::Impostors::new(device, compiler, format, scene.has_solids())?,
            cache: ImpostorCache::new(rules),
            now: LayerUse::None("there is no frame before"),
            target: target.map_err(|error| match error {
                Error::Limit { what } => Error::limit(format!("draw.impostors: {what}")),
                error => error,
            })?,
            buffers: LayerBuffers::new(device, n_texels(&rules), scene.n_particles())?,
        })
    }

    /// Lists the sizes of the images and buffers.
    pub fn specs(scene: &Scene) -> Vec<BufferSpec> {
        let rules = CacheRules::new(scene);
        let buffers = LayerBuffers::specs(n_texels(&rules), scene.n_particles());
        [target_spec(&rules).specs(scene), buffers].concat()
    }

    /// Decides which layer `packet`'s frame shows, and returns `plan` with that decision.
    pub fn decide(&mut self, plan: Plan, packet: &Packet) -> Plan {
        if plan.changed() == Some("there is no frame before") {
            self.cache.reset();
        }
        if !plan.runs(Pass::Impostors) {
            self.now = LayerUse::None("nothing is drawn");
            return plan;
        }
        self.now = self.cache.step(packet, plan.changed());
        let run = |reason| Decision { run: true, reason };
        plan.with_impostors(match self.now {
            LayerUse::None(why) => Decision::skip(why),
            LayerUse::Made { why, .. } => run(Reason::Made(why)),
            LayerUse::Reused { pixels, .. } => {
                run(Reason::Reused { milli_px: (1e3 * pixels).ceil() as u32 })
            }
        })
    }

    /// Returns whether the frame being recorded shows a layer.
    pub fn has_layer(&self) -> bool {
        !matches!(self.now, LayerUse::None(_))
    }

    /// Parts the entries, draws the layer if it is not cached, and shows it in `target`.
    ///
    /// `buffers` has all entries, `count` says how many, and `view` is that of the frame.
    pub fn record(
        &mut self,
        rec: &mut Recorder<'_>,
        buffers: &BlobBuffers<'_>,
        view: &BlobView<'_>,
        count: BlobCount<'_>,
        packet: &Packet,
        target: Target<'_>,
    ) -> Result<()> {
        let (layer, is_new) = match &self.now {
            LayerUse::None(_) => return Ok(()),
            LayerUse::Made { layer, .. } => (layer, true),
            LayerUse::Reused { layer, .. } => (layer, false),
        };
        let LayerBuffers { texels, members, far, near } = &self.buffers;
        let BlobBuffers { entries, placed, .. } = *buffers;
        let part = PartBuffers { entries, members, far, near, placed };
        let cut = is_new.then_some((layer.camera.forward, layer.cut));
        self.pass.record_part(rec, part, packet.n_drawn, cut)?;
        if is_new {
            let (camera, saturated) = (&layer.camera, saturation_bound(FORMAT));
            let view = BlobView { camera, saturated, ..*view };
            let buffers = BlobBuffers { entries: far, ..*buffers };
            self.target.record_blobs(rec, 0, false, &buffers, &view, count)?;
            self.target.record_copy(rec, 0, texels);
        }
        let view = layer_view(layer, packet, self.cache.rules.layer_size);
        self.pass.record_show(rec, texels, target, &view)
    }
}

/// Returns how `layer` appears to the camera of `packet`.
fn layer_view(layer: &CachedLayer, packet: &Packet, size: [u32; 2]) -> LayerView {
    let now = view_of(&packet.camera);
    LayerView {
        to_layer: layer.shell.homography(&now),
        view_tangents: now.tangents,
        layer_tangents: layer.shell.view.tangents,
        size,
        bounds: layer.bounds,
        depth: (f64::from(packet.camera.near) / layer.depth) as f32,
    }
}
