//! Text and containers to plain data, and results to files.
//!
//! What goes in: a scene ([`scene_file`]), which names box files ([`box_file`]) and particle lists
//! ([`particle_file`]); weather models' output ([`weather`]). What comes out: images ([`image`]);
//! every result is written through [`atomic`], so that a file is either the old one or the new one
//! whole, and files that belong together through [`folder`].
//!
//! Every complaint about an input says file:line:column, or the `--set` argument, and what was
//! expected. A scene is read in three steps, each with one subject: [`toml_tree`] turns text into a
//! tree in which every key and value knows its origin, [`toml_override`] lays `--set` over it, and
//! [`toml_section`] takes values out of it, checks them and writes down what they came to (the
//! *resolved scene* that results carry). `scene_sections`, `scene_air`, `scene_lights`,
//! `scene_clouds`, `scene_disc` and `scene_weather` say what a scene's keys mean, `scene_phases`
//! which of them parts of a run set anew, and [`magnitude`] how great and how small their numbers
//! may be.

pub mod atomic;
pub mod box_file;
pub mod folder;
pub mod image;
pub mod magnitude;
pub mod particle_file;
mod scene_air;
mod scene_clouds;
mod scene_disc;
pub mod scene_file;
mod scene_lights;
mod scene_phases;
mod scene_sections;
mod scene_surfaces;
pub mod scene_view;
mod scene_weather;
mod suggest;
pub mod text_file;
mod toml_depth;
pub mod toml_override;
pub mod toml_section;
pub mod toml_tree;
pub mod weather;
mod weather_spans;
mod weather_steps;
