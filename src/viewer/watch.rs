//! Which files a view is made of, and whether they changed since: polled, because every file system
//! can be, and told once they have settled, because a save is often a file cut to nothing, written
//! in parts, removed, and another renamed into its place.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use crate::passes;

/// What is known of a file without reading it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp {
    /// Where the file system knows.
    pub modified: Option<SystemTime>,
    pub n_bytes: u64,
}

impl Stamp {
    /// Of the regular file at `path`, or where a link there leads; None where there is none that
    /// can be asked.
    pub fn of(path: &Path) -> Option<Stamp> {
        let about = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
        Some(Stamp { modified: about.modified().ok(), n_bytes: about.len() })
    }
}

/// What has changed since it was last told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Changed {
    /// The scene's file, or one that it names.
    pub scene: bool,
    pub shaders: bool,
}

/// The files of a view.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Files {
    /// The scene's own and those that it names (`io::scene_file::load_and_name`).
    pub scene: Vec<PathBuf>,
    pub shaders: Vec<PathBuf>,
}

impl Files {
    /// `shaders` is the folder of `--shaders`. Of that all that nimbus would read, there or not
    /// yet.
    pub fn new(scene: Vec<PathBuf>, shaders: Option<&Path>) -> Files {
        let in_folder =
            |folder: &Path| passes::sources().names().map(|name| folder.join(name)).collect();
        Files { scene, shaders: shaders.map(in_folder).unwrap_or_default() }
    }
}

/// Files are looked at no more often: whoever polls at each frame asks the system of a hundred
/// files twenty times a second.
const EVERY: Duration = Duration::from_millis(50);
/// What nobody has touched for so long is whole: an editor's write of a scene takes less, and
/// nobody feels it.
const SETTLED: Duration = Duration::from_millis(100);
/// What has been away for so long was not renamed: it was removed.
const GONE: Duration = Duration::from_millis(1000);

/// Asks for a file's stamp.
pub type Ask = Box<dyn FnMut(&Path) -> Option<Stamp> + Send>;

/// Looks after the files of a view.
pub struct Watch {
    ask: Ask,
    scene: Vec<Watched>,
    shaders: Vec<Watched>,
    /// When they were last looked at.
    looked: Option<Instant>,
}

struct Watched {
    path: PathBuf,
    /// As it was when it was last told, or taken up.
    told: Option<Stamp>,
    /// As it was when it was last looked at.
    seen: Option<Stamp>,
    /// Since when it is so; None: since before it was looked at.
    since: Option<Instant>,
}

impl Watch {
    /// From how the files are now.
    pub fn new(files: Files) -> Watch {
        Watch::asking(files, Box::new(Stamp::of))
    }

    /// The same of files that somebody else knows.
    pub fn asking(files: Files, mut ask: Ask) -> Watch {
        let scene = watched(files.scene, &mut ask);
        let shaders = watched(files.shaders, &mut ask);
        Watch { ask, scene, shaders, looked: None }
    }

    /// The scene now is made of `files`. What was watched before goes on from what was told of it,
    /// so that nothing that happened while the scene was read is lost; what is new begins as it is.
    pub fn set_scene_files(&mut self, files: Vec<PathBuf>) {
        let mut before = std::mem::take(&mut self.scene);
        let taken = watched(files, &mut self.ask);
        let known = |new: Watched| match before.iter().position(|old| old.path == new.path) {
            Some(i) => before.swap_remove(i),
            None => new,
        };
        self.scene = taken.into_iter().map(known).collect();
    }

    /// What has changed since the last time that it was said, and stays as it is: asked of the file
    /// system where that was not done just now.
    pub fn poll(&mut self, now: Instant) -> Changed {
        if self.looked.is_some_and(|looked| now.saturating_duration_since(looked) < EVERY) {
            return Changed::default();
        }
        self.looked = Some(now);
        Changed {
            scene: look(&mut self.scene, now, &mut self.ask),
            shaders: look(&mut self.shaders, now, &mut self.ask),
        }
    }
}

fn watched(paths: Vec<PathBuf>, ask: &mut Ask) -> Vec<Watched> {
    let one = |path: PathBuf| {
        let stamp = ask(&path);
        Watched { path, told: stamp, seen: stamp, since: None }
    };
    paths.into_iter().map(one).collect()
}

