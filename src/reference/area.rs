//! Light of reflections integrated over the areas of surfaces, passes.md "area reference": the
//! law that sums over pairs of facets approximate.
//!
//! In: surfaces with a material each, lights, blobs, facets of clouds. Out: radiance toward the eye
//! and irradiance, RGB, with error estimates. [`AreaScene::second`] is the law of the pass
//! `second`, which approximates it.

pub mod adaptive;
pub mod clip;
pub mod paths;
mod resolve;
mod scene;
mod second;
#[cfg(test)]
mod tests;
mod visibility;

pub use adaptive::{Accuracy, Estimate};
pub use scene::{AreaScene, DiscFacet, Receiver};
pub use second::form_factor;
