//! The graph of files: which file imports which, with names that a folder's `mod.rs` hands on
//! resolved to the file that declares them. Circles in it, and its edges between rooms.

use std::collections::{BTreeMap, BTreeSet};

use super::source::{Import, Source};

/// Files by number, and for each the files that it imports.
pub struct Graph {
    pub paths: Vec<String>,
    pub imports: Vec<BTreeSet<usize>>,
}

impl Graph {
    /// Builds the graph of all files under src/, imports of test modules left out.
    pub fn new(sources: &[Source]) -> Graph {
        let modules: BTreeMap<Vec<String>, usize> =
            sources.iter().enumerate().map(|(i, s)| (s.module().to_vec(), i)).collect();
        let handed_on: BTreeMap<Vec<String>, Vec<String>> =
            sources.iter().flat_map(Source::handed_on).collect();
        let mut imports = vec![BTreeSet::new(); sources.len()];
        for (i, source) in sources.iter().enumerate() {
            let of_children = source.paths_into_children();
            let counts = |import: &Import| !import.in_test && !import.is_reexport;
            let all = source.imports().into_iter().filter(counts);
            let all = all.map(|import| import.path).chain(of_children);
            for path in all {
                if let Some(to) = file_of(path, &modules, &handed_on).filter(|to| *to != i) {
                    imports[i].insert(to);
                }
            }
        }
        let paths = sources.iter().map(|s| s.path.clone()).collect();
        Graph { paths, imports }
    }

    /// Returns the groups of files that import each other, directly or through others.
    pub fn circles(&self) -> Vec<Vec<&str>> {
        let n = self.paths.len();
        let reached: Vec<BTreeSet<usize>> = (0..n).map(|i| self.reach(i)).collect();
        let mut seen = BTreeSet::new();
        let mut circles = Vec::new();
        for i in 0..n {
            let circle: Vec<usize> =
                (i..n).filter(|&j| reached[i].contains(&j) && reached[j].contains(&i)).collect();
            if circle.len() > 1
                && seen.insert(circle[0])
                && !circle.iter().any(|j| seen.contains(j) && *j != circle[0])
            {
                seen.extend(&circle);
                circles.push(circle.iter().map(|&j| self.paths[j].as_str()).collect());
            }
        }
        circles
    }

    fn reach(&self, from: usize) -> BTreeSet<usize> {
        let mut reached = BTreeSet::new();
        let mut open = vec![from];
        while let Some(i) = open.pop() {
            open.extend(self.imports[i].iter().filter(|j| reached.insert(**j)));
        }
        reached
    }

    /// Returns the pairs of rooms of which the first imports the second. `error`, `lib` and `main`
    /// are no rooms.
    pub fn rooms(&self) -> BTreeSet<(String, String)> {
        let room = |i: usize| self.paths[i].split('/').next().unwrap_or_default().to_owned();
        let is_room = |name: &String| !name.ends_with(".rs");
        let pairs = self.imports.iter().enumerate();
        pairs
            .flat_map(|(i, to)| to.iter().map(move |j| (room(i), room(*j))))
            .filter(|(a, b)| a != b && is_room(a) && is_room(b))
            .collect()
    }
}

/// The file that `path` leads into: the longest part of it that is a module, after names that
/// modules hand on are followed.
fn file_of(
    mut path: Vec<String>,
    modules: &BTreeMap<Vec<String>, usize>,
    handed_on: &BTreeMap<Vec<String>, Vec<String>>,
) -> Option<usize> {
    // A chain of names handed on ends, or it would not compile.
    for _ in 0..8 {
        let step = (1..=path.len()).find_map(|n| Some((n, handed_on.get(&path[..n])?)));
        let Some((n, to)) = step else { break };
        path = to.iter().chain(&path[n..]).cloned().collect();
    }
    (1..=path.len()).rev().find_map(|n| modules.get(&path[..n]).copied())
}

/// Returns the arrows of the first mermaid diagram in `text`.
pub fn diagram(text: &str) -> BTreeSet<(String, String)> {
    let inside = text.split("```mermaid").nth(1).and_then(|rest| rest.split("```").next());
    let arrow = |line: &str| {
        let (from, to) = line.trim().split_once(" --> ")?;
        Some((from.to_owned(), to.to_owned()))
    };
    inside.unwrap_or_default().lines().filter_map(arrow).collect()
}

/// Compares a diagram with the imports between rooms. Each import must be an arrow or a way along
/// several, and each arrow an import.
pub fn compare(
    arrows: &BTreeSet<(String, String)>,
    rooms: &BTreeSet<(String, String)>,
) -> Vec<String> {
    let mut complaints = Vec::new();
    for (from, to) in rooms {
        let mut reached = BTreeSet::new();
        let mut open = vec![from];
        while let Some(room) = open.pop() {
            open.extend(
                arrows
                    .iter()
                    .filter(|(a, _)| a == room)
                    .map(|(_, b)| b)
                    .filter(|b| reached.insert(*b)),
            );
        }
        if !reached.contains(to) {
            complaints.push(format!("{from} imports {to}, and the diagram has no way there"));
        }
    }
    for (from, to) in arrows.difference(rooms) {
        complaints.push(format!("the diagram has {from} --> {to}, and no file imports so"));
    }
    complaints
}
