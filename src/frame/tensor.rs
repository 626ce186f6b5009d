//! The tensors T1 and T2 of a scene whose materials are edited: how they are laid out, and the
//! stage that fills and sums them (docs/model.md §11 "contract").

use super::buffers::{Buffers, upload};
use super::exchange::{Exchange, is_glossy, region_sizes, turns};
use super::feed::Feed;
use super::limits;
use super::packet::Packet;
use super::plan::Tensors;
use super::settings::Settings;
use crate::error::Result;
use crate::gpu::{Buffer, Commands, Compiler, Device, MemoryUsage, Recorder};
use crate::layout::facet::{REGION_CLOUD, REGION_COLORED, REGION_SURFACE, REGION_TERRAIN};
use crate::model::basis::Basis;
use crate::model::cloud::CloudSource;
use crate::model::material::Brdf;
use crate::model::pairings::pairings;
use crate::model::scene::{LightingMode, Scene};
use crate::passes::contract::{Contract, Push as ContractPush, TILE};
use crate::passes::first::{FirstTensor, TensorPush as FirstPush};
use crate::passes::second::{GatherPush, Receivers, SecondTensor, TensorPush as SecondPush};

/// The basis of a scene, where some lobe is to be computed.
pub fn basis_of(scene: &Scene) -> Option<Basis> {
    let l = &scene.lighting;
    let any = (0..scene.n_regions()).any(|i| is_glossy(scene, i));
    (any && l.mode != LightingMode::None).then(|| Basis::new(l.exponents, l.bases, l.sampling))
}

/// Whether materials of the scene are edited, so that tensors would be of use.
pub fn is_edited(scene: &Scene) -> bool {
    let edited = |i| scene.region_material(i).is_edited();
    scene.lighting.mode != LightingMode::None && (0..scene.n_regions()).any(edited)
}

/// The region's kind in its record.
pub fn kind_of(scene: &Scene, i_region: usize) -> u32 {
    let Some(i_other) = i_region.checked_sub(scene.surfaces.len()) else { return REGION_SURFACE };
    // The ground's facets are to the light what a cloud's are.
    let Some(i_cloud) = i_other.checked_sub(scene.terrains.len()) else { return REGION_TERRAIN };
    match scene.clouds[i_cloud].source {
        CloudSource::Boxes { .. } | CloudSource::Disc(_) | CloudSource::Animated(_) => REGION_CLOUD,
        CloudSource::Particles(_) => REGION_COLORED,
    }
}

/// Where a region lies in the tensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Block {
    /// Rows: for every basis of a receiver the facets of the region one after the other.
    pub i_row: u32,
    pub i_column: u32,
    /// Columns of the diffuse basis: 3 where facets have colours of their own.
    pub n_plain: u32,
    /// Columns, and bases of a receiver, of its lobe.
    pub n_vectors: u32,
}

/// T1 is [light][row], T2 [light][row / TILE][column][row % TILE]. Numbers, not bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    pub blocks: Vec<Block>,
    pub n_bases: u32,
    pub n_lights: u32,
    /// A multiple of TILE: the last ones may be no facet's.
    pub n_rows: u64,
    pub n_columns: u32,
    /// Without the second reflection there is no T2.
    pub has_second: bool,
}

impl Shape {
    /// `n_bases`: N_b as the basis has it, 1 without one.
    pub fn of(scene: &Scene, n_bases: u32) -> Shape {
        let (mut n_rows, mut n_columns) = (0u64, 0u32);
        let mut blocks = Vec::new();
        for (i, n_facets) in region_sizes(scene).into_iter().enumerate() {
            let n_plain = if kind_of(scene, i) == REGION_COLORED { 3 } else { 1 };
            let n_vectors = if is_glossy(scene, i) { n_bases - 1 } else { 0 };
            blocks.push(Block { i_row: n_rows as u32, i_column: n_columns, n_plain, n_vectors });
            n_rows += u64::from(n_facets) * u64::from(1 + n_vectors);
            n_columns += n_plain + n_vectors;
        }
        let n_rows = n_rows.next_multiple_of(u64::from(TILE));
        let has_second = scene.lighting.mode == LightingMode::TwoReflection;
        Shape {
            blocks,
            n_bases,
            n_lights: scene.lights.len() as u32,
            n_rows,
            n_columns,
            has_second,
        }
    }

