//! The passes of a scene's frames and the buffers that they share.

use super::buffers::{SceneBuffers, diffusion_room, grid_room};
use super::constants::FrameConstants;
use super::culling::Culling;
use super::features::{
    SceneFeatures, colored_runs, has_bounces, has_diffusion, has_haze, has_relief, has_sea,
    has_second, has_slopes, is_grouped, is_medium,
};
use super::gather::IndirectGather;
use super::live::{LiveParticles, PlacedUploads, unmoved};
use super::merging::Merging;
use super::morton_sort::FacetRuns;
use super::packet::Packet;
use super::picture::Picture;
use super::records;
use super::tensors::LightTensors;
use crate::error::Result;
use crate::gpu::{Commands, Compiler, Device};
use crate::model::scene::{Scene, Simulate};
use crate::passes::diffusion::Diffusion;
use crate::passes::facets::Facets;
use crate::passes::first::First;
use crate::passes::generate::Generate;
use crate::passes::grid::Grid;
use crate::passes::harmonics::{Colored, Harmonics};
use crate::passes::haze::{HazePass, HazeVariant};
use crate::passes::place::Place;
use crate::passes::relief::Relief;
use crate::passes::scatter::{Scatter, ScatterVariant};
use crate::passes::sort::Sort;
use crate::passes::texture::Texture;
use crate::passes::transmit::{Arriving, Transmit};

/// The pipelines and buffers of a scene's frames. A pass that the scene does not need is `None`.
pub(super) struct FramePasses {
    pub generate: Generate,
    pub live: Option<LiveParticles>,
    pub place: Place,
    /// Places of particles that the game thread moves.
    pub placed_uploads: Option<PlacedUploads>,
    pub harmonics: Option<Harmonics>,
    /// The particles whose colours change with the direction of view.
    pub colored: Vec<Colored>,
    pub merging: Option<Merging>,
    pub grid: Grid,
    pub runs: Option<FacetRuns>,
    pub facets: Facets,
    pub relief: Option<Relief>,
    pub transmit: Transmit,
    pub first: First,
    pub diffusion: Option<Diffusion>,
    pub scatter: Option<Scatter>,
    pub gather: Option<IndirectGather>,
    pub tensors: Option<LightTensors>,
    pub haze: Option<HazePass>,
    pub culling: Option<Culling>,
    pub sort: Sort,
    pub texture: Option<Texture>,
    pub buffers: SceneBuffers,
    pub picture: Picture,
    pub constants: FrameConstants,
    pub features: SceneFeatures,
}

/// Returns what the march toward the lights writes.
fn arriving(scene: &Scene) -> Arriving {
    if is_medium(scene) {
        Arriving::Depth
    } else if has_second(scene) {
        Arriving::ShareAndClouds
    } else {
        Arriving::Share
    }
}

impl FramePasses {
    /// Creates the passes of `scene`, in which no knob is "auto". Light tensors may take
    /// `free_bytes` of the device's memory.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        commands: &mut Commands,
        scene: &Scene,
        free_bytes: u64,
    ) -> Result<FramePasses> {
        let n_particles = scene.n_particles() as u32;
        let (fit, tensors) = LightTensors::new(device, compiler, commands, scene, free_bytes)?;
        let has_tensors = tensors.is_some();
        let gather = has_second(scene)
            .then(|| IndirectGather::new(device, compiler, commands, scene, has_tensors))
            .transpose()?;
        let runs = is_grouped(scene)
            .then(|| FacetRuns::new(device, compiler, commands, scene))
            .transpose()?;
        let is_moved_by_host = scene.threads.simulate == Simulate::Cpu;
        let sums = scene.lighting.sums.into();
        let colored = colored_runs(scene);
        let passes = FramePasses {
            generate: Generate::new(device, compiler)?,
            live: LiveParticles::new(device, compiler, scene)?,
            place: Place::new(device, compiler)?,
            placed_uploads: is_moved_by_host
                .then(|| PlacedUploads::new(device, scene))
                .transpose()?,
            harmonics: (!colored.is_empty())
                .then(|| Harmonics::new(device, compiler))
                .transpose()?,
            colored,
            merging: Merging::new(device, compiler, scene)?,
            grid: Grid::new(device, compiler, grid_room(scene), scene.shapes())?,
            runs,
            facets: Facets::new(device, compiler, scene.shapes(), is_medium(scene))?,
            relief: has_relief(scene).then(|| Relief::new(device, compiler)).transpose()?,
            transmit: Transmit::new(device, compiler, arriving(scene), &sums, has_relief(scene))?,
            first: First::new(device, compiler)?,
            diffusion: diffusion_room(scene)
                .map(|room| Diffusion::new(device, compiler, room))
                .transpose()?,
            scatter: is_medium(scene)
                .then(|| {
                    let is_diffuse = has_diffusion(scene);
                    let has_solids = is_diffuse && scene.has_solids();
                    let has_slopes = has_slopes(scene);
                    let has_seen = has_bounces(scene);
                    let variant = ScatterVariant { is_diffuse, has_slopes, has_solids, has_seen };
                    Scatter::new(device, compiler, variant)
                })
                .transpose()?,
            gather,
            tensors,
            haze: has_haze(scene)
                .then(|| {
                    let variant = HazeVariant {
                        has_slopes: has_slopes(scene),
                        has_sea: has_sea(scene),
                        has_depths: is_medium(scene),
                    };
                    HazePass::new(device, compiler, variant)
                })
                .transpose()?,
            culling: Culling::new(device, compiler, scene)?,
            sort: Sort::new(device, compiler, n_particles)?,
            texture: scene.is_textured().then(|| Texture::new(device, compiler)).transpose()?,
            buffers: SceneBuffers::new(device, scene)?,
            picture: Picture::new(device, compiler, scene)?,
            constants: FrameConstants::new(scene),
            features: SceneFeatures::new(scene, fit),
        };
        records::fill(device, commands, scene, &scene.groups(), &passes.buffers)?;
        Ok(passes)
    }

    /// Writes the data of `packet` into the staging buffers of `slot`.
    pub fn write(&mut self, slot: usize, packet: &Packet) -> Result<()> {
        self.buffers.write(slot, packet)?;
        if let Some(live) = &mut self.live {
            live.write(slot, packet)?;
        }
        if let Some(uploads) = &mut self.placed_uploads {
            let placed = packet.placed.as_ref().ok_or_else(|| unmoved("places of particles"))?;
            uploads.placed.write(slot, placed)?;
        }
        let order = self.gather.iter_mut().filter_map(|gather| gather.order.as_mut());
        for sort in self.runs.iter_mut().map(|runs| &mut runs.sort).chain(order) {
            sort.buffers.bounds.write(slot, &packet.bounds)?;
        }
        match &mut self.tensors {
            Some(tensors) => tensors.buffers.coefficients.write(slot, &packet.coefficients),
            None => Ok(()),
        }
    }
}
