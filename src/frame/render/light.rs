//! The light of a frame: every dispatch from the lights to the light of the facets, in order.

use super::pass;
use crate::error::Result;
use crate::frame::buffers::SceneBuffers;
use crate::frame::frame_passes::FramePasses;
use crate::frame::gather::GatherScratch;
use crate::frame::morton_sort::{KEY_BITS, MortonBuffers, MortonSort};
use crate::frame::packet::Packet;
use crate::frame::plan::{Pass, Plan};
use crate::frame::tensors::{TensorBuffers, bright_lights};
use crate::gpu::Recorder;
use crate::passes::contract::ContractBuffers;
use crate::passes::diffusion::{DiffusionBuffers, DiffusionWork, SolidsWork};
use crate::passes::first::{self, FirstBuffers};
use crate::passes::relief::ReliefBuffers;
use crate::passes::scatter::{ScatterBuffers, ScatterParams};
use crate::passes::second::{MergePush, SourcesPush};
use crate::passes::sort::Count;
use crate::passes::transmit::{MAX_STEPS, TransmitBuffers};

impl FramePasses {
    /// Lights the facets.
    pub(super) fn record_light(
        &self,
        rec: &mut Recorder<'_>,
        packet: &Packet,
        plan: &Plan,
    ) -> Result<()> {
        let FramePasses { relief, transmit, first, tensors, constants: c, .. } = self;
        let SceneBuffers {
            facets,
            lights,
            regions,
            density,
            transmittance,
            through,
            ground,
            relief: nodes,
            hidden,
            table,
            lit,
            ..
        } = &self.buffers;
        pass(rec, plan, Pass::Relief, |rec| {
            let Some(relief) = relief else { return Ok(()) };
            let buffers = ReliefBuffers { ground, lights, regions, nodes, hidden };
            relief.record(rec, &buffers, &c.relief())
        })?;
        pass(rec, plan, Pass::Transmit, |rec| {
            let buffers = TransmitBuffers {
                facets,
                lights,
                regions,
                density,
                transmittance,
                through,
                hidden,
            };
            transmit.record(rec, &buffers, &packet.grid, &c.march)
        })?;
        pass(rec, plan, Pass::First, |rec| {
            let buffers = FirstBuffers { facets, lights, transmittance, regions, table, lit };
            if let Some(tensors) = tensors {
                let push = tensors.first_push(packet, c);
                return tensors.first.record(rec, &buffers, &tensors.buffers.t1, &push);
            }
            let (eye, n_facets) = (packet.camera.eye, c.march.n_facets);
            first.record(rec, &buffers, &first::Push { eye, n_facets, n_lights: c.march.n_lights })
        })?;
        self.record_medium(rec, packet, plan)?;
        pass(rec, plan, Pass::Second, |rec| self.record_second(rec, packet, plan))?;
        pass(rec, plan, Pass::Contract, |rec| {
            let Some(tensors) = tensors else { return Ok(()) };
            let TensorBuffers { t1, t2, spans, coefficients } = &tensors.buffers;
            let buffers =
                ContractBuffers { facets, lights, regions, coefficients, t1, t2, spans, lit };
            tensors.contract.record(rec, &buffers, &tensors.contract_push(c))
        })
    }

