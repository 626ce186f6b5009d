//! The scene: what is drawn and lit, as plain f64 data and pure functions. No files, no GPU.
//!
//! *Units*: lengths are scene units, angles radians, times seconds; radiance (W m⁻² sr⁻¹) and
//! irradiance (W m⁻²) are linear RGB.

pub mod air;
pub mod animated;
pub mod backdrop;
pub mod basis;
pub mod boxes;
pub mod camera;
pub mod cloud;
pub mod count;
pub mod cover;
pub mod cutoff;
pub mod disc;
mod draw;
pub mod edge;
pub mod film;
pub mod frame_state;
pub mod grid;
mod group;
pub mod growth;
pub mod gust;
pub mod gust_lanes;
pub mod harmonics;
pub mod hills;
pub mod impostor;
pub mod layers;
pub mod light;
mod lighting;
pub mod lod;
pub mod material;
pub mod medium;
pub mod moisture;
mod named;
pub mod noise;
pub mod overlap;
pub mod pairings;
pub mod parallel;
mod particle;
pub mod particle_list;
pub mod phase;
pub mod philox;
pub mod relief;
pub mod resolution;
pub mod scene;
pub mod shade;
pub mod shape;
pub mod sky;
pub mod sort_bits;
pub mod sums;
pub mod surface;
pub mod terrain;
pub mod texture;
pub mod tilt;
pub mod tree;
pub mod visibility;
pub mod weather;
