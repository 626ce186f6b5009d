//! What the second reflection is gathered from (docs/model.md §7).

use crate::layout::record;

record! {
    /// Light on its way from a facet, or from a cluster of facets of one region. By fours, since a
    /// device that loads for each invocation by itself pays by the load.
    pub struct SourceRecord {
        /// Position, a cluster's the mean of its facets' by their flux; and the radius from it that
        /// no point is beyond.
        place: [f32; 4],
        /// Σ A_i L1_i of the diffuse basis, linear RGB; and the nodes of its subtree, itself
        /// included: 1 for a facet, -1 for one that the rim of a light's shadow runs through.
        sent: [f32; 4],
        /// Mean normal by flux, shorter than 1 where a cluster's normals differ; and the mean area
        /// of its facets, by area: what bounds the form factor as the distance goes to 0.
        face: [f32; 4],
        /// Σ A_i; and second moments M about the position, by flux: xx, yy, zz.
        extent: [f32; 4],
        /// xy, xz, yz; 0.
        leaning: [f32; 4],
    }
}

record! {
    /// Of one light at the 4 × 4 points of a surface's facet: shares of the greatest, 16 bits each,
    /// rows along v.
    pub struct PackedRecord {
        ab: [u32; 4],
        cd: [u32; 4],
    }
}

record! {
    /// Receivers that are gathered for together: consecutive places in the order of facets, all of
    /// one region.
    pub struct BlockRecord {
        i_first: u32,
        n_facets: u32,
        i_pairing: u32,
        n_pairings: u32,
    }
}

record! {
    /// One region as seen from another.
    pub struct PairingRecord {
        i_region: u32,
        /// Surfaces that may stand between the two.
        i_occluder: u32,
        n_occluders: u32,
        /// Its first source, and how many there are: its facets, or the nodes of its tree.
        i_source: u32,
        n_sources: u32,
    }
}

record! {
    /// What the walk needs of a source: the nodes of its subtree, itself included; 1 for a facet.
    pub struct NodeRecord {
        n_nodes: u32,
    }
}
