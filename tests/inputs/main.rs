//! Scene files and the files that they name: what is read, and what is refused.

mod disc;
mod files;
#[path = "../harness/generated.rs"]
mod generated;
mod lighting;
mod properties;
#[path = "../harness/readers.rs"]
mod readers;
mod regressions;
#[path = "../harness/scene_text.rs"]
mod scene_text;
mod scene_view;
mod scenes;
