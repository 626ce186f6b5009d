//! Every GPU stage against its f64 twin, a file a pass.

#[path = "../harness/bounded.rs"]
mod bounded;
mod chunks;
mod contract;
mod cull;
mod diffusion;
#[path = "../emulation/mod.rs"]
mod emulation;
mod facets;
mod first;
mod functions;
#[path = "../harness/gathers.rs"]
mod gathers;
mod generate;
mod grid;
#[path = "../harness/grounds.rs"]
mod grounds;
mod harmonics;
#[path = "../harness/mod.rs"]
mod harness;
mod haze;
mod impostors;
#[path = "../harness/lights.rs"]
mod lights;
mod live;
mod lod;
#[path = "../harness/march.rs"]
mod march;
#[path = "../harness/media.rs"]
mod media;
#[path = "../harness/mixed.rs"]
mod mixed;
mod morton;
#[path = "../harness/occlusion.rs"]
mod occlusion;
#[path = "../harness/picture.rs"]
mod picture;
mod place;
mod present;
mod relief;
#[path = "../harness/rooms.rs"]
mod rooms;
mod scatter;
#[path = "../harness/scene_text.rs"]
mod scene_text;
#[path = "../harness/scenery.rs"]
mod scenery;
mod second;
mod second_sums;
mod second_tree;
mod shader_sums;
#[path = "../harness/sheets.rs"]
mod sheets;
#[path = "../harness/shells.rs"]
mod shells;
mod sort;
mod sprites;
#[path = "../harness/sums.rs"]
mod sums;
mod surfaces;
mod terrain;
mod texture;
#[path = "../harness/tiled.rs"]
mod tiled;
mod tiles;
mod transmit;
mod transmit_sums;
mod upsample;
#[path = "../harness/ways.rs"]
mod ways;