    pub fn n_first(&self) -> u64 {
        u64::from(self.n_lights).saturating_mul(self.n_rows)
    }

    /// `None`: beyond 64 bits.
    pub fn n_second(&self) -> Option<u64> {
        let n_columns = if self.has_second { u64::from(self.n_columns) } else { 0 };
        self.n_first().checked_mul(n_columns)
    }

    /// C by column: K_d of the region (channel by channel where there are three), then K_s
    /// c_b(n_s). `brdfs` by region; `coefficients`: c_b of each.
    pub fn coefficients(
        &self,
        brdfs: &[Brdf],
        coefficients: impl Fn(usize) -> Vec<f64>,
    ) -> Vec<[f32; 4]> {
        let mut columns = Vec::with_capacity(self.n_columns as usize);
        for (i, (block, brdf)) in self.blocks.iter().zip(brdfs).enumerate() {
            let kd = brdf.kd.as_vec3();
            match block.n_plain {
                1 => columns.push(kd),
                _ => columns.extend([0, 1, 2].map(|c| kd * glam::Vec3::AXES[c])),
            }
            if block.n_vectors > 0 {
                columns.extend(coefficients(i).into_iter().map(|c| (brdf.ks * c).as_vec3()));
            }
        }
        columns.into_iter().map(|c| c.extend(0.0).to_array()).collect()
    }
}

impl Shape {
    /// By region (first, number) of its spans, then the spans: (first, number) of the columns of
    /// regions whose light can reach it. T2 holds nothing elsewhere.
    pub fn spans(&self, scene: &Scene) -> Vec<[u32; 2]> {
        let sizes = region_sizes(scene);
        let mut spans = vec![[0, 0]; sizes.len()];
        if !self.has_second {
            return spans;
        }
        for (i, from) in
            pairings(&scene.surfaces, scene.terrains.len() + scene.clouds.len()).iter().enumerate()
        {
            let first = spans.len();
            // Nothing is written for an emitter without facets.
            for block in
                from.iter().filter(|p| sizes[p.i_emitter] > 0).map(|p| self.blocks[p.i_emitter])
            {
                let n = block.n_plain + block.n_vectors;
                match spans[first..].last_mut() {
                    // Neighbours make one.
                    Some(last) if last[0] + last[1] == block.i_column => last[1] += n,
                    _ => spans.push([block.i_column, n]),
                }
            }
            spans[i] = [first as u32, (spans.len() - first) as u32];
        }
        spans
    }
}

/// The stage of the tensors where materials are edited and the tensors fit into `free` bytes.
pub fn tensor_stage(
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
        Tensors::Kept => {
            Ok((Tensors::Kept, Some(TensorStage::new(device, compiler, commands, scene, shape)?)))
        }
        other => Ok((other, None)),
    }
}

/// The tensors' passes and buffers.
pub struct TensorStage {
    first: FirstTensor,
    second: Option<SecondTensor>,
    contract: Contract,
    shape: Shape,
    t1: Buffer,
    t2: Buffer,
    spans: Buffer,
    /// Written by the host every frame.
    coefficients: Feed,
    /// First row of the basis' vectors in the table.
    i_vectors: u32,
}

