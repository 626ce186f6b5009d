//! The render step: the whole frame on one page.

use std::time::Instant;

use super::buffers::{Buffers, download};
use super::exchange::{Exchange, is_glossy};
use super::packet::Packet;
use super::plan::{Pass, Plan, Tensors, Traits, plan};
use super::tensor::{Shape, TensorStage, basis_of, is_edited};
use super::{limits, ms};
use crate::error::Result;
use crate::gpu::memory::TargetFormat;
use crate::gpu::{Barriers, Buffer, Commands, Compiler, Device, Image, Place, Recorder, ScopeTime};
use crate::layout::facet::{FacetRecord, LitRecord};
use crate::layout::particle::{ParticleRecord, PlacedRecord};
use crate::model::boxes::MAX_ATTEMPTS;
use crate::model::cloud::{CloudSource, heaviest_blob};
use crate::model::film::FilmFormat;
use crate::model::scene::{LightingMode, Pairs, Scene, Simulate};
use crate::passes::facets::Facets;
use crate::passes::first::{First, Push as FirstPush};
use crate::passes::generate::Generate;
use crate::passes::grid::Grid;
use crate::passes::place::Place as PlacePass;
use crate::passes::second::{GatherPush, Receivers, Second, SourcesPush};
use crate::passes::sort::Sort;
use crate::passes::sprites::Sprites;
use crate::passes::transmit::Transmit;

pub struct Renderer {
    generate: Generate,
    place: PlacePass,
    grid: Grid,
    facets: Facets,
    transmit: Transmit,
    first: First,
    second: Option<SecondStage>,
    tensor: Option<TensorStage>,
    sort: Sort,
    sprites: Sprites,
    buffers: Buffers,
    target: Image,
    readback: Buffer,
    commands: Commands,
    settings: Settings,
    traits: Traits,
    last: Option<Packet>,
}

/// What of the scene the passes are told and that is constant over a run.
pub(super) struct Settings {
    n_particles: u32,
    n_surface_facets: u32,
    pub n_facets: u32,
    pub n_lights: u32,
    pub pairs: Pairs,
    theta: f64,
    heaviest: f64,
    pub step_cells: f64,
    pub forward: f64,
    sort_bits: u32,
    cutoff: f64,
    format: TargetFormat,
}

/// What a render step tells of itself.
pub struct Rendered {
    pub plan: Plan,
    pub record_ms: f64,
    pub submit_wait_ms: f64,
    pub passes: Vec<ScopeTime>,
}

