//! The render step: the whole frame on one page.

use std::time::Instant;

use super::buffers::{Buffers, download, has_second};
use super::exchange::{gathers_from_tree, is_glossy};
use super::grouping::{Grouping, is_grouped};
use super::packet::Packet;
use super::plan::{Pass, Plan, Traits, plan};
use super::relay::Relay;
use super::tensor::{TensorStage, tensor_stage};
use super::{limits, ms};
use crate::error::Result;
use crate::gpu::memory::TargetFormat;
use crate::gpu::{Barriers, Buffer, Commands, Compiler, Device, Image, Place, Recorder, ScopeTime, Target};
use crate::layout::facet::{FacetRecord, LitRecord};
use crate::layout::particle::{ParticleRecord, PlacedRecord};
use crate::model::boxes::MAX_ATTEMPTS;
use crate::model::cloud::{CloudSource, heaviest_blob};
use crate::model::film::FilmFormat;
use crate::model::scene::{LightingMode, Scene, Simulate};
use crate::passes::facets::Facets;
use crate::passes::first::{First, Push as FirstPush};
use crate::passes::generate::Generate;
use crate::passes::grid::Grid;
use crate::passes::place::Place as PlacePass;
use crate::passes::sort::Sort;
use crate::passes::sprites::Sprites;
use crate::passes::surfaces::Surfaces;
use crate::passes::transmit::Transmit;

pub struct Renderer {
    generate: Generate,
    place: PlacePass,
    grid: Grid,
    facets: Facets,
    grouping: Option<Grouping>,
    transmit: Transmit,
    first: First,
    second: Option<Relay>,
    tensor: Option<TensorStage>,
    sort: Sort,
    sprites: Sprites,
    buffers: Buffers,
    target: Image,
    /// What draws the surfaces, and their depth; none where there are none.
    scenery: Option<(Surfaces, Image)>,
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
    n_surfaces: u32,
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
        // Tensors hold every pair.
        let tree = tensor.is_none() && gathers_from_tree(scene);
        let second = match two_reflections {
            true => Some(Relay::new(device, compiler, &mut commands, scene, tree)?),
            false => None,
        };
        let scenery = match scene.surfaces.is_empty() {
            true => None,
            false => {
                let depth = Image::depth(device, "surfaces.depth", scene.film.width, scene.film.height)?;
                Some((Surfaces::new(device, compiler, format)?, depth))
            }
        };
        let grouped = is_grouped(scene);
        let grouping = match grouped {
            true => Some(Grouping::new(device, compiler, &mut commands, scene)?),
            false => None,
        };
        let mut renderer = Renderer {
            generate: Generate::new(device, compiler)?,
            place: PlacePass::new(device, compiler)?,
            grid: Grid::new(device, compiler, limits::n_cells_max(scene))?,
            facets: Facets::new(device, compiler)?,
            grouping,
            transmit: Transmit::new(device, compiler, has_second(scene))?,
            first: First::new(device, compiler)?,
            second,
            tensor,
            sort: Sort::new(device, compiler, n_particles)?,
            sprites: Sprites::new(device, compiler, format, lit, [scenery.is_some(), grouped])?,
            buffers: Buffers::new(device, scene, &groups, host_places)?,
            target: Image::color_target(device, "sprites.target", scene.film.width, scene.film.height, format)?,
            scenery,
            readback: Buffer::new::<u8>(device, "sprites.readback", n_bytes, Place::Readback)?,
            commands,
            settings: Settings {
                n_particles,
                n_surface_facets: scene.n_surface_facets() as u32,
                n_facets: scene.n_facets() as u32,
                n_lights: scene.lights.len() as u32,
                n_surfaces: scene.surfaces.len() as u32,
                heaviest: heaviest_blob(&groups),
                step_cells: scene.lighting.step,
                // Without particles there is nothing to march through.
                forward: if n_particles > 0 { scene.lighting.forward } else { 1.0 },
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
                grouped,
                n_surfaces: scene.surfaces.len() as u32,
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
        if let Some(grouping) = &mut self.grouping {
            grouping.upload(packet)?;
        }
        if let Some(second) = &mut self.second {
            second.upload(packet)?;
        }
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
            grouping,
            transmit,
            first,
            second,
            tensor,
            sort,
            sprites,
            scenery,
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
            pass(rec, plan, Pass::Morton, |rec| grouping.as_ref().map_or(Ok(()), |g| g.record_order(rec, b)))?;
            pass(rec, plan, Pass::Facets, |rec| {
                match grouping {
                    Some(grouping) => grouping.record_facets(rec, facets, b, packet)?,
                    None => {
                        let buffers = [&b.placed, &b.particles, &b.i_group, &b.groups, &b.density, &b.facets];
                        facets.record(rec, buffers, &packet.grid, n, s.n_surface_facets)?;
                    }
                }
                facets.record_surfaces(rec, [&b.regions, &b.i_region, &b.facets], s.n_surface_facets)
            })?;
            pass(rec, plan, Pass::Transmit, |rec| {
                let buffers = [&b.facets, &b.lights, &b.regions, &b.density, &b.transmittance, &b.through];
                transmit.record(
                    rec,
                    buffers,
                    &packet.grid,
                    [s.n_facets, s.n_lights, s.n_surfaces],
                    s.step_cells,
                    s.forward,
                )
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
                Some(second) => second.record(rec, plan, b, packet, tensor.as_ref()),
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
            let (surfaces, mut depth) = scenery.as_mut().map(|(surfaces, depth)| (&*surfaces, depth)).unzip();
            pass(rec, plan, Pass::Surfaces, |rec| match surfaces {
                Some(surfaces) => {
                    let target = Target { color: &mut *target, depth: depth.as_deref_mut() };
                    surfaces.record(rec, [&b.regions, &b.lit], target, &packet.camera, s.n_surfaces)
                }
                None => Ok(()),
            })?;
            pass(rec, plan, Pass::Sprites, |rec| {
                let from = [&b.entries, &b.placed, &b.particles, &b.lit, &b.i_facet];
                let counts = [n, s.n_surface_facets];
                sprites.record(rec, from, Target { color: target, depth }, &packet.camera, s.cutoff, counts)
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
