//! Opens input files. A pipe, a device or a folder is refused at once, and so is a file above its
//! limit: a reader of it would wait forever or fill the memory.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// Largest picture file: EXR of 4K in f32 without compression, twice.
pub const PICTURE_LIMIT: u64 = 256 << 20;

/// Opens a regular file of at most `limit` bytes.
///
/// # Errors
/// Fails if there is no such file, it cannot be opened, is no regular file, or is larger.
pub fn open(path: &Path, limit: u64) -> io::Result<File> {
    // Opening a pipe waits for its writer, so the kind comes first.
    let about = path.metadata()?;
    let refuse = |what: &str| Err(io::Error::new(ErrorKind::InvalidInput, what.to_owned()));
    if about.is_dir() {
        return refuse("is a folder, expected a file");
    }
    if !about.is_file() {
        return refuse("is not a regular file");
    }
    if about.len() > limit {
        return refuse(&too_large(about.len(), limit));
    }
    let file = File::open(path)?;
    if is_virtual(&file) {
        return refuse("is not a regular file: the kernel makes its content");
    }
    Ok(file)
}

/// Reads a regular file of at most `limit` bytes.
///
/// # Errors
/// As [`open`], and when reading fails.
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // The file may have grown since its size was checked.
    open(path, limit)?.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return Err(io::Error::new(ErrorKind::InvalidInput, too_large(bytes.len() as u64, limit)));
    }
    Ok(bytes)
}

/// Reads a regular file of at most `limit` bytes as text.
///
/// # Errors
/// As [`read`], and when the file is not UTF-8.
pub fn read_string(path: &Path, limit: u64) -> io::Result<String> {
    String::from_utf8(read(path, limit)?)
        .map_err(|_| io::Error::new(ErrorKind::InvalidData, "is not UTF-8 text"))
}

fn too_large(size: u64, limit: u64) -> String {
    format!(
        "too large: {} MiB ({size} bytes), the limit is {} MiB",
        size.div_ceil(1 << 20),
        limit >> 20
    )
}

/// Returns whether a file lies in a virtual file system such as /proc or /sys. The sizes of such
/// files say nothing, and some of them never end.
#[cfg(target_os = "linux")]
fn is_virtual(file: &File) -> bool {
    /// Magic numbers of proc, sysfs, cgroup2, tracefs and debugfs (linux/magic.h).
    const VIRTUAL: [u64; 5] = [0x9fa0, 0x6265_6572, 0x6367_7270, 0x7472_6163, 0x6462_6720];
    rustix::fs::fstatfs(file).is_ok_and(|about| VIRTUAL.contains(&(about.f_type as u64)))
}

/// Returns false: only Linux has such files.
#[cfg(not(target_os = "linux"))]
fn is_virtual(_: &File) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(path: &str) -> String {
        read(Path::new(path), 1 << 20).unwrap_err().to_string()
    }

    #[test]
    fn what_is_no_file_is_refused_before_it_is_read() {
        assert!(refusal("/dev/zero").contains("not a regular file"));
        assert!(refusal("/").contains("is a folder"));
        #[cfg(target_os = "linux")]
        for path in ["/proc/self/status", "/proc/self/maps", "/sys/kernel/notes"] {
            let is_there = Path::new(path).exists();
            assert!(!is_there || refusal(path).contains("the kernel makes"), "{path}");
        }
    }

    #[test]
    fn a_file_above_the_limit_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        std::fs::write(&path, [b'x'; 100]).unwrap();
        assert_eq!(read(&path, 100).unwrap().len(), 100);
        let error = read(&path, 99).unwrap_err().to_string();
        assert!(error.contains("too large") && error.contains("100 bytes"), "{error}");
    }
}