impl TensorStage {
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        commands: &mut Commands,
        scene: &Scene,
        shape: Shape,
    ) -> Result<TensorStage> {
        let second = match shape.has_second {
            true => Some(SecondTensor::new(
                device,
                compiler,
                scene.n_particles() > 0,
                shape.n_bases,
                turns(scene),
            )?),
            false => None,
        };
        // One that has no number does not fit either; the limits have been asked before.
        let n_second = shape.n_second().unwrap_or(u64::MAX);
        let from_whom = shape.spans(scene);
        let spans = Buffer::new::<[u32; 2]>(
            device,
            "contract.spans",
            from_whom.len() as u64,
            MemoryUsage::Device,
        )?;
        upload(device, commands, &from_whom, &spans)?;
        Ok(TensorStage {
            spans,
            first: FirstTensor::new(device, compiler)?,
            second,
            contract: Contract::new(device, compiler, shape.n_bases, &scene.lighting.sums.into())?,
            t1: Buffer::new::<f32>(device, "first.t1", shape.n_first(), MemoryUsage::Device)?,
            t2: Buffer::new::<f32>(device, "second.t2", n_second, MemoryUsage::Device)?,
            coefficients: Feed::new::<[f32; 4]>(
                device,
                "contract.coefficients",
                u64::from(shape.n_columns),
            )?,
            i_vectors: scene.materials.len() as u32,
            shape,
        })
    }

    pub(super) fn write(&mut self, slot: usize, packet: &Packet) -> Result<()> {
        self.coefficients.write(slot, &packet.coefficients)
    }

    pub(super) fn record_feeds(&self, rec: &mut Recorder<'_>, slot: usize) {
        self.coefficients.record(rec, slot);
    }

    pub(super) fn record_first(
        &self,
        rec: &mut Recorder<'_>,
        b: &Buffers,
        packet: &Packet,
        s: &Settings,
    ) -> Result<()> {
        let push = FirstPush {
            eye: packet.camera.eye,
            n_facets: s.n_facets,
            n_lights: s.n_lights,
            n_bases: self.shape.n_bases,
            n_rows: self.shape.n_rows as u32,
            i_vectors: self.i_vectors,
        };
        let buffers = [
            &b.facets,
            &b.lights.buffer,
            &b.transmittance,
            &b.regions.buffer,
            &b.table.buffer,
            &self.t1,
            &b.lit,
        ];
        self.first.record(rec, buffers, &push)
    }

    /// A gather a light: one without energy costs nothing. `rounds`: what the gathers at once would
    /// be told.
    #[allow(clippy::too_many_arguments, reason = "what a gather is made of")]
    pub(super) fn record_second(
        &self,
        rec: &mut Recorder<'_>,
        b: &Buffers,
        x: &Exchange,
        packet: &Packet,
        rounds: &[GatherPush],
        receivers: Receivers,
        n_blocks: u32,
    ) -> Result<()> {
        let Some(second) = &self.second else { return Ok(()) };
        let lit = (0..).zip(&packet.lights).filter(|(_, light)| light.energy != [0.0; 3]);
        for (k, (i_light, _)) in lit.enumerate() {
            x.start_rounds(rec);
            for of in rounds {
                let push = self.second_push(of, i_light, k == 0);
                second.record(rec, x.bindings(b, &b.lit, &self.t2), &push, receivers, n_blocks)?;
            }
        }
        Ok(())
    }

    fn second_push(&self, of: &GatherPush, i_light: u32, is_first_light: bool) -> SecondPush {
        SecondPush {
            grid: of.grid,
            eye: of.eye,
            n_lights: of.n_lights,
            pair_size: of.pair_size,
            pair_levels: of.pair_levels,
            step_length: of.step_length,
            backward: of.backward,
            pair_steps: of.pair_steps,
            i_first_block: of.i_first_block,
            i_light,
            i_vectors: self.i_vectors,
            n_rows: self.shape.n_rows as u32,
            n_columns: self.shape.n_columns,
            n_surfaces: of.n_surfaces,
            i_round: of.i_round,
            n_rounds: of.n_rounds,
            is_first_light: u32::from(is_first_light),
        }
    }

    pub(super) fn record_contract(
        &self,
        rec: &mut Recorder<'_>,
        b: &Buffers,
        s: &Settings,
    ) -> Result<()> {
        let push = ContractPush {
            n_facets: s.n_facets,
            n_lights: s.n_lights,
            n_rows: self.shape.n_rows as u32,
            n_columns: self.shape.n_columns,
        };
        let buffers = [
            &b.facets,
            &b.lights.buffer,
            &b.regions.buffer,
            &self.coefficients.buffer,
            &self.t1,
            &self.t2,
            &self.spans,
            &b.lit,
        ];
        self.contract.record(rec, buffers, &push)
    }
}
