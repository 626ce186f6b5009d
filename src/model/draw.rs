//! How a scene's particles are drawn.

use super::count::Count;
use super::cutoff::Cutoff;
use super::edge::{Edge, Reach};
use super::named::named;
use super::overlap::{Overlap, n_parts};
use super::resolution::Resolution;
use super::sort_bits::SortBits;

named! {
    /// Pipeline that draws the particles.
    pub enum DrawPath {
        /// Quads through the graphics pipeline.
        Sprites = "sprites",
        /// Tiles of pixels in compute.
        Tiles = "tiles",
        /// The faster one at the scene's first frame.
        Auto = "auto",
    }
}

named! {
    /// Whether distant particles are drawn from an impostor picture.
    pub enum Impostors {
        /// Every particle is drawn in every frame.
        Off = "off",
        /// Distant particles are drawn once and reused while the error stays small.
        On = "on",
        /// The faster one over the scene's first frames.
        Auto = "auto",
    }
}

named! {
    /// Whether particles that no pixel shows are left out before the sort. The picture is the same.
    pub enum Cull {
        /// Particles that no pixel shows are left out.
        On = "on",
        /// All particles are sorted and drawn.
        Off = "off",
        /// The faster one at the scene's first frame.
        Auto = "auto",
    }
}

/// Greatest number of chunks that sprites are drawn in.
pub const MAX_CHUNKS: u32 = 256;

/// Order in which sprites are drawn, and whether opaque pixels are skipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chunks {
    /// This many chunks, near to far, skipping pixels that are opaque after each chunk; 0 draws far
    /// to near without skipping.
    Of(u32),
    /// The fastest one at the scene's first frame.
    Auto,
}

/// Drawing settings of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draw {
    /// Pipeline that draws the particles.
    pub path: DrawPath,
    /// Whether distant particles are drawn from impostors.
    pub impostors: Impostors,
    /// Greatest predicted error of an impostor, pixels.
    pub impostor_error: f64,
    /// Resolution of the picture that the particles are drawn into.
    pub resolution: Resolution,
    /// Greatest root mean square change of the picture by all settings that "auto" chooses
    /// together.
    pub error: f64,
    /// Chunks of the path "sprites".
    pub chunks: Chunks,
    /// Distance from its centre at which a blob ends.
    pub cutoff: Reach,
    /// Optical depth below which blobs end.
    pub threshold: Cutoff,
    /// How overlapping blobs are composed.
    pub overlap: Overlap,
    /// Thickness of a slice, mean σ.
    pub slice: f64,
    /// Whether particles that no pixel shows are left out.
    pub cull: Cull,
    /// Width in pixels of σ below which particles are left out. It needs culling.
    pub smallest: Cutoff,
    /// Edge of the cells in which one blob stands for all of about its size, over their σ; 0 keeps
    /// every blob.
    pub lod: f64,
    /// Width of the sort keys.
    pub sort_bits: SortBits,
    /// Law of the number of drawn particles; `None` draws all.
    pub count: Option<Count>,
    /// Seed of the texture pool.
    pub texture_seed: u32,
    /// Number of particles of all clouds made from boxes together; 0 takes the files' numbers.
    pub n_particles: u32,
}

impl Draw {
    /// Returns the number of slices that a blob is dealt among; 0 without slices.
    pub fn n_parts(&self) -> u32 {
        match self.overlap {
            Overlap::Slices => n_parts(self.slice),
            Overlap::Thin | Overlap::Auto => 0,
        }
    }

    /// Returns where blobs end.
    pub fn edge(&self) -> Edge {
        let tau = self.threshold.bound();
        match self.cutoff {
            Reach::Auto if tau == 0.0 => Edge::AUTO,
            Reach::Auto => Edge { tau, ..Edge::NONE },
            Reach::Sigmas(radius) => Edge { tau, ..Edge::at(radius) },
        }
    }

    /// Returns the settings with every "auto" replaced by the choice that changes nothing.
    pub fn exact(self) -> Draw {
        let least = |l: Cutoff| Cutoff::At(l.bound());
        let path = match (self.path, self.overlap) {
            (DrawPath::Auto, Overlap::Slices) => DrawPath::Tiles,
            (DrawPath::Auto, _) => DrawPath::Sprites,
            (path, _) => path,
        };
        let overlap = match (self.overlap, path) {
            (Overlap::Auto, DrawPath::Tiles) => Overlap::Slices,
            (Overlap::Auto, _) => Overlap::Thin,
            (overlap, _) => overlap,
        };
        Draw {
            path,
            overlap,
            chunks: if self.chunks == Chunks::Auto { Chunks::Of(0) } else { self.chunks },
            cull: if self.cull == Cull::Auto { Cull::On } else { self.cull },
            threshold: least(self.threshold),
            smallest: least(self.smallest),
            resolution: if self.resolution == Resolution::Auto {
                Resolution::Full
            } else {
                self.resolution
            },
            impostors: if self.impostors == Impostors::Auto {
                Impostors::Off
            } else {
                self.impostors
            },
            ..self
        }
    }
}
