//! One frame: the game step makes a [`Packet`], and the render step draws it.
//!
//! [`GpuContext`] makes a [`Player`] of a scene, and [`Stage`] holds both. [`serial`] and
//! [`parallel`] are two loops around [`Game::step`] and [`Renderer::step`]; [`plan`] decides which
//! passes a frame skips.

mod blob_target;
mod buffers;
mod choice;
mod chunked_sprites;
mod clock;
mod cold;
mod constants;
mod counts;
mod culling;
mod dark_lights;
mod drawer;
mod features;
mod frame_passes;
mod game;
mod gather;
mod gather_lists;
mod impostor_cache;
mod impostors;
mod layers;
mod light_notes;
pub mod limits;
mod live;
mod low_res;
mod media;
mod merging;
mod morton_sort;
mod packet;
pub mod parallel;
mod picture;
mod pipelines;
pub mod plan;
mod player;
mod readback;
mod records;
mod render;
mod renderer;
mod reshape;
pub mod serial;
mod sides;
mod solids;
mod stage;
mod staging;
mod still;
mod tensor_shape;
mod tensors;
mod tiling;
mod times;
mod unseen;
mod visibility;
mod work;

pub use buffers::n_cells;
pub use choice::{Candidate, Choice, ImpostorChoice, LightChoice, chosen_texts, toml_name};
pub use chunked_sprites::{ChunkCount, ChunkedSprites};
pub use counts::Counts;
pub use drawer::FrameDrawer;
pub use features::{
    SceneFeatures, Tensors, gathers_from_tree, is_glossy, saturation_bound, target_format,
};
pub use game::{Game, Viewpoint};
pub use layers::scene_of_layers;
pub use light_notes::light_notes;
pub use packet::Packet;
pub use pipelines::pipelines;
pub use player::Player;
pub use renderer::{Rendered, Renderer};
pub use reshape::Reshaped;
pub use sides::open_sides;
pub use stage::{DeviceChoice, GpuContext, Stage};
pub use still::{is_still, plan_of_frame};
pub use tensor_shape::{Block, Shape, basis_of};
pub use tiling::Tiling;
pub use times::{FrameTimes, Marks, OnFrame};
pub use unseen::{DrawnFrame, unseen};
pub use work::{Amounts, Blobs, Work, floor};
