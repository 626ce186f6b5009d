//! Text and containers to plain data, and results to files.
//!
//! Inputs: a scene ([`scene_file`]), which names box files ([`box_file`]), particle lists
//! ([`particle_file`], [`ply`]) and the output of weather models ([`weather`]). Outputs: images
//! ([`image`]), layers of a picture ([`layers`]) and results. Every file is written through
//! [`atomic`], so that it is the old one or the new one whole, and files that belong together
//! through [`folder`]. Every file that a user names is opened by [`input_file`]. A run claims the
//! place of its results ([`claim`]) and keeps a list of the files that it wrote
//! ([`result_folder`]).
//!
//! Every complaint about an input says file:line:column, or the `--set` argument, and what was
//! expected. A scene is read in two steps: `document` turns text and `--set` arguments into a tree
//! in which every value knows its origin, and [`scene_keys`] reads the tree, table by table.

pub mod atomic;
pub mod bounds;
pub mod box_file;
pub mod claim;
pub mod clip;
pub mod console;
mod document;
pub mod folder;
pub mod image;
pub mod input_file;
pub mod layers;
pub mod mapped_file;
pub mod memory;
mod near_file;
mod particle_digest;
pub mod particle_file;
pub mod plain_text;
pub mod ply;
pub mod process_info;
pub mod result_folder;
pub mod scene_file;
mod scene_hash;
pub mod scene_keys;
pub mod scene_view;
pub mod text_file;
pub mod weather;

pub use document::suggest::suggestion;
