//! The whole frame on one page: every dispatch and draw call in order, with its buffers.
//! The light has a page of its own.

mod light;

use super::buffers::SceneBuffers;
use super::culling::{cull_view, key_depths};
use super::frame_passes::FramePasses;
use super::live::LiveParticles;
use super::merging::drawn;
use super::morton_sort::{FacetRuns, KEY_BITS, MortonBuffers, MortonSort, RunBuffers};
use super::packet::Packet;
use super::plan::{Pass, Plan};
use crate::error::Result;
use crate::gpu::{DeviceCount, RecordCount, Recorder};
use crate::layout::cull::KeptRecord;
use crate::model::boxes::MAX_ATTEMPTS;
use crate::passes::blobs::{BlobBuffers, BlobCount};
use crate::passes::cull::{CullBuffers, Order};
use crate::passes::facets;
use crate::passes::grid::Deposit;
use crate::passes::haze::HazeBuffers;
use crate::passes::morton;
use crate::passes::place::PlaceBuffers;
use crate::passes::sort::{Count, TILE};
use crate::passes::tiles::BLOCK;

/// Records a pass under its timer label if the plan runs it.
fn pass(
    rec: &mut Recorder<'_>,
    plan: &Plan,
    pass: Pass,
    f: impl FnOnce(&mut Recorder<'_>) -> Result<()>,
) -> Result<()> {
    if plan.runs(pass) { rec.scope(pass.name(), f) } else { Ok(()) }
}

impl FramePasses {
    /// Records the frame of `packet`, whose data is in the staging buffers of `slot`.
    pub fn record(
        &mut self,
        rec: &mut Recorder<'_>,
        slot: usize,
        packet: &Packet,
        plan: &Plan,
    ) -> Result<()> {
        self.record_copies(rec, slot);
        self.record_particles(rec, slot, packet, plan)?;
        self.record_facets(rec, packet, plan)?;
        self.record_light(rec, packet, plan)?;
        self.record_haze(rec, packet, plan)?;
        self.record_picture(rec, packet, plan)?;
        if let Some(culling) = &self.culling {
            rec.copy(&self.buffers.kept, &culling.counts.counts.0[slot]);
        }
        Ok(())
    }

    /// Copies the host's data of the frame to where shaders read it.
    fn record_copies(&self, rec: &mut Recorder<'_>, slot: usize) {
        self.buffers.record_copies(rec, slot);
        if let Some(LiveParticles::Device { buffers, .. }) = &self.live {
            buffers.discs.record_copy(rec, slot);
        }
        let order = self.gather.iter().filter_map(|gather| gather.order.as_ref());
        for sort in self.runs.iter().map(|runs| &runs.sort).chain(order) {
            sort.buffers.bounds.record_copy(rec, slot);
        }
        if let Some(tensors) = &self.tensors {
            tensors.buffers.coefficients.record_copy(rec, slot);
        }
    }

    /// Generates and places the particles, and deposits them in the density grid.
    fn record_particles(
        &self,
        rec: &mut Recorder<'_>,
        slot: usize,
        packet: &Packet,
        plan: &Plan,
    ) -> Result<()> {
        let FramePasses { generate, live, place, placed_uploads, grid, constants: c, .. } = self;
        let SceneBuffers {
            boxes, i_group, particles, status, groups, modes, placed, density, ..
        } = &self.buffers;
        let coefficients = &self.buffers.harmonics;
        let n = c.n_particles;
        pass(rec, plan, Pass::Generate, |rec| {
            generate.record(rec, [boxes, i_group, particles, status], [0, n], MAX_ATTEMPTS)
        })?;
        pass(rec, plan, Pass::Live, |rec| match live {
            Some(LiveParticles::Device { live, buffers, counts }) => {
                let mut discs = (0..).zip(counts).filter(|(_, n)| **n > 0);
                discs.try_for_each(|(i, n)| live.record(rec, [&buffers.discs, particles], i, *n))
            }
            Some(LiveParticles::Host(uploads)) => {
                rec.copy(&uploads.particles.0[slot], particles);
                Ok(())
            }
            None => Ok(()),
        })?;
        pass(rec, plan, Pass::Place, |rec| match placed_uploads {
            Some(uploads) => {
                uploads.placed.record_copy(rec, slot, placed);
                Ok(())
            }
            None => {
                place.record(rec, &PlaceBuffers { particles, i_group, groups, modes, placed }, n)
            }
        })?;
        pass(rec, plan, Pass::Harmonics, |rec| {
            let all = [placed, coefficients, particles];
            let mut harmonics = self.harmonics.iter();
            harmonics.try_for_each(|h| h.record(rec, all, packet.camera.eye, &self.colored))
        })?;
        pass(rec, plan, Pass::Lod, |rec| {
            let mut merging = self.merging.iter();
            merging.try_for_each(|m| m.record(rec, &self.buffers, n, packet.sigma_max))
        })?;
        pass(rec, plan, Pass::Grid, |rec| {
            let Packet { grid: of, heaviest, n_levels, n_blurs, .. } = packet;
            let (heaviest, n_levels, n_blurs) = (*heaviest, *n_levels, *n_blurs);
            let deposit = Deposit { grid: of, n_particles: n, heaviest, n_levels, n_blurs };
            grid.record(rec, [placed, particles, density], &deposit)
        })
    }

    /// Places the facets.
    fn record_facets(&self, rec: &mut Recorder<'_>, packet: &Packet, plan: &Plan) -> Result<()> {
        let FramePasses { runs, facets: pass_facets, constants: c, .. } = self;
        let SceneBuffers {
            placed,
            particles,
            i_group,
            groups,
            density,
            regions,
            i_region,
            ground,
            facets,
            i_facet,
            ..
        } = &self.buffers;
        let n = c.n_particles;
        pass(rec, plan, Pass::Morton, |rec| {
            let Some(runs) = runs else { return Ok(()) };
            let MortonSort { morton, sort, buffers: MortonBuffers { entries, bounds } } =
                &runs.sort;
            let from = morton::ParticleBuffers { placed, i_group, groups, bounds, entries };
            morton.record_particles(rec, &from, n, c.n_regions)?;
            sort.record(rec, entries, KEY_BITS, Count::Known(n))?;
            morton.record_order(rec, [entries, &runs.buffers.order], n)
        })?;
        pass(rec, plan, Pass::Facets, |rec| {
            let (n_surface, n_solid) = (c.n_surface_facets, c.n_solid_facets);
            let (grid, from) = (
                &packet.grid,
                facets::ParticleBuffers { placed, particles, i_group, groups, density, facets },
            );
            match runs {
                Some(FacetRuns { buffers: RunBuffers { order, runs }, n_runs, .. }) => {
                    let by_run = [order, runs, i_facet];
                    pass_facets.record_runs(rec, &from, by_run, grid, *n_runs, n_solid)?
                }
                None => pass_facets.record(rec, &from, grid, n, n_solid)?,
            }
            pass_facets.record_surfaces(rec, [regions, i_region, facets], n_surface)?;
            let n_ground = n_solid - n_surface;
            pass_facets.record_terrain(rec, [regions, ground, facets], n_ground, n_surface)
        })
    }

    /// Puts the air before the facets.
    fn record_haze(&self, rec: &mut Recorder<'_>, packet: &Packet, plan: &Plan) -> Result<()> {
        let FramePasses { haze, buffers, constants, .. } = self;
        let SceneBuffers { facets, lit, slopes, sky, hazed, hazed_slopes, .. } = buffers;
        let SceneBuffers { transmittance: arriving, seas, .. } = buffers;
        let all = HazeBuffers { facets, lit, slopes, sky, hazed, hazed_slopes, arriving, seas };
        pass(rec, plan, Pass::Haze, |rec| {
            haze.iter().try_for_each(|haze| haze.record(rec, &all, &constants.haze(packet)))
        })
    }

    /// Selects and sorts the particles, and draws the picture.
    pub fn record_picture(
        &mut self,
        rec: &mut Recorder<'_>,
        packet: &Packet,
        plan: &Plan,
    ) -> Result<()> {
        let FramePasses {
            merging,
            culling,
            sort,
            texture,
            picture,
            buffers: b,
            constants: c,
            features,
            ..
        } = self;
        let [lit, _] = b.shown_light(features.has_haze);
        let [placed, particles] = drawn(merging, b);
        let SceneBuffers { i_group, drawn, entries, kept, .. } = &*b;
        let (blob_camera, blob_size) = picture.blob_camera(&packet.camera, c);
        let depths = key_depths(packet, c);
        pass(rec, plan, Pass::Cull, |rec| {
            let Some(culling) = culling else { return Ok(()) };
            let buffers = CullBuffers { placed, particles, i_group, drawn, entries, kept };
            let view = cull_view(&blob_camera, blob_size, packet, c);
            let order = Order { depths, sort_tile: TILE, splat_block: BLOCK };
            culling.cull.record(rec, &buffers, &view, &order, c.n_particles)
        })?;
        pass(rec, plan, Pass::Sort, |rec| {
            let n_bits = depths.n_bits;
            if culling.is_some() {
                let (i_count, i_groups) = (KeptRecord::I_COUNT, KeptRecord::I_SORT);
                let n = Count::Counted(DeviceCount { buffer: kept, i_count, i_groups });
                return sort.record(rec, entries, n_bits, n).map(|_| ());
            }
            sort.record_keys(rec, [placed, i_group, drawn, entries], &depths, c.n_particles)?;
            sort.record(rec, entries, n_bits, Count::Known(packet.n_drawn)).map(|_| ())
        })?;
        pass(rec, plan, Pass::Texture, |rec| {
            texture.iter().try_for_each(|texture| texture.record(rec, &b.pool, c.texture_seed))
        })?;

        let (i, camera) = (picture.i, &packet.camera);
        for draws in [Pass::Surfaces, Pass::Terrain] {
            pass(rec, plan, draws, |rec| {
                if let (Some(solids), Some(target)) = (&picture.solids, picture.full.target(i)) {
                    solids.record(rec, draws, (b, lit), target, camera)?;
                }
                let mut low_res = picture.low_res.iter_mut();
                low_res.try_for_each(|low_res| low_res.record_solids(rec, draws, b, camera))
            })?;
        }

        let n = if culling.is_some() {
            RecordCount::Indirect(kept)
        } else {
            RecordCount::Known(packet.n_drawn)
        };
        let count = BlobCount { n, i_first_facet: c.n_solid_facets };
        let view = c.view(camera, packet);
        let all = BlobBuffers { placed, particles, ..b.of_blobs(features.has_haze) };
        pass(rec, plan, Pass::Impostors, |rec| {
            match (&mut picture.impostors, picture.full.target(i)) {
                (Some(impostors), Some(target)) => {
                    impostors.record(rec, &all, &view, count, packet, target)
                }
                _ => Ok(()),
            }
        })?;
        let layer = picture.impostors.as_ref().filter(|impostors| impostors.has_layer());
        let entries = layer.map_or(all.entries, |layer| &layer.buffers.near);
        let (blobs, has_layer) = (BlobBuffers { entries, ..all }, layer.is_some());
        for draws in [Pass::Sprites, Pass::Tiles] {
            pass(rec, plan, draws, |rec| match &mut picture.low_res {
                Some(low_res) => {
                    let view = c.view(&blob_camera, packet);
                    low_res.target.record_blobs(rec, 0, false, &blobs, &view, count)
                }
                None => picture.full.record_blobs(rec, i, has_layer, &blobs, &view, count),
            })?;
        }
        pass(rec, plan, Pass::Upsample, |rec| match &mut picture.low_res {
            Some(low_res) => low_res.record_upsample(rec, i, &mut picture.full),
            None => Ok(()),
        })
    }
}