    /// Lights clouds as a medium.
    fn record_medium(&self, rec: &mut Recorder<'_>, packet: &Packet, plan: &Plan) -> Result<()> {
        let FramePasses { diffusion, scatter, constants: c, .. } = self;
        let SceneBuffers {
            facets,
            lights,
            regions,
            density,
            transmittance,
            table,
            lit,
            media,
            field,
            slopes,
            patches,
            seen,
            ..
        } = &self.buffers;
        pass(rec, plan, Pass::Diffusion, |rec| {
            let (Some(diffusion), Some(params)) = (diffusion, &packet.diffusion) else {
                return Ok(());
            };
            let depths = transmittance;
            let buffers =
                DiffusionBuffers { lights, regions, density, facets, depths, field, patches };
            let work = DiffusionWork {
                n_lights: c.march.n_lights,
                n_surfaces: c.march.n_surfaces,
                step_cells: c.march.step_cells,
                max_steps: MAX_STEPS,
                n_cycles: c.n_cycles,
                n_bounces: c.n_bounces,
                solids: SolidsWork {
                    n_facets: c.n_solid_facets,
                    n_lights: c.march.n_lights,
                    lift: c.longest_facet_edge,
                    forward: c.forward,
                },
            };
            diffusion.record(rec, &buffers, &packet.grid, params, &work)
        })?;
        pass(rec, plan, Pass::Scatter, |rec| {
            let Some(scatter) = scatter else { return Ok(()) };
            let depths = transmittance;
            if let (Some(diffusion), Some(params)) = (diffusion, &packet.diffusion) {
                let of = (params, c.march.n_lights, packet.camera.eye);
                diffusion.record_seen(rec, [lights, field, seen], &packet.grid, of)?;
            }
            let buffers = ScatterBuffers {
                facets,
                lights,
                depths,
                regions,
                table,
                lit,
                media,
                field,
                slopes,
                patches,
                seen,
            };
            let of = ScatterParams {
                eye: packet.camera.eye,
                n_facets: c.march.n_facets,
                n_lights: c.march.n_lights,
                n_solids: c.n_solids,
                backward: c.backward(packet),
                n_terms: c.terms.n,
                term: [c.terms.light, c.terms.depth, c.terms.phase],
                scattered: packet.diffusion.map_or([1.0; 3], |of| of.scattered()),
            };
            scatter.record(rec, &buffers, &packet.grid, &of)
        })
    }

    /// Gathers the second reflection: at once, or light by light into the tensor T2.
    fn record_second(&self, rec: &mut Recorder<'_>, packet: &Packet, plan: &Plan) -> Result<()> {
        let FramePasses { gather, tensors, buffers: b, constants: c, .. } = self;
        let Some(gather) = gather else { return Ok(()) };
        let (n_facets, n_lights) = (c.march.n_facets, c.march.n_lights);
        let n_surfaces = c.march.n_surfaces;
        // The order follows from the facets alone.
        if let Some(order) = gather.order.as_ref().filter(|_| plan.runs(Pass::Facets)) {
            let MortonSort { morton, sort, buffers: MortonBuffers { entries, bounds } } = order;
            morton.record_facets(rec, [&b.facets, bounds, entries], n_facets, c.n_regions)?;
            sort.record(rec, entries, KEY_BITS, Count::Known(n_facets))?;
            morton.record_order(rec, [entries, &gather.places], n_facets)?;
        }
        // Sources send the same light wherever the eye is.
        if !plan.view_only() {
            let push = SourcesPush { n_facets, n_lights, n_surfaces };
            gather.second.record_sources(rec, &gather.source_buffers(b), &push)?;
            let GatherScratch { sources, fluxes, .. } = &gather.sources;
            for (i_first, n_merges) in gather.heights.iter().copied() {
                let push = MergePush { i_first, n_merges, n_lights };
                let buffers = [&gather.merges, &gather.nodes, sources, fluxes];
                gather.second.record_merge(rec, buffers, &push)?;
            }
        }
        for range in gather.blocks(plan.view_only()) {
            let blocks = (range.receivers, range.n);
            let Some(tensors) = tensors else {
                let buffers = gather.gather_buffers(b, &gather.nodes, &b.lit);
                rec.copy(&gather.rounds_at_rest, &gather.rounds);
                for push in gather.pushes(packet, range) {
                    gather.second.record(rec, &buffers, &push, blocks)?;
                }
                continue;
            };
            let Some(second) = &tensors.second else { continue };
            let buffers = gather.gather_buffers(b, &b.lit, &tensors.buffers.t2);
            for (k, i_light) in bright_lights(&packet.lights).enumerate() {
                rec.copy(&gather.rounds_at_rest, &gather.rounds);
                for push in gather.pushes(packet, range) {
                    let push = tensors.second_push(&push, i_light, k == 0);
                    second.record(rec, &buffers, &push, blocks)?;
                }
            }
        }
        Ok(())
    }
}
