//! The render step: the whole frame on one page.

use std::collections::VecDeque;
use std::time::Instant;

use tracing::info_span;

use super::buffers::{Buffers, Placed, has_second};
use super::culling::{Culling, record_sort};
use super::drawing::Drawing;
use super::exchange::gathers_from_tree;
use super::feed::IN_FLIGHT;
use super::grouping::{Grouping, is_grouped};
use super::lives::Lives;
use super::packet::Packet;
use super::plan::{Pass, Plan, Traits, pass, plan};
use super::relay::Relay;
use super::settings::Settings;
use super::tensor::{TensorStage, tensor_stage};
use super::{limits, ms};
use crate::error::{Error, Result};
use crate::gpu::{
    Barriers, Buffer, Commands, Compiler, Device, MemoryUsage, ScopeTime, Submission,
};
use crate::model::boxes::MAX_ATTEMPTS;
use crate::model::scene::{LightingMode, Scene, Simulate};
use crate::passes::facets::Facets;
use crate::passes::first::{First, Push as FirstPush};
use crate::passes::generate::Generate;
use crate::passes::grid::Grid;
use crate::passes::place::Place as PlacePass;
use crate::passes::sort::Sort;
use crate::passes::texture::Texture;
use crate::passes::transmit::Transmit;

// Commands first: they are dropped first, and wait for what is still under way.
pub struct Renderer {
    /// One for each frame in flight.
    frames: [Commands; IN_FLIGHT],
    /// For what is asked between frames.
    pub(super) host: Commands,
    pub(super) in_flight: VecDeque<InFlight>,
    pub(super) generate: Generate,
    /// None where there are no discs.
    lives: Option<Lives>,
    place: PlacePass,
    pub(super) grid: Grid,
    facets: Facets,
    grouping: Option<Grouping>,
    transmit: Transmit,
    first: First,
    second: Option<Relay>,
    tensor: Option<TensorStage>,
    /// None where nothing is left out.
    pub(super) culling: Option<Culling>,
    pub(super) sort: Sort,
    /// None where no cloud has a texture.
    texture: Option<Texture>,
    pub(super) buffers: Buffers,
    pub(super) drawing: Drawing,
    /// Which picture the last ended frame drew.
    pub(super) i_ended_picture: usize,
    pub(super) readback: Buffer,
    pub(super) settings: Settings,
    pub(super) traits: Traits,
    pub(super) last: Option<Packet>,
    /// Frames submitted so far.
    n_begun: u64,
    /// When the last one ended.
    last_end: Instant,
    /// A frame went wrong on its way.
    pub(super) failed: bool,
}

/// A frame that was submitted and has not been waited for.
pub(super) struct InFlight {
    slot: usize,
    i_picture: usize,
    plan: Plan,
    recorded: [Instant; 2],
    submitted: Instant,
}

/// What a render step tells of itself.
pub struct Rendered {
    pub plan: Plan,
    /// When uploading, planning and recording began, and ended.
    pub recorded: [Instant; 2],
    /// When the device had been handed them.
    pub submitted: Instant,
    pub wait_ms: f64,
    pub passes: Vec<ScopeTime>,
    /// Particles that the device kept, where it was asked to.
    pub n_kept: Option<u32>,
}