impl Renderer {
    /// Checks the scene against the device's limits, then makes every pipeline and buffer it needs. `skip`: leave out
    /// what a frame does not need.
    pub fn new(device: &Device, compiler: &Compiler, scene: &Scene, skip: bool) -> Result<Renderer> {
        let free = device.limits().device_memory_bytes - limits::check(scene, device.limits())?;
        let groups = scene.groups();
        let n_particles = scene.n_particles() as u32;
        let lit = scene.lighting.mode != LightingMode::None;
        let format = target_format(scene.film.format);
        let n_bytes = u64::from(scene.film.width) * u64::from(scene.film.height) * format.bytes_per_pixel();
        let host_places = scene.threads.simulate == Simulate::Cpu;
        let mut commands = Commands::new(device, "frame")?;
        let (tensors, tensor) = tensor_stage(device, compiler, &mut commands, scene, free)?;
        let two_reflections = scene.lighting.mode == LightingMode::TwoReflection;
        let second = match two_reflections {
            true => Some(SecondStage::new(device, compiler, &mut commands, scene)?),
            false => None,
        };
        let mut renderer = Renderer {
            generate: Generate::new(device, compiler)?,
            place: PlacePass::new(device, compiler)?,
            grid: Grid::new(device, compiler, limits::n_cells_max(scene))?,
            facets: Facets::new(device, compiler)?,
            transmit: Transmit::new(device, compiler)?,
            first: First::new(device, compiler)?,
            second,
            tensor,
            sort: Sort::new(device, compiler, n_particles)?,
            sprites: Sprites::new(device, compiler, format, lit)?,
            buffers: Buffers::new(device, scene, &groups, host_places)?,
            target: Image::color_target(device, "sprites.target", scene.film.width, scene.film.height, format)?,
            readback: Buffer::new::<u8>(device, "sprites.readback", n_bytes, Place::Readback)?,
            commands,
            settings: Settings {
                n_particles,
                n_surface_facets: scene.n_surface_facets() as u32,
                n_facets: scene.n_facets() as u32,
                pairs: scene.lighting.pairs,
                theta: scene.lighting.theta,
                n_lights: scene.lights.len() as u32,
                heaviest: heaviest_blob(&groups),
                step_cells: scene.lighting.step,
                forward: scene.lighting.forward,
                sort_bits: scene.draw.sort_bits,
                cutoff: scene.draw.cutoff,
                format,
            },
            traits: Traits {
                has_boxes: scene.clouds.iter().any(|c| matches!(c.source, CloudSource::Boxes { .. })),
                n_particles,
                n_facets: scene.n_facets() as u32,
                lit,
                two_reflections,
                glossy: (0..scene.n_regions()).any(|i| is_glossy(scene, i)),
                tensors,
                skip,
            },
            last: None,
        };
        renderer.buffers.fill(device, &mut renderer.commands, scene, &groups)?;
        Ok(renderer)
    }

    /// Draws one frame and waits for it.
    pub fn step(&mut self, packet: Packet) -> Result<Rendered> {
        let begin = Instant::now();
        let plan = plan(&self.traits, self.last.as_ref(), &packet);
        self.upload(&packet, &plan)?;
        self.record(&packet, &plan)?;
        let recorded = Instant::now();
        self.commands.submit()?;
        let passes = self.commands.wait()?;
        self.last = Some(packet);
        Ok(Rendered { plan, record_ms: ms(begin, recorded), submit_wait_ms: ms(recorded, Instant::now()), passes })
    }

    /// Forgets the last frame: the next one does everything, as the first did.
    pub fn reset(&mut self) {
        self.last = None;
    }

    fn upload(&mut self, packet: &Packet, plan: &Plan) -> Result<()> {
        self.buffers.groups.write(&packet.groups)?;
        self.buffers.modes.write(&packet.modes)?;
        self.buffers.table.write(&packet.table)?;
        self.buffers.regions.write(&packet.regions)?;
        self.buffers.lights.write(&packet.lights)?;
        if let Some(tensor) = &mut self.tensor {
            tensor.upload(packet)?;
        }
        match (&mut self.buffers.placed_upload, &packet.placed) {
            (Some(upload), Some(placed)) if plan.runs(Pass::Place) => upload.write(placed),
            _ => Ok(()),
        }
    }

