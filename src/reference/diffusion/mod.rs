//! Diffusion of light in clouds, in f64: model.md §18 and passes.md "diffusion".
//!
//! In: the density grid, the mean medium, lights. Out: the fluence φ and the flux F of scattered
//! light in every cell.
//!
//! - [`Sources`]: light that is scattered for the first time.
//!
//! - [`System`]: the linear equations of the cells.
//!
//! - [`Multigrid`]: their solution by cycles, as the device does.
//!
//! - [`FaceLight`], [`BoxLight`]: what surfaces and ground send to the cells, and cells to them.
//!
//! - Bounces: light on straight ways between cells, or merged ones; [`SeenCells`]: what cells show
//!   of it.
//!
//! - [`DiffuseLight`]: all of them for a frame, and what a blob scatters of it.

mod bounce;
mod box_light;
mod direct_solve;
mod faces;
mod field;
mod merged;
mod moments;
mod multigrid;
mod of_suns;
mod second_order;
mod seen;
mod sources;
mod system;
#[cfg(test)]
mod tests;
mod toward;
mod ways;

pub use box_light::BoxLight;
pub use direct_solve::solve;
pub use faces::FaceLight;
pub use field::DiffuseLight;
pub use multigrid::Multigrid;
pub use seen::{SeenBlob, SeenCells};
pub use sources::{DiffusionMedium, Sources};
pub use system::{AtFaces, System};