impl Renderer {
    /// Checks the scene against the device's limits, then makes every pipeline and buffer it needs.
    /// `skip`: leave out what a frame does not need. What is "auto" changes nothing until it is
    /// chosen.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        skip: bool,
    ) -> Result<Renderer> {
        let free = device.limits().device_memory_bytes - limits::check(scene, device.limits())?;
        let scene = &*scene.exact();
        let groups = scene.groups();
        let n_particles = scene.n_particles() as u32;
        let settings = Settings::of(scene);
        let host_places = scene.threads.simulate == Simulate::Cpu;
        let mut host = Commands::new(device, "frame.host")?;
        let (tensors, tensor) = tensor_stage(device, compiler, &mut host, scene, free)?;
        let two_reflections = scene.lighting.mode == LightingMode::TwoReflection;
        // Tensors hold every pair.
        let tree = tensor.is_none() && gathers_from_tree(scene);
        let second = match two_reflections {
            true => Some(Relay::new(device, compiler, &mut host, scene, tree)?),
            false => None,
        };
        let grouped = is_grouped(scene);
        let grouping = match grouped {
            true => Some(Grouping::new(device, compiler, &mut host, scene)?),
            false => None,
        };
        let textured = scene.is_textured();
        let texture = textured.then(|| Texture::new(device, compiler)).transpose()?;
        let mut renderer = Renderer {
            frames: [Commands::new(device, "frame.even")?, Commands::new(device, "frame.odd")?],
            host,
            in_flight: VecDeque::with_capacity(IN_FLIGHT),
            generate: Generate::new(device, compiler)?,
            lives: Lives::of_scene(device, compiler, scene)?,
            place: PlacePass::new(device, compiler)?,
            grid: Grid::new(device, compiler, limits::n_cells_max(scene))?,
            facets: Facets::new(device, compiler, scene.has_ellipsoids())?,
            grouping,
            transmit: Transmit::new(
                device,
                compiler,
                has_second(scene),
                &scene.lighting.sums.into(),
            )?,
            first: First::new(device, compiler)?,
            second,
            tensor,
            culling: Culling::of_scene(device, compiler, scene)?,
            sort: Sort::new(device, compiler, n_particles)?,
            texture,
            buffers: Buffers::new(device, scene, &groups, host_places)?,
            drawing: Drawing::new(device, compiler, scene, settings.format)?,
            i_ended_picture: 0,
            readback: Buffer::new::<u8>(
                device,
                "film.readback",
                settings.n_bytes(),
                MemoryUsage::Readback,
            )?,
            settings,
            traits: Traits::of(scene, tensors, skip),
            last: None,
            n_begun: 0,
            last_end: Instant::now(),
            failed: false,
        };
        renderer.buffers.fill(device, &mut renderer.host, scene, &groups)?;
        Ok(renderer)
    }

    /// Draws one frame and waits for it.
    pub fn step(&mut self, packet: Packet) -> Result<Rendered> {
        self.begin(packet)?.wait()?;
        self.end()
    }

    /// Uploads, records and submits a frame, and gives what can be waited for. At most
    /// [`IN_FLIGHT`] frames may have begun and not ended.
    pub fn begin(&mut self, packet: Packet) -> Result<Submission> {
        if self.failed {
            return Err(Error::usage(
                "a frame has failed: what the device holds is not known any more",
            ));
        }
        if self.in_flight.len() == IN_FLIGHT {
            return Err(Error::usage(format!(
                "{IN_FLIGHT} frames are in flight; one must end before the next begins"
            )));
        }
        // Until all of it has gone well the device and what is remembered of it may differ.
        self.failed = true;
        let pending = self.submit(packet)?;
        self.failed = false;
        Ok(pending)
    }

    fn submit(&mut self, packet: Packet) -> Result<Submission> {
        let begin = Instant::now();
        let _zone = info_span!("render step").entered();
        let plan = info_span!("plan").in_scope(|| {
            let plan = plan(&self.traits, self.last.as_ref(), &packet);
            self.drawing.decide(plan, &packet)
        });
        let slot = (self.n_begun % IN_FLIGHT as u64) as usize;
        if plan.runs(Pass::Surfaces)
            || plan.runs(Pass::Terrain)
            || plan.runs(Pass::Sprites)
            || plan.runs(Pass::Tiles)
        {
            self.drawing.turn();
        }
        info_span!("upload").in_scope(|| self.write(slot, &packet))?;
        self.record(slot, &packet, &plan)?;
        let recorded = [begin, Instant::now()];
        let pending = self.frames[slot].submit()?;
        let (i_picture, submitted) = (self.drawing.i_picture(), Instant::now());
        self.in_flight.push_back(InFlight { slot, i_picture, plan, recorded, submitted });
        self.n_begun += 1;
        self.last = Some(packet);
        Ok(pending)
    }

    /// Waits for the oldest frame in flight and gives what it tells.
    pub fn end(&mut self) -> Result<Rendered> {
        let frame =
            self.in_flight.pop_front().ok_or_else(|| Error::usage("no frame is in flight"))?;
        self.failed = true;
        let passes = self.frames[frame.slot].wait()?;
        self.failed = false;
        self.i_ended_picture = frame.i_picture;
        let now = Instant::now();
        // What was waited for the frame before is that one's.
        let wait_ms = ms(frame.submitted.max(std::mem::replace(&mut self.last_end, now)), now);
        let InFlight { plan, recorded, submitted, .. } = frame;
        let n_kept = self.culling.as_ref().map(|c| c.n_kept(frame.slot)).transpose()?;
        Ok(Rendered { plan, recorded, submitted, wait_ms, passes, n_kept })
    }

    /// Waits for every frame in flight, of which nothing is wanted.
    pub fn drain(&mut self) {
        // What went wrong was or will be told by whoever asks for a frame.
        while !self.in_flight.is_empty() && self.end().is_ok() {}
        self.in_flight.clear();
    }

    /// Forgets the last frame: the next one does everything, as the first did.
    pub fn reset(&mut self) {
        (self.last, self.traits.made) = (None, false);
    }

    /// Whether the next frames leave out what they do not need.
    pub fn set_skip(&mut self, skip: bool) {
        self.traits.skip = skip;
    }

    /// From the next frame on as if everything moved in each: what a run makes once is kept, all
    /// else is done anew.
    pub fn move_all(&mut self) {
        (self.traits.skip, self.traits.keeps_made) = (false, true);
    }

    fn write(&mut self, slot: usize, packet: &Packet) -> Result<()> {
        self.buffers.write(slot, packet)?;
        if let Some(lives) = &mut self.lives {
            lives.write(slot, packet)?;
        }
        if let Some(grouping) = &mut self.grouping {
            grouping.write(slot, packet)?;
        }
        if let Some(second) = &mut self.second {
            second.write(slot, packet)?;
        }
        match &mut self.tensor {
            Some(tensor) => tensor.write(slot, packet),
            None => Ok(()),
        }
    }

    /// The frame, pass by pass.
    fn record(&mut self, slot: usize, packet: &Packet, plan: &Plan) -> Result<()> {
        let Renderer {
            generate,
            lives,
            place,
            grid,
            facets,
            grouping,
            transmit,
            first,
            second,
            tensor,
            culling,
            sort,
            texture,
            buffers: b,
            drawing,
            settings: s,
            frames,
            ..
        } = self;
        let n = s.n_particles;
        frames[slot].record(Barriers::Placed, |rec| {
            b.record_feeds(rec, slot);
            grouping.iter().for_each(|g| g.record_feeds(rec, slot));
            lives.iter().for_each(|l| l.record_feeds(rec, slot));
            second.iter().for_each(|s| s.record_feeds(rec, slot));
            tensor.iter().for_each(|t| t.record_feeds(rec, slot));
            pass(rec, plan, Pass::Generate, |rec| {
                generate.record(
                    rec,
                    [&b.boxes, &b.i_group, &b.particles, &b.status],
                    n,
                    MAX_ATTEMPTS,
                )
            })?;
            pass(rec, plan, Pass::Live, |rec| {
                lives.iter().try_for_each(|l| l.record(rec, slot, &b.particles))
            })?;
            pass(rec, plan, Pass::Place, |rec| match &b.placed {
                Placed::ByHost(feed) => {
                    feed.record(rec, slot);
                    Ok(())
                }
                Placed::ByDevice(placed) => place.record(
                    rec,
                    [&b.particles, &b.i_group, &b.groups.buffer, &b.modes.buffer, placed],
                    n,
                ),
            })?;
            let placed = b.placed.buffer();
            pass(rec, plan, Pass::Grid, |rec| {
                grid.record(
                    rec,
                    [placed, &b.particles, &b.density],
                    &packet.grid,
                    n,
                    packet.heaviest,
                )
            })?;
            pass(rec, plan, Pass::Morton, |rec| {
                grouping.as_ref().map_or(Ok(()), |g| g.record_order(rec, b))
            })?;
            pass(rec, plan, Pass::Facets, |rec| {
                match grouping {
                    Some(grouping) => grouping.record_facets(rec, facets, b, packet)?,
                    None => {
                        let buffers = [
                            placed,
                            &b.particles,
                            &b.i_group,
                            &b.groups.buffer,
                            &b.density,
                            &b.facets,
                        ];
                        facets.record(rec, buffers, &packet.grid, n, s.n_solid_facets)?;
                    }
                }
                let n_surface_facets = s.n_surface_facets;
                facets.record_surfaces(
                    rec,
                    [&b.regions.buffer, &b.i_region, &b.facets],
                    n_surface_facets,
                )?;
                let n_ground = s.n_solid_facets - n_surface_facets;
                facets.record_terrain(
                    rec,
                    [&b.regions.buffer, &b.ground, &b.facets],
                    n_ground,
                    n_surface_facets,
                )
            })?;
            pass(rec, plan, Pass::Transmit, |rec| {
                let buffers = [
                    &b.facets,
                    &b.lights.buffer,
                    &b.regions.buffer,
                    &b.density,
                    &b.transmittance,
                    &b.through,
                ];
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
                let from = [
                    &b.facets,
                    &b.lights.buffer,
                    &b.transmittance,
                    &b.regions.buffer,
                    &b.table.buffer,
                    &b.lit,
                ];
                let push = FirstPush {
                    eye: packet.camera.eye,
                    n_facets: s.n_facets,
                    n_lights: s.n_lights,
                };
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
            pass(rec, plan, Pass::Cull, |rec| {
                culling.as_ref().map_or(Ok(()), |c| c.record(rec, b, (packet, drawing), s))
            })?;
            culling.iter().for_each(|c| c.record_count(rec, b, slot));
            pass(rec, plan, Pass::Sort, |rec| record_sort(rec, sort, b, packet, s))?;
            pass(rec, plan, Pass::Texture, |rec| {
                texture.iter().try_for_each(|t| t.record(rec, &b.pool, s.texture_seed))
            })?;
            drawing.record(rec, plan, b, packet, s)
        })
    }
}
