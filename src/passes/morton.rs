//! morton: facets, or particles, in the order of a space-filling curve, region by region.
//!
//! In: positions and their regions, the regions' bounds. Out: entries [key, index] for the sort of
//! 32 bits, and of the sorted entries the index at each place. Law: the region above, the Morton
//! code of the cell within the region's bounds below it. Source: docs/model.md §7, §11. Error: a
//! coordinate within some roundings of a cell's face may count to the cell beside.

use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, Kernel, Recorder};
use crate::layout::facet::KeyBits;
use crate::layout::record;

record! {
    pub struct KeyPush { n_points: u32, region_bits: u32, axis_bits: u32 }
}

record! {
    pub struct OrderPush { n_entries: u32 }
}

pub struct Morton {
    facets: Kernel,
    particles: Kernel,
    order: Kernel,
}

impl Morton {
    pub fn new(device: &Device, compiler: &Compiler) -> Result<Morton> {
        let key = |points: u32| {
            Kernel::with_macros(
                device,
                compiler,
                "morton.key",
                KeyPush::FIELDS,
                &[],
                &[("POINTS", points)],
            )
        };
        Ok(Morton {
            facets: key(0)?,
            particles: key(1)?,
            order: Kernel::new(device, compiler, "morton.order", OrderPush::FIELDS, &[])?,
        })
    }

    /// `facets`: FacetRecord; `bounds`: RegionBoundsRecord by region; `entries`: [key, facet].
    pub fn record_facets(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 3],
        n_facets: u32,
        n_regions: u32,
    ) -> Result<()> {
        rec.dispatch(&self.facets, &buffers, &key_push(n_facets, n_regions), n_facets)
    }

    /// `placed`: PlacedRecord; `i_group`: u32; `groups`: GroupRecord; `bounds`: RegionBoundsRecord
    /// by region; `entries`: [key, particle].
    pub fn record_particles(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 5],
        n_particles: u32,
        n_regions: u32,
    ) -> Result<()> {
        rec.dispatch(&self.particles, &buffers, &key_push(n_particles, n_regions), n_particles)
    }

    /// `entries`: [key, index], sorted; `order`: u32, the index at each place. Where regions are
    /// runs of indices, each has the same run of places.
    pub fn record_order(
        &self,
        rec: &mut Recorder<'_>,
        buffers: [&Buffer; 2],
        n_entries: u32,
    ) -> Result<()> {
        rec.dispatch(&self.order, &buffers, &OrderPush { n_entries }, n_entries)
    }
}

fn key_push(n_points: u32, n_regions: u32) -> KeyPush {
    let KeyBits { region, axis } = KeyBits::of(n_regions);
    KeyPush { n_points, region_bits: region, axis_bits: axis }
}