    /// The frame, pass by pass.
    fn record(&mut self, packet: &Packet, plan: &Plan) -> Result<()> {
        let Renderer {
            generate,
            place,
            grid,
            facets,
            transmit,
            first,
            second,
            tensor,
            sort,
            sprites,
            buffers: b,
            target,
            settings: s,
            ..
        } = self;
        let n = s.n_particles;
        self.commands.record(Barriers::Placed, |rec| {
            pass(rec, plan, Pass::Generate, |rec| {
                generate.record(rec, [&b.boxes, &b.i_group, &b.particles, &b.status], n, MAX_ATTEMPTS)
            })?;
            pass(rec, plan, Pass::Place, |rec| match &b.placed_upload {
                Some(upload) => {
                    rec.copy(upload, &b.placed);
                    Ok(())
                }
                None => place.record(rec, [&b.particles, &b.i_group, &b.groups, &b.modes, &b.placed], n),
            })?;
            pass(rec, plan, Pass::Grid, |rec| {
                grid.record(rec, [&b.placed, &b.particles, &b.density], &packet.grid, n, s.heaviest)
            })?;
            pass(rec, plan, Pass::Facets, |rec| {
                let buffers = [&b.placed, &b.particles, &b.i_group, &b.groups, &b.density, &b.facets];
                facets.record(rec, buffers, &packet.grid, n, s.n_surface_facets)?;
                facets.record_surfaces(rec, [&b.regions, &b.i_region, &b.facets], s.n_surface_facets)
            })?;
            pass(rec, plan, Pass::Transmit, |rec| {
                let buffers = [&b.facets, &b.lights, &b.density, &b.transmittance];
                transmit.record(rec, buffers, &packet.grid, [s.n_facets, s.n_lights], s.step_cells, s.forward)
            })?;
            pass(rec, plan, Pass::First, |rec| {
                if let Some(tensor) = tensor {
                    return tensor.record_first(rec, b, packet, s);
                }
                let from = [&b.facets, &b.lights, &b.transmittance, &b.regions, &b.table, &b.lit];
                let push = FirstPush { eye: packet.camera.eye, n_facets: s.n_facets, n_lights: s.n_lights };
                first.record(rec, from, &push)
            })?;
            pass(rec, plan, Pass::Second, |rec| match second {
                Some(second) => second.record(rec, b, tensor.as_ref(), packet, s),
                None => Ok(()),
            })?;
            pass(rec, plan, Pass::Contract, |rec| match tensor {
                Some(tensor) => tensor.record_contract(rec, b, s),
                None => Ok(()),
            })?;
            pass(rec, plan, Pass::Sort, |rec| {
                sort.record_keys(rec, [&b.placed, &b.entries], packet.camera.forward, n, packet.radius, s.sort_bits)?;
                sort.record(rec, &b.entries, n, s.sort_bits)
            })?;
            pass(rec, plan, Pass::Sprites, |rec| {
                let from = [&b.entries, &b.placed, &b.particles, &b.lit];
                sprites.record(rec, from, target, &packet.camera, s.cutoff, n)
            })
        })
    }

    /// The last frame's pixels: premultiplied linear RGBA, rows from the top.
    pub fn image(&mut self) -> Result<Vec<f32>> {
        let bytes = self.image_bytes()?;
        Ok(match self.settings.format {
            TargetFormat::Rgba16f => {
                let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
                halves.into_iter().map(half::f16::to_f32).collect()
            }
            TargetFormat::Rgba32f => bytemuck::pod_collect_to_vec(&bytes),
        })
    }

    /// The last frame as it lies in the target: what "the same bytes" means.
    pub fn image_bytes(&mut self) -> Result<Vec<u8>> {
        let (target, readback) = (&mut self.target, &self.readback);
        self.commands.run(|rec| {
            rec.copy_image(target, readback);
            Ok(())
        })?;
        readback.read((target.n_pixels() * self.settings.format.bytes_per_pixel()) as usize)
    }

    /// Runs `generate` alone and gives the particles relative to their groups, and each one's status.
    pub fn generate_now(&mut self, device: &Device) -> Result<(Vec<ParticleRecord>, Vec<u32>)> {
        let n = self.settings.n_particles;
        let (generate, b) = (&self.generate, &self.buffers);
        if self.traits.has_boxes {
            self.commands
                .run(|rec| generate.record(rec, [&b.boxes, &b.i_group, &b.particles, &b.status], n, MAX_ATTEMPTS))?;
        }
        let particles = download(device, &mut self.commands, &self.buffers.particles, n)?;
        Ok((particles, download(device, &mut self.commands, &self.buffers.status, n)?))
    }

    /// Where the last frame had the particles, relative to its lighting origin.
    pub fn placed(&mut self, device: &Device) -> Result<Vec<PlacedRecord>> {
        download(device, &mut self.commands, &self.buffers.placed, self.settings.n_particles)
    }

