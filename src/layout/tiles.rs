//! What the kernels of `tiles` hand on (docs/model.md §11 "tiles").

use crate::layout::record;

record! {
    /// A blob on the screen: its optical depth at the ray (x, y, 1) is tau 2^-e, e = scale (δx² +
    /// δy² + (cx δy − cy δx)²)/ (1 + x² + y²), δ = (x, y) − (cx, cy) (docs/model.md §11 "tiles").
    pub struct SplatRecord {
        /// Slopes.
        center: [f32; 2],
        /// z²/(2 σ² ln 2).
        scale: f32,
        /// Through the centre.
        tau: f32,
        radiance: [f32; 3],
        /// near/z.
        depth: f32,
    }
}

record! {
    /// What of a splat is textured (docs/model.md §11 "texture"); the shaders' Sheet.
    pub struct SplatTextureRecord {
        turn: [f32; 4],
        gain: [f32; 3],
        /// Its level's first texel in the pool, and log2 of the level's side.
        i_texel: u32,
        log2_side: u32,
        unused: u32,
        unused_too: [u32; 2],
    }
}

record! {
    /// As many blocks of splats, near to far, as there is room for the pairs of at once.
    pub struct RoundRecord {
        /// Workgroups that sort: [n, 1, 1]; pairs.
        extent: [u32; 4],
        /// How many blocks: [n, 1, 1]; the first.
        blocks: [u32; 4],
        /// Workgroups that look for the bins' pairs: [n, 1, 1]; 1 where a later round has splats.
        bins: [u32; 4],
        /// Workgroups that compose where there are several rounds: [x, y, 1]; how many have tiles.
        tiles: [u32; 4],
        /// The same where this is the only round.
        alone: [u32; 4],
    }
}
