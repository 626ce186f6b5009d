//! Frames of an animation: the pictures that `nimbus render` draws, to the byte.

use std::fs;
use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::task::{Merge, Merged, ShardResult, Task, Work};
use crate::error::{Error, Result};
use crate::farm::transient::io_error;
use crate::frame::{FrameDrawer, GpuContext};
use crate::io::atomic;
use crate::io::image::{ImageKind, encoded};
use crate::io::result_folder::ResultFolder;
use crate::io::scene_file::LoadedScene;
use crate::model::scene::Impostors;
use crate::timing::machine::{Device, device_record};

/// The pictures of frames `first` to `first + n − 1`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frames {
    /// The first frame.
    pub first: u32,
    /// The number of frames.
    pub n: u32,
    /// The format of the pictures.
    pub format: ImageKind,
}

impl Work for Frames {
    fn kind(&self) -> String {
        "frames".to_owned()
    }

    fn noun(&self) -> &'static str {
        "frames"
    }

    fn items(&self) -> Range<u64> {
        u64::from(self.first)..u64::from(self.first) + u64::from(self.n)
    }

    /// Other frames of the same plan do not change a frame.
    fn identity(&self) -> Value {
        json!({"kind": "frames", "format": self.format.extension()})
    }

    fn outputs(&self, items: Range<u32>) -> Vec<String> {
        items.map(|i_frame| self.format.frame_name(i_frame)).collect()
    }

    /// Refuses scenes in which a frame does not follow from its number alone.
    fn check_scene(&self, loaded: &LoadedScene) -> Result<()> {
        let Frames { first, n, .. } = self;
        if *n == 0 || first.checked_add(*n).is_none() {
            let most = u32::MAX;
            return Err(Error::usage(format!(
                "--frames: expected at least one, up to {most}, found {n} from {first}"
            )));
        }
        let phases = loaded.phases.iter().map(|phase| &phase.scene);
        let mut scenes = std::iter::once(&loaded.scene).chain(phases);
        if scenes.any(|scene| scene.draw.exact().impostors != Impostors::Off) {
            return Err(Error::usage(
                "a frame with impostors depends on the frames before it, which another shard \
                 draws: expected draw.impostors = \"off\" (--set draw.impostors=off)",
            ));
        }
        Ok(())
    }

    fn run(&self, task: &mut Task<'_>) -> Result<Device> {
        let gpu = GpuContext::open(task.choice)?;
        let device = device_record(gpu.device.info());
        task.workplace.resume(&device)?;
        let loaded = task.loaded;
        let mut drawer = FrameDrawer::new(&gpu, true);
        task.make_files(
            |i_frame| self.format.frame_name(i_frame),
            |i_frame| {
                let (rgba, shown) = drawer.draw(loaded.exact_at_frame(i_frame), i_frame)?;
                encoded(self.format, &shown, shown.film.width, shown.film.height, &rgba)
            },
        )?;
        drop(drawer);
        // Closing reports the validation layers' messages. Later attempts must not take over
        // pictures that such a message may be about.
        gpu.close().inspect_err(|_| task.workplace.disown())?;
        Ok(device)
    }

    fn merge(&self, merge: &Merge<'_>) -> Result<Merged> {
        let files = merge.results.iter().flat_map(|result| &result.manifest.files);
        let planned: Vec<String> = files.map(|file| file.name.clone()).collect();
        let mut folder = ResultFolder::open(merge.out, "frames", merge.existing, &planned)?;
        let names: Vec<&str> = planned.iter().map(String::as_str).collect();
        let written = folder.finish(&names, |staged| copy_all(merge.results, staged));
        Ok(Merged { n: names.len(), summary: String::new(), written })
    }
}

/// Copies all files to a folder and verifies each copy.
fn copy_all(results: &[ShardResult], to: &Path) -> Result<()> {
    for ShardResult { folder, manifest, .. } in results {
        for file in &manifest.files {
            let copy = to.join(&file.name);
            fs::copy(folder.join(&file.name), &copy).map_err(io_error(&copy))?;
            file.check(to).map_err(|defect| defect.into_error(to))?;
            atomic::sync(&copy)?;
        }
    }
    atomic::sync(to)
}