    /// The last frame's facets and their light; only meaningful where the scene is lit.
    pub fn facets(&mut self, device: &Device) -> Result<(Vec<FacetRecord>, Vec<LitRecord>)> {
        let n = self.settings.n_facets;
        let facets = download(device, &mut self.commands, &self.buffers.facets, n)?;
        Ok((facets, download(device, &mut self.commands, &self.buffers.lit, n)?))
    }
}

/// The second reflection and what it is gathered with.
struct SecondStage {
    second: Second,
    exchange: Exchange,
}

impl SecondStage {
    fn new(device: &Device, compiler: &Compiler, commands: &mut Commands, scene: &Scene) -> Result<SecondStage> {
        let second = Second::new(device, compiler, scene.n_particles() > 0)?;
        let exchange = Exchange::new(device, commands, scene, second.block_len())?;
        Ok(SecondStage { second, exchange })
    }

    fn record(
        &self,
        rec: &mut Recorder<'_>,
        b: &Buffers,
        tensor: Option<&TensorStage>,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        let x = &self.exchange;
        let push = SourcesPush { n_facets: s.n_facets, n_lights: s.n_lights };
        let buffers = [&b.facets, &b.lights, &b.transmittance, &b.regions, &x.order, &x.leaves, &b.sources, &b.fluxes];
        self.second.record_sources(rec, buffers, &push)?;
        if let Some(tensor) = tensor {
            return tensor.record_second(rec, b, x, packet, s);
        }
        for receivers in [Receivers::Diffuse, Receivers::Glossy] {
            let (i_first_block, n_blocks) = x.blocks_of(receivers);
            let push = GatherPush {
                grid: packet.grid,
                eye: packet.camera.eye,
                n_lights: s.n_lights,
                pair_size: s.pairs.size as f32,
                pair_levels: s.pairs.levels,
                step_length: s.step_cells as f32 * packet.grid.cell,
                backward: (1.0 - s.forward) as f32,
                pair_steps: s.pairs.steps,
                i_first_block,
                theta: s.theta as f32,
            };
            let buffers = [
                &x.blocks,
                &x.pairings,
                &x.occluders,
                &x.order,
                &b.facets,
                &b.regions,
                &b.lights,
                &b.sources,
                &b.fluxes,
                &b.table,
                &b.density,
                &b.lit,
            ];
            self.second.record(rec, buffers, &push, receivers, n_blocks)?;
        }
        Ok(())
    }
}

/// The stage of the tensors where materials are edited and the tensors fit into `free` bytes.
fn tensor_stage(
    device: &Device,
    compiler: &Compiler,
    commands: &mut Commands,
    scene: &Scene,
    free: u64,
) -> Result<(Tensors, Option<TensorStage>)> {
    if !is_edited(scene) {
        return Ok((Tensors::Needless, None));
    }
    let shape = Shape::of(scene, basis_of(scene).map_or(1, |b| b.n_bases()));
    match limits::tensors(&shape, device.limits(), free) {
        Tensors::Kept => Ok((Tensors::Kept, Some(TensorStage::new(device, compiler, commands, scene, shape)?))),
        other => Ok((other, None)),
    }
}

/// Runs `f` under the pass's timer label where the plan has it run.
fn pass(
    rec: &mut Recorder<'_>,
    plan: &Plan,
    pass: Pass,
    f: impl FnOnce(&mut Recorder<'_>) -> Result<()>,
) -> Result<()> {
    if plan.runs(pass) { rec.scope(pass.name(), f) } else { Ok(()) }
}

/// The film's format as a render target.
pub fn target_format(format: FilmFormat) -> TargetFormat {
    match format {
        FilmFormat::Rgba16f => TargetFormat::Rgba16f,
        FilmFormat::Rgba32f => TargetFormat::Rgba32f,
    }
}
