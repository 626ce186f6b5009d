//! Fixtures that are files of /sys and /proc (tests/data/state/README.md).

use std::fs;
use std::path::{Path, PathBuf};

use nimbus::timing::state::{DeviceNames, Event, Folders, Sources, StateRow};
use tempfile::TempDir;

/// A tree that has been unpacked up to its first reading, and the steps from there on.
pub struct Tree {
    folder: TempDir,
    steps: Vec<String>,
}

fn path_of(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/state").join(name)
}

/// Returns the text of a fixture.
pub fn text_of(name: &str) -> String {
    fs::read_to_string(path_of(name)).expect("a fixture")
}

impl Tree {
    /// Unpacks a fixture.
    pub fn new(name: &str) -> Tree {
        let text = text_of(name);
        let lines = text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
        let lines: Vec<&str> = lines.collect();
        let first = lines.iter().position(|line| line.starts_with('@')).expect("a reading");
        let folder = tempfile::tempdir().expect("a folder");
        let steps = lines[first..].iter().map(|line| (*line).to_owned()).collect();
        let tree = Tree { folder, steps };
        lines[..first].iter().for_each(|line| tree.write(line));
        tree
    }

    /// Returns the folders in place of /sys and /proc.
    pub fn folders(&self) -> Folders {
        let root = self.folder.path();
        Folders { sys: root.to_owned(), proc: root.join("proc") }
    }

    /// Opens the sources of a device.
    pub fn open(&self, names: &DeviceNames) -> (Sources, Vec<String>) {
        Sources::open(names, None, &self.folders())
    }

    /// Opens the sources of a device that is there, and takes all readings.
    pub fn rows(&self, names: &DeviceNames) -> Vec<StateRow> {
        let (mut sources, notes) = self.open(names);
        assert_eq!(notes, [""; 0]);
        let mut rows = Vec::new();
        for step in &self.steps {
            let Some(reading) = step.strip_prefix("@ ") else {
                self.write(step);
                continue;
            };
            let words: Vec<&str> = reading.split(' ').collect();
            let event = match words[1] {
                "start" => Event::Start,
                "begin" => Event::Begin,
                "tick" => Event::Tick,
                "end" => Event::End,
                other => panic!("no event: {other}"),
            };
            let block = words.get(2).map(|block| block.parse().expect("a block"));
            rows.push(sources.read(words[0].parse().expect("a time"), event, block));
        }
        rows
    }

    fn write(&self, line: &str) {
        let root = self.folder.path();
        let at = |name: &str| {
            let path = root.join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("room");
            path
        };
        if let Some((name, target)) = line.split_once(" -> ") {
            fs::create_dir_all(root.join(target)).expect("room");
            std::os::unix::fs::symlink(root.join(target), at(name)).expect("a link");
        } else if let Some((name, text)) = line.split_once(" = ") {
            fs::write(at(name), text.replace("\\n", "\n") + "\n").expect("room");
        } else {
            let (name, hex) = line.split_once(" : ").expect("a file");
            fs::write(at(name), hex.split(' ').flat_map(bytes).collect::<Vec<u8>>()).expect("room");
        }
    }
}

/// Returns the bytes of "0a1b" or "3*00".
fn bytes(word: &str) -> Vec<u8> {
    let (n, hex) = word.split_once('*').unwrap_or(("1", word));
    let byte = |i: usize| u8::from_str_radix(&hex[i..i + 2], 16).expect("hexadecimal digits");
    (0..hex.len()).step_by(2).map(byte).collect::<Vec<u8>>().repeat(n.parse().expect("a number"))
}
