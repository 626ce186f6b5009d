//! Whole pictures in f64, computed from a scene alone: no device, no files.
//!
//! - [`ReferenceKind`] names the reference, and [`ReferenceKind::render`] draws it.
//! - [`sums`] draws any range of samples at any pixels, so that a picture can be computed in parts
//!   and put together to the same bits.
//! - [`FrameReference`] holds every stage of one frame up to the light on its facets.
//! - [`drawn_as_set`] draws a frame with the scene's own drawing settings, and [`layers_as_set`]
//!   its layers.

mod background;
mod error_estimate;
mod expected;
mod frame;
mod kind;
mod layers;
mod limits;
mod local_scene;
mod medium_light;
mod model_light;
mod model_picture;
mod particle_light;
mod pixels;
mod progress;
mod render;
mod renderer;
mod sample_sums;
mod samples;
mod scene_light;
mod shares;
mod sprites;
mod surface_light;
mod transport;
mod transport_layers;

pub use background::view;
pub use error_estimate::ErrorEstimate;
pub use expected::{PictureTime, expected_path_s, expected_time};
pub use frame::{FrameReference, SecondOf};
pub use kind::{ReferenceKind, n_reflections};
pub use layers::{PictureLayers, layers_as_set, sums_by_settings};
pub use limits::check_memory;
pub use model_picture::ModelDrawing;
pub use pixels::{Pixels, Tile};
pub use progress::{OnProgress, RenderStage};
pub use render::{DrawnPicture, PathLimits, Reference, drawn_as_set, render_paths};
pub use renderer::render_model;
pub use sample_sums::{MeanPicture, N_VALUES, PairwiseSum, SampleSums};
pub use samples::{Enough, Grown, MAX_SAMPLES, ReferenceRequest, sums, sums_until, to_f32};
pub use scene_light::{BlobModel, PixelSample, RenderedPixels, render_lit_scene};
pub use shares::{Emitters, PixelShares, drawn_by_settings, pixel_shares};
pub use transport::TransportParts;
pub use transport_layers::{N_LAYER_VALUES, TransportLayers, transport_layers};
