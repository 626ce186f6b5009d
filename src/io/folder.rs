//! Folders of results whose files are replaced together. A reader, or a user after the process was
//! killed at any moment, finds all old files or all new ones, and every other file of the folder
//! unchanged.
//!
//! A new folder is made beside the old one, with the new files and with hard links to every other
//! file, and the two exchange their names in one step. Where that is impossible (see
//! [`exchanged`]), the files are replaced one by one. A kill in the few microseconds between those
//! renames leaves the folder without its last file, but never with files of two runs. The order of
//! writes to the disk is the file system's; a power cut may undo it.

use std::fs;
use std::path::Path;

use super::atomic::{Temporary, folder_of, in_progress};
use crate::error::{Error, Result};

/// Replaces the `files` of a folder with those that `write` puts into the folder it is given.
/// `write` may be called twice, and must make the last of `files`, which readers look for first.
/// Any other of `files` that it does not make is removed. When `write` fails, the old files stay.
///
/// # Errors
/// When `write` fails or the folder cannot be changed.
pub fn replace_files(
    folder: &Path,
    files: &[&str],
    write: impl Fn(&Path) -> Result<()>,
) -> Result<()> {
    if exchanged(folder, files, &write)? { Ok(()) } else { one_by_one(folder, files, &write) }
}

/// Checks that files can be made in `folder`.
///
/// # Errors
/// When they cannot.
pub fn check_writable(folder: &Path) -> Result<()> {
    // Asks the system and makes no trial file, because a killed process would leave that behind.
    #[cfg(unix)]
    let checked = {
        use rustix::fs::{Access, access};
        access(folder, Access::WRITE_OK | Access::EXEC_OK).map_err(std::io::Error::from)
    };
    #[cfg(not(unix))]
    let checked = Temporary::folder(folder, "results").map(drop);
    checked.map_err(|cause| Error::io(folder, format!("nothing can be written in it: {cause}")))
}

/// Moves the last file away, replaces the others, and puts the new last file there.
fn one_by_one(folder: &Path, files: &[&str], write: &dyn Fn(&Path) -> Result<()>) -> Result<()> {
    let failed = |cause| Error::io(folder, cause);
    // Inside the folder, because another folder may be on another file system.
    let staged = Temporary::folder(folder, "results").map_err(failed)?;
    write(&staged.path)?;
    let Some(last) = files.last().map(|name| folder.join(name)) else { return Ok(()) };
    let aside = staged.path.join("replaced");
    let mut paths = in_progress();
    let had_one = last.symlink_metadata().is_ok();
    if had_one {
        fs::rename(&last, &aside).map_err(failed)?;
    }
    for (i, name) in files.iter().enumerate() {
        if let Err(cause) = moved_or_removed(&staged.path.join(name), &folder.join(name)) {
            // If no file was replaced yet, the old files are complete again. Otherwise the old last
            // file stays in the temporary folder.
            if i == 0 && had_one {
                fs::rename(&aside, &last).map_err(failed)?;
                return Err(failed(cause));
            }
            let kept = staged.path.display().to_string();
            staged.keep(&mut paths);
            return Err(Error::io(
                folder,
                format!("{cause}; what was not put there is kept in {kept}"),
            ));
        }
    }
    Ok(())
}

/// Renames `new` to `old`, or removes `old` if there is no new file.
fn moved_or_removed(new: &Path, old: &Path) -> std::io::Result<()> {
    match new.symlink_metadata() {
        Ok(_) => fs::rename(new, old),
        Err(_) => match fs::remove_file(old) {
            Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => Err(cause),
            _ => Ok(()),
        },
    }
}

/// Makes a folder that is not there yet. Returns false for any other: nimbus exchanges the names of
/// folders on Linux only.
#[cfg(not(target_os = "linux"))]
fn exchanged(folder: &Path, _: &[&str], write: &dyn Fn(&Path) -> Result<()>) -> Result<bool> {
    if folder.symlink_metadata().is_ok() { Ok(false) } else { moved_in(folder, write) }
}

