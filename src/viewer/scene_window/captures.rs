//! Pictures and scenes that the scene window saves: in one folder, under free names.

use std::path::{Path, PathBuf, absolute};

use crate::error::Result;
use crate::io::atomic::{make_folder, write_synced};
use crate::io::image::{self, ImageKind};
use crate::model::backdrop::Backdrop;
use crate::viewer::free_path::write_free;

/// The folder that files are saved to, and the beginning of their names.
pub struct Captures {
    folder: PathBuf,
    stem: String,
}

impl Captures {
    /// Saves to `folder`, which need not exist yet, under names that begin with that of `scene`.
    pub fn new(folder: &Path, scene: &Path) -> Captures {
        let stem = scene.file_stem().unwrap_or("scene".as_ref()).to_string_lossy().into_owned();
        Captures { folder: absolute(folder).unwrap_or_else(|_| folder.to_owned()), stem }
    }

    /// Saves a picture of premultiplied linear RGBA. Returns the whole path of the file.
    ///
    /// # Errors
    /// The folder cannot be made, or the file cannot be written.
    pub fn save_picture(&self, kind: ImageKind, shown: &Backdrop, rgba: &[f32]) -> Result<PathBuf> {
        let bytes = image::encoded(kind, shown, shown.film.width, shown.film.height, rgba)?;
        let extension = match kind {
            ImageKind::Png => "png",
            ImageKind::Exr => "exr",
        };
        self.save(extension, |_| Ok(bytes))
    }

    /// Saves a scene, whose text `text_of` returns for the place of the file. Returns its whole
    /// path.
    ///
    /// # Errors
    /// As [`Captures::save_picture`], and those of `text_of`.
    pub fn save_scene(&self, text_of: impl FnOnce(&Path) -> Result<String>) -> Result<PathBuf> {
        self.save("toml", |path| text_of(path).map(String::into_bytes))
    }

    /// Writes a new file in the folder, under a name that another window cannot take.
    fn save(
        &self,
        extension: &str,
        bytes_at: impl FnOnce(&Path) -> Result<Vec<u8>>,
    ) -> Result<PathBuf> {
        make_folder(&self.folder)?;
        let name = |n| self.folder.join(format!("{}-view-{n}.{extension}", self.stem));
        write_free(name, |path| write_synced(path, &bytes_at(path)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::fs;

    #[test]
    fn no_file_is_replaced_also_by_another_window() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("a/b");
        let first = Captures::new(&folder, Path::new("scenes/hello.toml"));
        let path = first.save_scene(|_| Ok("1".to_owned())).unwrap();
        assert_eq!(path, folder.join("hello-view-1.toml"));
        fs::write(folder.join("hello-view-2.toml"), "mine").unwrap();
        fs::create_dir(folder.join("hello-view-3.toml")).unwrap();
        // Windows that save at once.
        let saved: BTreeSet<PathBuf> = std::thread::scope(|scope| {
            let save = |i: usize| {
                let captures = Captures::new(&folder, Path::new("hello.toml"));
                let save = move |_: usize| captures.save_scene(|_| Ok(i.to_string())).unwrap();
                scope.spawn(move || (0..10).map(save).collect::<Vec<_>>())
            };
            let all: Vec<_> = (0..4).map(save).collect();
            all.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
        });
        assert_eq!(saved.len(), 40, "{saved:?}");
        assert_eq!(fs::read_to_string(folder.join("hello-view-2.toml")).unwrap(), "mine");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 43);
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_reported() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("file"), "").unwrap();
        let captures = Captures::new(&dir.path().join("file/below"), Path::new("hello.toml"));
        let error = captures.save_scene(|_| Ok(String::new())).unwrap_err().to_string();
        assert!(error.contains("file/below"), "{error}");
    }
}
