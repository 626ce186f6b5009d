//! Records that the kernels of `tiles` pass on (passes.md "tiles").

use crate::layout::record;

record! {
    /// A blob on the screen. Its optical depth along the ray (x, y, 1) is tau 2^−e. There
    /// e = scale (δx² + δy² + (cx δy − cy δx)²)/(1 + x² + y²), and δ = (x, y) − (cx, cy).
    pub struct SplatRecord {
        /// Slopes (cx, cy) of the centre.
        center: [f32; 2],
        /// Scale z²/(2 σ² ln 2).
        scale: f32,
        /// Optical depth through the centre.
        tau: f32,
        /// Linear RGB.
        radiance: [f32; 3],
        /// Depth near/z.
        depth: f32,
    }
}

record! {
    /// The texture of a splat (passes.md "texture").
    pub struct SplatTextureRecord {
        /// Rotation and shift from slopes to texels.
        turn: [f32; 4],
        /// Factors on the noise of two levels, and the subtrahend for mean one.
        gain: [f32; 3],
        /// First texel of its level in the pool.
        i_texel: u32,
        /// Log2 of the level's side.
        log2_side: u32,
        /// Padding.
        unused: u32,
        /// Padding.
        unused_too: [u32; 2],
    }
}

record! {
    /// A round: blocks of splats, near to far, whose pairs fit the buffer together.
    pub struct RoundRecord {
        /// Workgroups that sort: [n, 1, 1]; number of pairs.
        extent: [u32; 4],
        /// Blocks: [n, 1, 1]; the first block.
        blocks: [u32; 4],
        /// Workgroups that find the bins' ranges: [n, 1, 1]; 1 where a later round has splats.
        bins: [u32; 4],
        /// Workgroups that compose one of several rounds: [x, y, 1]; number of ranges.
        tiles: [u32; 4],
        /// The same for an only round.
        alone: [u32; 4],
    }
}