/// Replaces the folder as a whole. Returns false, with nothing changed, where that is impossible:
/// - The file system has no exchange or no hard links.
/// - The folder is a mount point or the root of a file system.
/// - The parent is not writable.
/// - The folder or a file belongs to another user, who would lose it.
/// - The folder holds folders, which may be a process's working directory.
/// - It is the working directory of this process, and so probably of the shell that started it.
#[cfg(target_os = "linux")]
fn exchanged(folder: &Path, files: &[&str], write: &dyn Fn(&Path) -> Result<()>) -> Result<bool> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    // A link to the folder stays and points to the new folder.
    let Ok(folder) = fs::canonicalize(folder) else { return moved_in(folder, write) };
    let (Some(parent), Some(name)) = (folder.parent(), folder.file_name()) else {
        return Ok(false);
    };
    if std::env::current_dir()
        .and_then(fs::canonicalize)
        .is_ok_and(|here| here.starts_with(&folder))
    {
        return Ok(false);
    }
    let Ok(staged) = Temporary::folder(parent, &name.to_string_lossy()) else { return Ok(false) };
    write(&staged.path)?;
    // Ctrl-C waits from here until the exchange is done.
    let mut paths = in_progress();
    if !beside::link_others(&folder, &staged.path, files)
        || renameat_with(CWD, &staged.path, CWD, &folder, RenameFlags::EXCHANGE).is_err()
    {
        return Ok(false);
    }
    // `staged` now names the old folder.
    beside::discard(&staged.path, &folder, files);
    staged.keep(&mut paths);
    Ok(true)
}

/// Moves the new folder to a place where there is none yet.
fn moved_in(folder: &Path, write: &dyn Fn(&Path) -> Result<()>) -> Result<bool> {
    let failed = |cause| Error::io(folder, cause);
    let Some(name) = folder.file_name() else {
        return Err(Error::io(folder, "expected a folder's name"));
    };
    let parent = folder_of(folder);
    let staged = Temporary::folder(parent, &name.to_string_lossy()).map_err(failed)?;
    write(&staged.path)?;
    let mut paths = in_progress();
    // The rename fails if a folder that is not empty has been made there meanwhile.
    fs::rename(&staged.path, folder).map_err(failed)?;
    staged.keep(&mut paths);
    Ok(true)
}

/// Two folders, one of which takes the place of the other.
#[cfg(target_os = "linux")]
mod beside {
    use std::fs::{self, Metadata};
    use std::io;
    use std::os::unix::fs::MetadataExt;
    use std::path::Path;

    /// Links all files in `from` except `left_out` into `to`. Returns false if one of them is a
    /// folder or cannot be linked.
    pub fn link_others(from: &Path, to: &Path, left_out: &[&str]) -> bool {
        let link = || -> io::Result<bool> {
            if !is_owned_alike(from, to)? {
                return Ok(false);
            }
            for entry in fs::read_dir(from)? {
                let entry = entry?;
                let (old, new) = (entry.path(), to.join(entry.file_name()));
                if entry.file_type()?.is_dir() {
                    return Ok(false);
                }
                if !left_out.iter().any(|name| entry.file_name() == *name) {
                    fs::hard_link(&old, &new)?;
                }
            }
            // Last, because a folder that is not writable takes no links.
            fs::set_permissions(to, fs::metadata(from)?.permissions())?;
            Ok(true)
        };
        link().unwrap_or(false)
    }

    /// Returns whether both are on one file system and belong to the same user and group.
    fn is_owned_alike(a: &Path, b: &Path) -> io::Result<bool> {
        let of = |about: Metadata| (about.dev(), about.uid(), about.gid());
        Ok(of(fs::metadata(a)?) == of(fs::metadata(b)?))
    }

