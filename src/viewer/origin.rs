//! Where a view came from: the scene's file and those that it names, watched and read again; and
//! where it goes, a scene of what is seen.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::wanted::Wanted;
use super::watch::{Changed, Files, Watch};
use crate::error::Result;
use crate::io::{scene_file, scene_view};
use crate::model::scene::Scene;

pub struct Origin {
    pub path: PathBuf,
    /// As they were typed: `--set`, `--size`.
    overrides: Vec<String>,
    seed: Option<u32>,
    /// As the file has it.
    pub first: Arc<Scene>,
    watch: Watch,
}

impl Origin {
    /// Of `first`, which was read from `files`, the scene's own being the first; and of shaders
    /// from a folder.
    pub fn new(
        (path, first): (&Path, Arc<Scene>),
        (overrides, seed): (Vec<String>, Option<u32>),
        files: Vec<PathBuf>,
        shaders: Option<&Path>,
    ) -> Origin {
        Origin {
            path: path.to_owned(),
            overrides,
            seed,
            first,
            watch: Watch::new(Files::new(files, shaders)),
        }
    }

    /// What has changed on the disk.
    pub fn poll(&mut self, now: Instant) -> Changed {
        self.watch.poll(now)
    }

    /// The scene as its files are now, with what was turned since.
    pub fn read(&mut self, wanted: &Wanted) -> Result<Arc<Scene>> {
        let (loaded, files) = scene_file::load_and_name(&self.path, &self.overrides, self.seed);
        self.watch.set_scene_files(files);
        let turned = wanted.turned(&self.first);
        let first = Arc::new(loaded?.scene);
        let scene = match turned.is_empty() {
            true => first.clone(),
            false => {
                let overrides = [&self.overrides[..], &turned].concat();
                Arc::new(scene_file::load(&self.path, &overrides, self.seed)?.scene)
            }
        };
        self.first = first;
        Ok(scene)
    }

    /// Saves what is seen as a scene under the first name that is free; that name.
    pub fn save(&self, wanted: &Wanted) -> Result<PathBuf> {
        let stem = self.path.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
        let overrides = [self.overrides.clone(), wanted.overrides(&self.first)].concat();
        let mut n = 1;
        loop {
            let to = PathBuf::from(format!("{stem}-view-{n}.toml"));
            if to.symlink_metadata().is_err() {
                scene_view::save(&self.path, &to, &overrides, self.seed)?;
                return Ok(to);
            }
            n += 1;
        }
    }
}
