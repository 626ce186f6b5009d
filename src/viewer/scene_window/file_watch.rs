//! Notifications about changed scene and shader files.
//!
//! The operating system reports events in the folders of the watched files, so a file may also be
//! created, renamed or replaced. An editor often saves by several such steps. A change is therefore
//! reported only after the files have been quiet for a while.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf, absolute};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use notify::{Config, Event, EventKind, PollWatcher, RecursiveMode, Watcher};

use crate::passes;
use crate::viewer::sync::lock;

/// Files that have changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Changed {
    /// The scene's file, or a file that it names.
    pub scene: bool,
    /// A shader of the folder given by `--shaders`.
    pub shaders: bool,
}

/// Time without events after which a file counts as completely written: longer than the pauses of
/// an editor that saves, and too short to notice.
const SETTLED: Duration = Duration::from_millis(100);
/// Time after which a missing file counts as deleted. An editor that replaces a file needs less.
const DELETED: Duration = Duration::from_millis(1000);
/// Interval of polling, where the system has no notifications or its limit of watches is reached.
/// The window asks for changes as often.
const POLL_INTERVAL: Duration = Duration::from_millis(250);

#[derive(Default)]
struct State {
    scene: BTreeSet<PathBuf>,
    shaders: BTreeSet<PathBuf>,
    changed: Changed,
    last_event: Option<Instant>,
}

impl State {
    fn handle(&mut self, event: &Event) {
        if matches!(event.kind, EventKind::Access(_)) {
            return;
        }
        // An event of a folder concerns all files below it.
        let concerns = |files: &BTreeSet<PathBuf>| {
            event.paths.iter().any(|path| files.iter().any(|file| file.starts_with(path)))
        };
        let (scene, shaders) = (concerns(&self.scene), concerns(&self.shaders));
        if scene || shaders {
            self.changed.scene |= scene;
            self.changed.shaders |= shaders;
            self.last_event = Some(Instant::now());
        }
    }
}

/// A watch on the files of one scene window.
pub struct FileWatch {
    watcher: Option<Box<dyn Watcher + Send>>,
    folders: BTreeSet<PathBuf>,
    state: Arc<Mutex<State>>,
}

impl FileWatch {
    /// Watches `scene` files, and every shader that would be read from the folder `shaders`,
    /// whether or not the file exists yet.
    pub fn new(scene: &[PathBuf], shaders: Option<&Path>) -> FileWatch {
        let state = Arc::new(Mutex::new(State::default()));
        let handler = |state: &Arc<Mutex<State>>| {
            let state = state.clone();
            move |event: notify::Result<Event>| {
                event.iter().for_each(|event| lock(&state).handle(event));
            }
        };
        let polling = Config::default().with_poll_interval(POLL_INTERVAL);
        let watcher = notify::recommended_watcher(handler(&state))
            .map(|watcher| Box::new(watcher) as Box<dyn Watcher + Send>)
            .or_else(|_| {
                PollWatcher::new(handler(&state), polling)
                    .map(|watcher| Box::new(watcher) as Box<dyn Watcher + Send>)
            });
        let mut watch = FileWatch { watcher: watcher.ok(), folders: BTreeSet::new(), state };
        let sources = passes::sources();
        let in_folder = |folder: &Path| sources.names().map(|name| folder.join(name)).collect();
        let shaders: Vec<PathBuf> = shaders.map(in_folder).unwrap_or_default();
        let shaders = watch.add(&shaders);
        lock(&watch.state).shaders = shaders;
        watch.set_scene_files(scene);
        watch
    }

    /// Replaces the list of scene files. Events that arrived before are kept.
    pub fn set_scene_files(&mut self, files: &[PathBuf]) {
        let files = self.add(files);
        lock(&self.state).scene = files;
    }

    /// Watches the folders of `files`, and of the files that symbolic links lead to. Returns all
    /// paths that events may name.
    fn add(&mut self, files: &[PathBuf]) -> BTreeSet<PathBuf> {
        let files = files.iter().filter_map(|path| absolute(path).ok());
        let files: BTreeSet<PathBuf> =
            files.flat_map(|path| [path.canonicalize().ok(), Some(path)]).flatten().collect();
        for file in &files {
            // A folder that does not exist yet appears in the nearest one that does.
            let folder = file.ancestors().skip(1).find(|folder| folder.is_dir());
            if let (Some(folder), Some(watcher)) = (folder, &mut self.watcher)
                && self.folders.insert(folder.to_owned())
            {
                // A folder that cannot be watched is not followed; the window works without.
                let _ = watcher.watch(folder, RecursiveMode::NonRecursive);
            }
        }
        files
    }