    /// Removes the folder `old`, whose place `new` has taken, with the `replaced` files and those
    /// that both hold. Files made in `old` since the others were linked are moved to `new`. A file
    /// that cannot be removed stays, which does no harm to the results.
    pub fn discard(old: &Path, new: &Path, replaced: &[&str]) {
        for entry in fs::read_dir(old).into_iter().flatten().flatten() {
            let (gone, kept) = (entry.path(), new.join(entry.file_name()));
            let is_replaced = replaced.iter().any(|name| entry.file_name() == *name);
            let (Ok(of_gone), of_kept) = (gone.symlink_metadata(), kept.symlink_metadata()) else {
                continue;
            };
            let is_same = of_kept
                .as_ref()
                .is_ok_and(|k| (k.dev(), k.ino()) == (of_gone.dev(), of_gone.ino()));
            // A file saved to the old folder is moved, unless the new folder has a newer one of
            // that name.
            let saved = |about: &Metadata| about.modified().ok();
            let is_newer = of_kept.map_or(true, |kept| saved(&of_gone) >= saved(&kept));
            let _ = match (is_replaced || is_same, is_newer) {
                (true, _) => fs::remove_file(&gone),
                (false, true) => fs::rename(&gone, &kept),
                (false, false) => Ok(()),
            };
        }
        let _ = fs::remove_dir(old);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

    fn write_both(text: &str) -> impl Fn(&Path) -> Result<()> {
        move |folder| {
            for name in ["rows", "head"] {
                fs::write(folder.join(name), text).map_err(|cause| Error::io(folder, cause))?;
            }
            Ok(())
        }
    }

    /// Returns the names under `folder` with the content of files and the targets of links.
    fn tree(folder: &Path) -> Vec<(String, String)> {
        let mut found = Vec::new();
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if let Ok(target) = fs::read_link(&path) {
                found.push((name, format!("-> {}", target.display())));
            } else if path.is_dir() {
                found.push((name.clone(), String::new()));
                found.extend(
                    tree(&path).into_iter().map(|(inner, text)| (format!("{name}/{inner}"), text)),
                );
            } else {
                found.push((name, fs::read_to_string(&path).unwrap()));
            }
        }
        found.sort();
        found
    }

    /// Makes a user's folder with results `text` and other files.
    fn kept(parent: &Path, text: &str) -> std::path::PathBuf {
        let folder = parent.join("run");
        fs::create_dir_all(folder.join("plots/deep")).unwrap();
        write_both(text)(&folder).unwrap();
        fs::write(folder.join("notes.txt"), "mine").unwrap();
        fs::write(folder.join("plots/deep/a.png"), "picture").unwrap();
        symlink("nowhere", folder.join("link")).unwrap();
        folder
    }

    fn expected(text: &str) -> Vec<(String, String)> {
        let all = [
            ("head", text),
            ("link", "-> nowhere"),
            ("notes.txt", "mine"),
            ("plots", ""),
            ("plots/deep", ""),
            ("plots/deep/a.png", "picture"),
            ("rows", text),
        ];
        all.map(|(name, text)| (name.to_owned(), text.to_owned())).to_vec()
    }

    fn without_plots(text: &str) -> Vec<(String, String)> {
        expected(text).into_iter().filter(|(name, _)| !name.starts_with("plots")).collect()
    }

    const FILES: [&str; 2] = ["rows", "head"];

