//! The f64 reference of every GPU pass, one module a pass, written from the mathematics (model.md)
//! and not from a shader.
//!
//! Every module consists of functions over slices that take their stage's inputs as arguments. A
//! test can pass exactly what the GPU had, and so measure one stage alone. [`picture`] puts the
//! stages together.

pub mod area;
pub mod blob;
mod blob_layers;
pub mod bounded;
pub mod brdf;
pub mod chunks;
mod composed;
pub mod composite;
pub mod contract;
pub mod count;
pub mod cull;
pub mod deposit;
pub mod diffusion;
pub mod facet_runs;
pub mod facets;
pub mod first;
pub mod generate;
pub mod grid;
pub mod harmonics;
pub mod haze;
pub mod impostors;
pub mod layers;
pub mod live;
pub mod lod;
pub mod morton;
pub mod occlude;
pub mod picture;
pub mod place;
pub mod present;
pub mod relief;
pub mod rounding;
pub mod scatter;
mod shade;
mod shine;
mod slices;
pub mod sort;
pub mod sprite_sums;
pub mod sprites;
pub mod surfaces;
pub mod terrain;
pub mod texture;
pub mod threshold;
pub mod tiles;
pub mod transmit;
pub mod transport;
pub mod upsample;
pub mod view;
pub mod volume;

pub use blob::Blob;
