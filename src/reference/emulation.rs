//! Emulation of the pass `second`: its own approximation of C (16) in f64, model.md §7, §11
//! "second" and "tree". A running bound tells how far an f32 evaluation may differ.
//!
//! The law itself is [`super::area::AreaScene::second`]. This module follows the shaders step by
//! step: the facets that are divided, the clusters that are opened, the smoothing of shadow edges.
//! A test can so compare a device's values within rounding and notice a single wrong constant.
//!
//! In: facets, regions, lights and their transmittances, the density grid, all relative to the
//! lighting origin. Out, a receiver: I_i (W m⁻²) and L2 (W m⁻² sr⁻¹) toward the eye, RGB.

mod cells;
mod cluster;
mod cluster_gather;
mod cluster_view;
mod coverage;
mod exchange;
mod form;
mod gathered;
mod occluder;
mod pairs;
mod roundings;
mod source;
#[cfg(test)]
mod tests;
mod view;

pub use cluster::Clusters;
pub use exchange::{Exchange, Facet, Region};
pub use gathered::Gathered;
pub use source::Sender;
