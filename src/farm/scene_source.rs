//! The scene and shaders that a plan was made of.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::io::scene_file::{self, LoadedScene};

/// A scene file with its settings and shaders, and digests of all that they contain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSource {
    /// The absolute path, under which every node has to see the file.
    pub file: PathBuf,
    /// Settings as `--set` takes them: `key=value`.
    pub set: Vec<String>,
    /// The seed of the first cloud, in place of the scene's own.
    pub seed: Option<u32>,
    /// SHA-256 of the resolved scene and of the files that it names.
    pub hash: String,
    /// The folder of shaders that replace the built-in ones.
    pub shaders: Option<PathBuf>,
    /// SHA-256 of all shaders.
    pub shaders_hash: String,
}

impl SceneSource {
    /// Loads a scene and computes the digests of its present content.
    ///
    /// # Errors
    /// When the scene or a shader cannot be read.
    pub fn new(
        file: &Path,
        set: Vec<String>,
        seed: Option<u32>,
        shaders: Option<&Path>,
    ) -> Result<(SceneSource, LoadedScene)> {
        let absolute =
            |path: &Path| std::path::absolute(path).map_err(|cause| Error::io(path, cause));
        let (file, shaders) = (absolute(file)?, shaders.map(absolute).transpose()?);
        let loaded = scene_file::load(&file, &set, seed)?;
        let (hash, shaders_hash) = (loaded.hash().to_owned(), hash_of(shaders.as_deref())?);
        Ok((SceneSource { file, set, seed, hash, shaders, shaders_hash }, loaded))
    }

    /// Loads the scene again. The inner `Err` names what has changed.
    ///
    /// # Errors
    /// When the scene or a shader cannot be read.
    pub fn reload(&self) -> Result<std::result::Result<LoadedScene, String>> {
        let loaded = scene_file::load(&self.file, &self.set, self.seed)?;
        if loaded.hash() != self.hash {
            let file = self.file.display();
            return Ok(Err(format!("{file} or a file that it names has changed since")));
        }
        if hash_of(self.shaders.as_deref())? != self.shaders_hash {
            return Ok(Err("the shaders have changed since".to_owned()));
        }
        Ok(Ok(loaded))
    }
}

fn hash_of(shaders: Option<&Path>) -> Result<String> {
    let choice = DeviceChoice { shaders: shaders.map(Path::to_owned), ..DeviceChoice::default() };
    choice.sources().map(|sources| sources.hash())
}
