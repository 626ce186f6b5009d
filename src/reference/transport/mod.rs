//! Radiative transfer in clouds of Gaussian blobs, with surfaces and ground, by random paths in f64
//! (transport.md), without the model's facets and reflections.
//!
//! - [`BlobMedium`] has the blobs: optical depths in closed form, free flights without a grid.
//!
//! - [`Solids`] has rectangles and ground, and [`Lights`] the emitters.
//!
//! - [`TransportScene`] puts them together and traces paths from the eye.
//!
//! A path's random numbers depend on its pixel and sample alone.

mod blobs;
mod bvh;
mod estimator;
mod lights;
mod medium;
mod path;
mod ray;
mod solids;
mod stream;

pub use blobs::BlobMedium;
pub use estimator::{Estimator, Unbiased};
pub use lights::Lights;
pub use medium::{Collision, Medium, Scatterer};
pub use path::{N_LAYERS, PathLight, TransportScene};
pub use ray::Ray;
pub use solids::{SolidHit, Solids};
pub use stream::Stream;
