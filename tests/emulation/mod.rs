//! Emulation of the pass `second`: its own approximation of C (16) in f64, model.md §7, passes.md
//! "second" and "tree". A running bound tells how far an f32 evaluation may differ.
//!
//! The law itself is `nimbus::reference::area::AreaScene::second`, an integral over the facets. The
//! pass approximates it, and this module repeats the approximation step by step: which facets it
//! divides, which clusters it opens, how it smooths the edges of shadows. A test can so compare the
//! device's values within rounding and notice a single wrong constant. What the approximation
//! costs, the error studies measure against the law.
//!
//! In: facets, regions, lights and their transmittances, the density grid, all relative to the
//! lighting origin. Out, a receiver: I_i (W m⁻²) and L2 (W m⁻² sr⁻¹) toward the eye, RGB.

#![allow(dead_code, unused_imports, reason = "each test binary uses its own part")]

pub mod cells;
pub mod cluster;
pub mod cluster_gather;
pub mod cluster_view;
pub mod coverage;
pub mod exchange;
pub mod form;
pub mod gathered;
pub mod occluder;
pub mod pairs;
pub mod roundings;
pub mod rules;
pub mod source;
pub mod view;

pub use cluster::Clusters;
pub use exchange::{Exchange, Facet, Region};
pub use gathered::Gathered;
pub use source::Sender;
