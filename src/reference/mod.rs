//! The f64 twin of every GPU pass, one room a pass, written from the mathematics (model.md), never
//! from a shader.
//!
//! Each room is plain functions over slices and takes its stage's inputs as arguments, so that a
//! test can feed it exactly what the GPU had and so measure one stage alone.

pub mod area;
pub mod blob;
pub mod chunks;
pub mod contract;
pub mod count;
pub mod cull;
pub mod emulation;
pub mod facets;
pub mod first;
pub mod generate;
pub mod grid;
pub mod impostors;
pub mod layers;
pub mod live;
pub mod morton;
pub mod occlude;
pub mod parallel;
pub mod picture;
pub mod place;
pub mod present;
pub mod rounding;
pub mod sort;
pub mod sprites;
pub mod surfaces;
pub mod terrain;
pub mod texture;
pub mod threshold;
pub mod tiles;
pub mod transmit;
pub mod upsample;
pub mod upsample_bound;
pub mod volume;

pub use blob::Blob;
