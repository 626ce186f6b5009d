//! morton: orders facets or particles along a space-filling curve, region by region.
//!
//! In: positions, their regions, and the regions' bounds. Out: sort entries with 32-bit keys; of
//! sorted entries, the index at each place. Law: the region in the high bits, the Morton code of
//! the cell within the region's bounds below. Source: model.md §7, passes.md. Error: a
//! coordinate within some roundings of a cell's face may count to the adjacent cell.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::facet::KeyBits;
use crate::layout::record;

record! {
    /// Push constants of `morton_key.comp`.
    pub struct KeyPush {
        /// Number of facets or particles.
        n_points: u32,
        /// Bits of a key's region.
        region_bits: u32,
        /// Bits of a key's axis.
        axis_bits: u32,
    }
}

record! {
    /// Push constants of `morton_order.comp`.
    pub struct OrderPush {
        /// Number of entries.
        n_entries: u32,
    }
}

bindings! {
    /// The buffers that particles get their keys from.
    pub struct ParticleBuffers {
        /// `PlacedRecord` by particle.
        placed,
        /// `u32` group by particle.
        i_group,
        /// `GroupRecord` by group.
        groups,
        /// `RegionBoundsRecord` by region.
        bounds,
        /// Output, `[u32; 2]`: key and particle.
        entries,
    }
}

/// The pipelines of the pass.
pub struct Morton {
    facets: Kernel,
    particles: Kernel,
    order: Kernel,
}

impl Morton {
    /// Creates the pipelines.
    ///
    /// # Errors
    /// Fails if a shader does not compile or a pipeline cannot be created.
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Morton> {
        let key = |points: u32| {
            let macros = [("POINTS", points)];
            Kernel::with_macros(device, compiler, "morton.key", KeyPush::FIELDS, &[], &macros)
        };
        Ok(Morton {
            facets: key(0)?,
            particles: key(1)?,
            order: Kernel::new(device, compiler, "morton.order", OrderPush::FIELDS)?,
        })
    }

    /// Writes the keys of facets. `facets`: `FacetRecord`; `bounds`: `RegionBoundsRecord` by
    /// region; `entries`: `[u32; 2]`, key and facet.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_facets(
        &self,
        rec: &mut Recorder<'_>,
        [facets, bounds, entries]: [&Buffer; 3],
        n_facets: u32,
        n_regions: u32,
    ) -> Result<()> {
        let push = key_push(n_facets, n_regions);
        rec.dispatch(&self.facets, &[facets, bounds, entries], &push, n_facets)
    }

    /// Writes the keys of particles.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_particles(
        &self,
        rec: &mut Recorder<'_>,
        buffers: &ParticleBuffers<'_>,
        n_particles: u32,
        n_regions: u32,
    ) -> Result<()> {
        let push = key_push(n_particles, n_regions);
        rec.dispatch(&self.particles, &buffers.by_binding(), &push, n_particles)
    }

    /// Writes `order`, the `u32` index at each place of the sorted `entries`. A region whose
    /// indices are contiguous keeps the same range of places.
    ///
    /// # Errors
    /// Fails if a buffer does not fit the shader's binding.
    pub fn record_order(
        &self,
        rec: &mut Recorder<'_>,
        [entries, order]: [&Buffer; 2],
        n_entries: u32,
    ) -> Result<()> {
        rec.dispatch(&self.order, &[entries, order], &OrderPush { n_entries }, n_entries)
    }
}

fn key_push(n_points: u32, n_regions: u32) -> KeyPush {
    let KeyBits { region, axis } = KeyBits::of(n_regions);
    KeyPush { n_points, region_bits: region, axis_bits: axis }
}