    /// Takes the files that have changed and are completely written.
    pub fn take_changed(&mut self) -> Changed {
        let mut state = lock(&self.state);
        let is_missing = |files: &BTreeSet<PathBuf>| files.iter().any(|file| !file.is_file());
        let quiet = match state.changed.scene && is_missing(&state.scene) {
            true => DELETED,
            false => SETTLED,
        };
        if state.last_event.is_none_or(|last| last.elapsed() < quiet) {
            return Changed::default();
        }
        state.last_event = None;
        std::mem::take(&mut state.changed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const SCENE: Changed = Changed { scene: true, shaders: false };
    const SHADERS: Changed = Changed { scene: false, shaders: true };

    /// Waits for the next change.
    fn next(watch: &mut FileWatch) -> Changed {
        let begin = Instant::now();
        loop {
            let changed = watch.take_changed();
            if changed != Changed::default() {
                return changed;
            }
            assert!(begin.elapsed() < Duration::from_secs(60), "no change was reported");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    #[test]
    fn every_way_to_save_a_file_is_reported() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scene.toml");
        fs::write(&path, "a = 1").unwrap();
        let mut watch = FileWatch::new(std::slice::from_ref(&path), None);
        fs::write(&path, "a = 23").unwrap();
        assert_eq!(next(&mut watch), SCENE);
        let temporary = dir.path().join(".scene.toml.swp");
        fs::write(&temporary, "a = 456").unwrap();
        fs::rename(&temporary, &path).unwrap();
        assert_eq!(next(&mut watch), SCENE);
        fs::rename(&path, dir.path().join("scene.toml~")).unwrap();
        fs::write(&path, "a = 7890").unwrap();
        assert_eq!(next(&mut watch), SCENE);
        fs::remove_file(&path).unwrap();
        assert_eq!(next(&mut watch), SCENE);
        fs::write(&path, "a = 1").unwrap();
        assert_eq!(next(&mut watch), SCENE);
    }

    #[test]
    fn reading_and_other_files_are_not_reported() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
        [&a, &b].into_iter().for_each(|path| fs::write(path, "x").unwrap());
        let mut watch = FileWatch::new(std::slice::from_ref(&a), Some(&dir.path().join("none")));
        fs::read(&a).unwrap();
        fs::write(&b, "y").unwrap();
        fs::write(dir.path().join("a~"), "y").unwrap();
        // Events arrive in order, so the first one reported is that of `c`.
        let c = dir.path().join("c");
        watch.set_scene_files(std::slice::from_ref(&c));
        fs::write(&a, "z").unwrap();
        fs::write(&c, "z").unwrap();
        assert_eq!(next(&mut watch), SCENE);
        assert_eq!(lock(&watch.state).scene.len(), 1);
    }

    #[test]
    fn a_file_whose_folder_appears_later_is_reported() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("clouds/points.csv");
        let mut watch = FileWatch::new(std::slice::from_ref(&path), None);
        fs::create_dir(dir.path().join("clouds")).unwrap();
        assert_eq!(next(&mut watch), SCENE);
        watch.set_scene_files(std::slice::from_ref(&path));
        fs::write(&path, "x").unwrap();
        assert_eq!(next(&mut watch), SCENE);
    }

    #[test]
    #[cfg(unix)]
    fn the_target_of_a_symbolic_link_is_watched() {
        let [dir, other] = [0; 2].map(|_| tempfile::tempdir().unwrap());
        let (link, target) = (dir.path().join("scene.toml"), other.path().join("target.toml"));
        fs::write(&target, "x").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        let mut watch = FileWatch::new(&[link], None);
        fs::write(&target, "y").unwrap();
        assert_eq!(next(&mut watch), SCENE);
    }

    #[test]
    fn shaders_that_nimbus_would_read_are_reported_also_new_ones() {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir(dir.path().join("include")).unwrap();
        let mut watch = FileWatch::new(&[], Some(dir.path()));
        for name in ["present.frag", "include/functions.glsl", "present.frag"] {
            fs::write(dir.path().join(name), "x").unwrap();
            assert_eq!(next(&mut watch), SHADERS);
        }
    }
}
