//! Records that the second reflection is gathered from (model.md §7).

use crate::layout::record;

record! {
    /// A source of light: a facet, or a cluster of facets of one region. Fields have four words,
    /// since a device that loads for each invocation by itself pays by the load.
    pub struct SourceRecord {
        /// Position (a cluster's mean by flux), and the radius that holds all its points.
        place: [f32; 4],
        /// Diffuse flux Σ A_i L1_i, linear RGB; and the nodes of its subtree, itself included. That
        /// is 1 for a facet, −1 for a facet that the edge of a light's shadow crosses.
        sent: [f32; 4],
        /// Mean normal by flux, shorter than 1 where a cluster's normals differ; and the mean area
        /// of its facets by area. The area bounds the form factor as the distance goes to 0.
        face: [f32; 4],
        /// Area Σ A_i; and second moments M about the position by flux: xx, yy, zz.
        extent: [f32; 4],
        /// Second moments xy, xz, yz; 0.
        leaning: [f32; 4],
    }
}

record! {
    /// Light at the 4 × 4 points of a surface's facet: shares of the greatest, 16 bits each, rows
    /// along v.
    pub struct PackedRecord {
        /// The first two rows.
        ab: [u32; 4],
        /// The last two rows.
        cd: [u32; 4],
    }
}

record! {
    /// Receivers of one workgroup: consecutive places in the order of facets, all of one region.
    pub struct BlockRecord {
        /// First place.
        i_first: u32,
        /// Number of places.
        n_facets: u32,
        /// First pairing of the region.
        i_pairing: u32,
        /// Number of pairings.
        n_pairings: u32,
    }
}

record! {
    /// One region as another one sees it.
    pub struct PairingRecord {
        /// The emitting region.
        i_region: u32,
        /// First of the surfaces that may stand between the two.
        i_occluder: u32,
        /// Number of these surfaces.
        n_occluders: u32,
        /// The region's first source.
        i_source: u32,
        /// Number of its sources: its facets, or the nodes of its tree.
        n_sources: u32,
    }
}

record! {
    /// A node of a tree of sources.
    pub struct NodeRecord {
        /// Nodes of its subtree, itself included; 1 for a facet.
        n_nodes: u32,
    }
}