/// Whether some of `files` are others than was told, and none of them is about to change further;
/// that is told then.
fn look(files: &mut [Watched], now: Instant, ask: &mut Ask) -> bool {
    for file in files.iter_mut() {
        let stamp = ask(&file.path);
        if stamp != file.seen {
            (file.seen, file.since) = (stamp, Some(now));
        }
    }
    let is_settled = |file: &Watched| {
        let least = if file.seen.is_none() && file.told.is_some() { GONE } else { SETTLED };
        file.since.is_none_or(|since| now.saturating_duration_since(since) >= least)
    };
    // Somebody who saves several files has them all in mind.
    let changes = files.iter().any(|file| file.seen != file.told) && files.iter().all(is_settled);
    if changes {
        files.iter_mut().for_each(|file| file.told = file.seen);
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use std::sync::{Arc, Mutex};

    const SCENE: Changed = Changed { scene: true, shaders: false };
    const SHADERS: Changed = Changed { scene: false, shaders: true };
    const NOTHING: Changed = Changed { scene: false, shaders: false };

    type Disk = Arc<Mutex<BTreeMap<PathBuf, Stamp>>>;

    /// A disk of "a", "b" (the scene's) and "s" (a shader) of one byte, and what watches it by a
    /// clock in milliseconds.
    fn watch() -> (Disk, impl FnMut(u64) -> Changed) {
        let disk: Disk = Arc::default();
        ["a", "b", "s"].iter().for_each(|name| write(&disk, name, 1));
        let asked = disk.clone();
        let files = Files { scene: vec!["a".into(), "b".into()], shaders: vec!["s".into()] };
        let mut watch = Watch::asking(
            files,
            Box::new(move |path: &Path| asked.lock().unwrap().get(path).copied()),
        );
        let begin = Instant::now();
        (disk, move |ms| watch.poll(begin + Duration::from_millis(ms)))
    }

    fn write(disk: &Disk, name: &str, n_bytes: u64) {
        disk.lock().unwrap().insert(name.into(), Stamp { modified: None, n_bytes });
    }

    #[test]
    fn a_change_is_told_once_and_when_it_has_settled() {
        let (disk, mut at) = watch();
        assert_eq!([at(0), at(500)], [NOTHING; 2]);
        write(&disk, "b", 2);
        assert_eq!([at(600), at(650), at(699)], [NOTHING; 3]);
        assert_eq!([at(700), at(800), at(2000)], [SCENE, NOTHING, NOTHING]);
        write(&disk, "s", 2);
        assert_eq!([at(2100), at(2200), at(2300)], [NOTHING, SHADERS, NOTHING]);
    }

    #[test]
    fn what_is_written_on_and_on_is_told_at_its_end() {
        let (disk, mut at) = watch();
        for k in 0..20 {
            write(&disk, "a", 2 + k);
            assert_eq!(at(60 * k), NOTHING, "{k}");
        }
        // The last part was seen at 1140.
        assert_eq!([at(1200), at(1250)], [NOTHING, SCENE]);
        // Another file of the same save is waited for.
        write(&disk, "a", 100);
        assert_eq!(at(2000), NOTHING);
        write(&disk, "b", 100);
        assert_eq!([at(2060), at(2120), at(2180)], [NOTHING, NOTHING, SCENE]);
    }

    #[test]
    fn what_is_away_for_a_moment_is_not_gone() {
        let (disk, mut at) = watch();
        let was = disk.lock().unwrap().remove(Path::new("a")).unwrap();
        assert_eq!([at(0), at(500), at(950)], [NOTHING; 3]);
        disk.lock().unwrap().insert("a".into(), was);
        // It came back as it was.
        assert_eq!([at(1000), at(1100), at(5000)], [NOTHING; 3]);
        disk.lock().unwrap().remove(Path::new("a"));
        assert_eq!(at(6000), NOTHING);
        write(&disk, "a", 7);
        assert_eq!([at(6100), at(6200)], [NOTHING, SCENE]);
        // What stays away is told, and so is that it is there again.
        disk.lock().unwrap().remove(Path::new("a"));
        assert_eq!([at(7000), at(7950), at(8000), at(9000)], [NOTHING, NOTHING, SCENE, NOTHING]);
        write(&disk, "a", 7);
        assert_eq!([at(9100), at(9200), at(9300)], [NOTHING, SCENE, NOTHING]);
    }

    #[test]
    fn what_goes_back_to_what_it_was_has_not_changed() {
        let (disk, mut at) = watch();
        write(&disk, "a", 2);
        assert_eq!(at(0), NOTHING);
        write(&disk, "a", 1);
        assert_eq!([at(60), at(200), at(1000)], [NOTHING; 3]);
    }

    #[test]
    fn the_disk_is_not_asked_at_every_frame() {
        let asked = Arc::new(Mutex::new(0));
        let count = asked.clone();
        let ask = move |_: &Path| {
            *count.lock().unwrap() += 1;
            None
        };
        let mut watch =
            Watch::asking(Files { scene: vec!["a".into()], shaders: vec![] }, Box::new(ask));
        let begin = Instant::now();
        let n_told =
            (0..1000).filter(|k| watch.poll(begin + Duration::from_millis(*k)) != NOTHING).count();
        assert_eq!((n_told, *asked.lock().unwrap()), (0, 1 + 20));
    }

    /// What was read before it was named is watched from then on; what changed while a scene was
    /// read is told.
    #[test]
    fn a_scene_may_come_to_name_other_files() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a", "b", "c"].map(|name| dir.path().join(name));
        [&a, &b, &c].into_iter().for_each(|path| fs::write(path, "x").unwrap());
        let mut watch = Watch::new(Files::new(vec![a.clone(), b.clone()], None));
        let begin = Instant::now();
        let mut ms = 0;
        let mut settled = |watch: &mut Watch| {
            ms += 1000;
            let polled =
                [0, 60, 120, 180].map(|k| watch.poll(begin + Duration::from_millis(ms + k)));
            polled.iter().filter(|changed| **changed != NOTHING).count()
        };
        fs::write(&a, "other").unwrap();
        assert_eq!(settled(&mut watch), 1);
        // While it is read again, which finds c in place of b.
        fs::write(&a, "another").unwrap();
        watch.set_scene_files(vec![a.clone(), c.clone()]);
        assert_eq!((settled(&mut watch), settled(&mut watch)), (1, 0));
        fs::write(&b, "nobody looks at it").unwrap();
        assert_eq!(settled(&mut watch), 0);
        fs::write(&c, "everybody does").unwrap();
        assert_eq!(settled(&mut watch), 1);
    }

    /// As editors save: in place, by a temporary name and a rename, by moving the old one away
    /// first.
    #[test]
    fn every_way_to_save_is_seen() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scene.toml");
        fs::write(&path, "a = 1").unwrap();
        let mut watch = Watch::new(Files::new(vec![path.clone()], None));
        let seen = |watch: &mut Watch| {
            let begin = Instant::now();
            let mut n = 0;
            while begin.elapsed() < Duration::from_millis(400) {
                n += u32::from(watch.poll(Instant::now()).scene);
                std::thread::sleep(Duration::from_millis(5));
            }
            n
        };
        assert_eq!(seen(&mut watch), 0);
        fs::write(&path, "a = 23").unwrap();
        assert_eq!(seen(&mut watch), 1);
        let temporary = dir.path().join(".scene.toml.swp");
        fs::write(&temporary, "a = 456").unwrap();
        fs::rename(&temporary, &path).unwrap();
        assert_eq!(seen(&mut watch), 1);
        fs::rename(&path, dir.path().join("scene.toml~")).unwrap();
        assert_eq!(watch.poll(Instant::now()), NOTHING);
        fs::write(&path, "a = 7890").unwrap();
        assert_eq!(seen(&mut watch), 1);
        // The same length, at another time.
        let later = fs::File::options().write(true).open(&path).unwrap();
        fs::write(&path, "a = 7891").unwrap();
        later.set_modified(SystemTime::now() + Duration::from_secs(2)).unwrap();
        assert_eq!(seen(&mut watch), 1);
        // A folder in its place is no file; that has to be gone for a while.
        fs::remove_file(&path).unwrap();
        fs::create_dir(&path).unwrap();
        assert_eq!(seen(&mut watch), 0);
    }

    #[test]
    fn shaders_are_those_that_would_be_read_and_also_new_ones() {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir(dir.path().join("include")).unwrap();
        fs::write(dir.path().join("present.frag"), "x").unwrap();
        let mut watch = Watch::new(Files::new(vec![], Some(dir.path())));
        let begin = Instant::now();
        let mut ms = 0;
        let mut told = |watch: &mut Watch| {
            ms += 1000;
            [0, 200].map(|k| watch.poll(begin + Duration::from_millis(ms + k)))[1]
        };
        fs::write(dir.path().join("present.frag"), "xy").unwrap();
        assert_eq!(told(&mut watch), SHADERS);
        // An editor's own.
        fs::write(dir.path().join("present.frag~"), "xy").unwrap();
        assert_eq!(told(&mut watch), NOTHING);
        fs::write(dir.path().join("include/functions.glsl"), "xy").unwrap();
        assert_eq!(told(&mut watch), SHADERS);
    }
}
