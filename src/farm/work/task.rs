//! The interface of all kinds of work.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::Value;

use crate::error::{Error, Result};
use crate::farm::manifest::Manifest;
use crate::farm::scene_source::SceneSource;
use crate::farm::workplace::Workplace;
use crate::frame::DeviceChoice;
use crate::io::result_folder::Existing;
use crate::io::scene_file::LoadedScene;
use crate::timing::machine::Device;

/// Work that consists of numbered items and is done in shards of consecutive items.
pub trait Work {
    /// Returns the name of the kind of work. A cost model holds for a single kind.
    fn kind(&self) -> String;

    /// Returns the plural noun for the items.
    fn noun(&self) -> &'static str;

    /// Returns the numbers of all items.
    fn items(&self) -> Range<u64>;

    /// Returns everything that the content of an item's files follows from, besides the scene, the
    /// shaders and the build. It enters the keys of the shards.
    fn identity(&self) -> Value;

    /// Returns the names of the files that a shard of `items` makes, sorted.
    fn outputs(&self, items: Range<u32>) -> Vec<String>;

    /// Returns whether two runs make the same bytes. Pictures are the same, times are not.
    fn is_exact(&self) -> bool {
        true
    }

    /// Returns whether runs open a Vulkan device.
    fn needs_device(&self) -> bool {
        true
    }

    /// Checks a description that was read from a file.
    ///
    /// # Errors
    /// When no work can be as described.
    fn check(&self) -> std::result::Result<(), String> {
        Ok(())
    }

    /// Checks that the scene can be worked on in shards.
    ///
    /// # Errors
    /// When the scene does not fit the work.
    fn check_scene(&self, _loaded: &LoadedScene) -> Result<()> {
        Ok(())
    }

    /// Makes all files of a shard and returns the device that made them.
    ///
    /// # Errors
    /// When a file cannot be made, or the run is to stop.
    fn run(&self, task: &mut Task<'_>) -> Result<Device>;

    /// Puts the results of all shards together.
    ///
    /// # Errors
    /// When results do not fit together, or the place of the merged one is not free.
    fn merge(&self, merge: &Merge<'_>) -> Result<Merged>;
}

/// The outcome of a merge.
pub struct Merged {
    /// The number of items.
    pub n: usize,
    /// Lines about the merged result for the user.
    pub summary: String,
    /// Whether the merged result was written.
    pub written: Result<()>,
}

/// A shard to be done, and the means to do it.
pub struct Task<'a> {
    /// The scene's file and settings.
    pub scene: &'a SceneSource,
    /// The scene itself.
    pub loaded: &'a LoadedScene,
    /// The shard's items.
    pub items: Range<u32>,
    /// The device to open.
    pub choice: &'a DeviceChoice,
    /// The folder that gets the files.
    pub workplace: &'a mut Workplace,
    /// Set when the run is to keep what is finished and end.
    pub stop: &'a AtomicBool,
    /// Called after every item, with whether this run made it.
    pub on_item: &'a dyn Fn(bool),
}

impl Task<'_> {
    /// Makes the file of each item with `make`, except those that earlier attempts have finished.
    ///
    /// # Errors
    /// When `make` fails, a file cannot be written, or the run is to stop.
    pub fn make_files(
        &mut self,
        name: impl Fn(u32) -> String,
        mut make: impl FnMut(u32) -> Result<Vec<u8>>,
    ) -> Result<()> {
        for item in self.items.clone() {
            let name = name(item);
            let is_new = !self.workplace.has(&name);
            if is_new {
                if self.stop.load(Ordering::Relaxed) {
                    return Err(Error::Interrupted);
                }
                self.workplace.add(&name, &make(item)?)?;
            }
            (self.on_item)(is_new);
        }
        Ok(())
    }
}

/// A verified result of a shard.
pub struct ShardResult {
    /// The folder of its files.
    pub folder: PathBuf,
    /// The shard's items.
    pub items: Range<u32>,
    /// The description of its files.
    pub manifest: Manifest,
}

impl ShardResult {
    /// Returns a name for messages.
    pub fn name(&self) -> String {
        format!("shard {} on {}", self.manifest.index, self.manifest.node)
    }
}

/// The results of all shards, in the plan's order, and the place for the merged one.
pub struct Merge<'a> {
    /// All results; at least one.
    pub results: &'a [ShardResult],
    /// The folder that gets the merged result.
    pub out: &'a Path,
    /// The rule for results of an earlier merge.
    pub existing: Existing,
    /// The scene's file and settings.
    pub scene: &'a SceneSource,
    /// Version, revision and digest of the build that made the plan.
    pub build: [&'a str; 3],
    /// Loads the scene, or fails when it has changed since it was planned.
    pub load: &'a dyn Fn() -> Result<LoadedScene>,
}
