//! What is drawn and lit, as plain f64 data and pure functions: no files, no GPU.
//! Lengths are scene units, angles radians, times seconds, radiance and irradiance linear RGB.

pub mod air;
pub mod animated;
pub mod basis;
pub mod boxes;
pub mod camera;
pub mod cloud;
pub mod count;
pub mod cutoff;
pub mod disc;
pub mod film;
pub mod frame_state;
pub mod grid;
pub mod growth;
pub mod gust;
pub mod gust_lanes;
pub mod impostor;
pub mod light;
pub mod material;
pub mod moisture;
pub mod pair_rules;
pub mod pairings;
pub mod philox;
pub mod resolution;
pub mod scene;
pub mod sort_bits;
pub mod sums;
pub mod surface;
pub mod terrain;
pub mod texture;
pub mod tree;
pub mod visibility;
pub mod weather;
