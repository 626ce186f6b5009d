//! The second reflection and what it is gathered with.

use super::buffers::Buffers;
use super::exchange::{Exchange, is_glossy, turns};
use super::feed::Feed;
use super::packet::Packet;
use super::plan::{Pass, Plan};
use super::tensor::TensorStage;
use crate::error::Result;
use crate::gpu::{Buffer, Commands, Compiler, Device, MemoryUsage, Recorder};
use crate::layout::facet::RegionBoundsRecord;
use crate::model::scene::{Pairs, Scene};
use crate::passes::morton::Morton;
use crate::passes::second::{GatherPush, MergePush, Receivers, Second, SourcesPush};
use crate::passes::sort::Sort;

pub struct Relay {
    second: Second,
    exchange: Exchange,
    order: Option<Order>,
    n_facets: u32,
    n_lights: u32,
    n_surfaces: u32,
    step_cells: f64,
    backward: f64,
    pairs: Pairs,
    theta: f64,
}

/// What puts the facets into Morton order, where there is a tree over them.
struct Order {
    morton: Morton,
    sort: Sort,
    entries: Buffer,
    bounds: Feed,
    n_regions: u32,
}

impl Relay {
    /// `tree`: gather from clusters.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        commands: &mut Commands,
        scene: &Scene,
        tree: bool,
    ) -> Result<Relay> {
        let shiny = (0..scene.n_regions()).any(|i| is_glossy(scene, i));
        let traits = [scene.n_particles() > 0, tree, shiny];
        let second =
            Second::new(device, compiler, traits, turns(scene), &scene.lighting.sums.into())?;
        let exchange = Exchange::new(device, commands, scene, second.block_len(), tree)?;
        let lighting = &scene.lighting;
        Ok(Relay {
            second,
            exchange,
            order: if tree { Some(Order::new(device, compiler, scene)?) } else { None },
            n_facets: scene.n_facets() as u32,
            n_lights: scene.lights.len() as u32,
            n_surfaces: scene.surfaces.len() as u32,
            step_cells: lighting.step,
            backward: 1.0 - lighting.forward,
            pairs: lighting.pairs,
            theta: lighting.theta,
        })
    }

    pub fn write(&mut self, slot: usize, packet: &Packet) -> Result<()> {
        self.order.as_mut().map_or(Ok(()), |order| order.bounds.write(slot, &packet.bounds))
    }

    /// Copies what was written to where shaders read it.
    pub fn record_feeds(&self, rec: &mut Recorder<'_>, slot: usize) {
        if let Some(order) = &self.order {
            order.bounds.record(rec, slot);
        }
    }

    /// Gathers at once, or into `tensor` where there is one.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        plan: &Plan,
        b: &Buffers,
        packet: &Packet,
        tensor: Option<&TensorStage>,
    ) -> Result<()> {
        let x = &self.exchange;
        let gathered: &[Receivers] = match plan.view_only() {
            true => &[Receivers::Glossy],
            false => &[Receivers::Diffuse, Receivers::Glossy],
        };
        // The order follows from the facets alone.
        if let Some(order) = self.order.as_ref().filter(|_| plan.runs(Pass::Facets)) {
            order.record(rec, b, &x.order, self.n_facets)?;
        }
        // Sources send the same wherever they are seen from.
        if !plan.view_only() {
            self.record_sources(rec, b)?;
        }
        for (receivers, i_first_block, n_blocks) in x.blocks(gathered) {
            let rounds: Vec<GatherPush> =
                x.rounds().map(|of| self.push(packet, i_first_block, of)).collect();
            if let Some(tensor) = tensor {
                tensor.record_second(rec, b, x, packet, &rounds, receivers, n_blocks)?;
                continue;
            }
            x.start_rounds(rec);
            for push in &rounds {
                self.second.record(
                    rec,
                    x.bindings(b, &x.nodes, &b.lit),
                    push,
                    receivers,
                    n_blocks,
                )?;
            }
        }
        Ok(())
    }

    fn push(
        &self,
        packet: &Packet,
        i_first_block: u32,
        [i_round, n_rounds]: [u32; 2],
    ) -> GatherPush {
        GatherPush {
            grid: packet.grid,
            eye: packet.camera.eye,
            n_lights: self.n_lights,
            pair_size: self.pairs.size as f32,
            pair_levels: self.pairs.levels,
            step_length: self.step_cells as f32 * packet.grid.cell,
            backward: self.backward as f32,
            pair_steps: self.pairs.steps,
            i_first_block,
            theta: self.theta as f32,
            n_surfaces: self.n_surfaces,
            i_round,
            n_rounds,
        }
    }

    /// Facets as sources, then cluster by cluster.
    fn record_sources(&self, rec: &mut Recorder<'_>, b: &Buffers) -> Result<()> {
        let x = &self.exchange;
        let push = SourcesPush {
            n_facets: self.n_facets,
            n_lights: self.n_lights,
            n_surfaces: self.n_surfaces,
        };
        let buffers = [
            &b.facets,
            &b.lights.buffer,
            &b.transmittance,
            &b.through,
            &b.regions.buffer,
            &x.order,
            &x.leaves,
            &x.sources,
            &x.fluxes,
            &x.stencils,
        ];
        self.second.record_sources(rec, buffers, &push)?;
        for (i_first, n_merges) in x.heights.iter().copied() {
            let push = MergePush { i_first, n_merges, n_lights: self.n_lights };
            self.second.record_merge(rec, [&x.merges, &x.nodes, &x.sources, &x.fluxes], &push)?;
        }
        Ok(())
    }
}

impl Order {
    fn new(device: &Device, compiler: &Compiler, scene: &Scene) -> Result<Order> {
        let (n, n_regions) = (scene.n_facets(), scene.n_regions());
        Ok(Order {
            morton: Morton::new(device, compiler)?,
            sort: Sort::new(device, compiler, n as u32)?,
            entries: Buffer::new::<[u32; 2]>(device, "morton.entries", n, MemoryUsage::Device)?,
            bounds: Feed::new::<RegionBoundsRecord>(device, "morton.bounds", n_regions as u64)?,
            n_regions: n_regions as u32,
        })
    }

    fn record(
        &self,
        rec: &mut Recorder<'_>,
        b: &Buffers,
        order: &Buffer,
        n_facets: u32,
    ) -> Result<()> {
        self.morton.record_facets(
            rec,
            [&b.facets, &self.bounds.buffer, &self.entries],
            n_facets,
            self.n_regions,
        )?;
        self.sort.record(rec, &self.entries, n_facets, 32)?;
        self.morton.record_order(rec, [&self.entries, order], n_facets)
    }
}