    #[test]
    fn both_ways_replace_the_files_and_keep_all_others() {
        for at_once in [true, false] {
            let way = |folder: &Path, write: &dyn Fn(&Path) -> Result<()>| match at_once {
                true => replace_files(folder, &FILES, write),
                false => one_by_one(folder, &FILES, write),
            };
            let dir = tempfile::tempdir().unwrap();
            let folder = kept(dir.path(), "old");
            let expected = if at_once { without_plots } else { expected };
            if at_once {
                fs::remove_dir_all(folder.join("plots")).unwrap();
            }
            fs::set_permissions(&folder, fs::Permissions::from_mode(0o2750)).unwrap();
            let inode = fs::metadata(folder.join("notes.txt")).unwrap().ino();
            way(&folder, &write_both("new")).unwrap();
            assert_eq!(tree(&folder), expected("new"));
            assert_eq!(fs::metadata(&folder).unwrap().permissions().mode() & 0o7777, 0o2750);
            assert_eq!(
                fs::metadata(folder.join("notes.txt")).unwrap().ino(),
                inode,
                "the file itself, not a copy"
            );
            assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "nothing is left beside it");
            way(&folder, &|f| write_both("half")(f).and(Err(Error::usage("no more")))).unwrap_err();
            assert_eq!(tree(&folder), expected("new"));
            assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "nor of what failed");
        }
    }

    #[test]
    fn files_that_are_not_made_again_are_removed() {
        for at_once in [true, false] {
            let dir = tempfile::tempdir().unwrap();
            let folder = dir.path().join("run");
            fs::create_dir(&folder).unwrap();
            write_both("old")(&folder).unwrap();
            for name in ["stale", "mine"] {
                fs::write(folder.join(name), "old").unwrap();
            }
            // A file that neither run has is no error.
            let files = ["rows", "stale", "never", "head"];
            match at_once {
                true => replace_files(&folder, &files, write_both("new")).unwrap(),
                false => one_by_one(&folder, &files, &write_both("new")).unwrap(),
            }
            let left = tree(&folder);
            let expected = [("head", "new"), ("mine", "old"), ("rows", "new")];
            assert_eq!(left, expected.map(|(name, text)| (name.to_owned(), text.to_owned())));
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn the_folder_is_exchanged_where_it_can_be() {
        let dir = tempfile::tempdir().unwrap();
        let folder = kept(dir.path(), "old");
        // A process may work in the folder's folders.
        assert!(!exchanged(&folder, &FILES, &write_both("new")).unwrap());
        fs::remove_dir_all(folder.join("plots")).unwrap();
        let held = fs::File::open(&folder).unwrap();
        assert!(exchanged(&folder, &FILES, &write_both("new")).unwrap());
        // The folder is a new one, and the old one is gone.
        assert_ne!(fs::metadata(&folder).unwrap().ino(), held.metadata().unwrap().ino());
        assert_eq!(held.metadata().unwrap().nlink(), 0);
        // A link to a folder stays a link.
        symlink("run", dir.path().join("latest")).unwrap();
        assert!(exchanged(&dir.path().join("latest"), &FILES, &write_both("newer")).unwrap());
        assert_eq!(
            (fs::read_link(dir.path().join("latest")).unwrap(), tree(&folder)),
            ("run".into(), without_plots("newer"))
        );
        // A missing folder is made.
        assert!(exchanged(&dir.path().join("first"), &FILES, &write_both("new")).unwrap());
        assert_eq!(tree(&dir.path().join("first")).len(), 2);
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 3);
        // The root of the file system is refused.
        assert!(!exchanged(Path::new("/"), &FILES, &|_| panic!("must not be called")).unwrap());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn files_made_meanwhile_are_moved() {
        let dir = tempfile::tempdir().unwrap();
        let (folder, other) = (kept(dir.path(), "old"), dir.path().join("other"));
        fs::remove_dir_all(folder.join("plots")).unwrap();
        fs::create_dir(&other).unwrap();
        write_both("new")(&other).unwrap();
        assert!(beside::link_others(&folder, &other, &FILES));
        // An editor saves a file by a rename; a file and a folder are made.
        fs::write(dir.path().join("saved"), "edited").unwrap();
        fs::rename(dir.path().join("saved"), folder.join("notes.txt")).unwrap();
        fs::write(folder.join("later.txt"), "later").unwrap();
        fs::create_dir(folder.join("empty")).unwrap();
        beside::discard(&folder, &other, &FILES);
        assert!(!folder.exists());
        let mut all = without_plots("new");
        all[2].1 = "edited".to_owned();
        let came = [("later.txt", "later"), ("empty", "")];
        all.extend(came.map(|(name, text)| (name.to_owned(), text.to_owned())));
        all.sort();
        assert_eq!(tree(&other), all);
    }
}
