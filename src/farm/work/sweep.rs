//! Cases of a bench: each shard is a `nimbus bench --part`, and all shards together are the bench
//! that one `nimbus bench` makes.

use std::collections::BTreeSet;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::subprocess;
use super::task::{Merge, Merged, ShardResult, Task, Work};
use crate::error::{Error, Result};
use crate::timing::attachments::{Attachments, picture_file};
use crate::timing::frame_rows::FRAMES_FILE;
use crate::timing::json;
use crate::timing::machine::Device;
use crate::timing::parts::{Part, base_spread, differences, join, numbers};
use crate::timing::records::{Case, PartRecord, Run};
use crate::timing::results::{RUN_FILE, open_results, write_results};
use crate::timing::state::{STATE_FILE, rows_text};

/// A bench of several cases.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// The arguments of `nimbus bench`.
    pub arguments: Vec<String>,
    /// The names of all cases.
    pub cases: Vec<String>,
}

impl Work for Sweep {
    fn kind(&self) -> String {
        "bench".to_owned()
    }

    fn noun(&self) -> &'static str {
        "cases"
    }

    fn items(&self) -> Range<u64> {
        0..self.cases.len() as u64
    }

    fn identity(&self) -> Value {
        json!({"kind": "bench", "work": self})
    }

    fn outputs(&self, items: Range<u32>) -> Vec<String> {
        let mut names: Vec<String> =
            (0..numbers(&as_usize(items)).len()).map(picture_file).collect();
        names.extend([FRAMES_FILE, RUN_FILE].map(str::to_owned));
        names.sort();
        names
    }

    fn is_exact(&self) -> bool {
        false
    }

    fn run(&self, task: &mut Task<'_>) -> Result<Device> {
        Ok(subprocess::run("bench", &self.arguments, task, json::read::<Run>)?.device)
    }

    fn merge(&self, merge: &Merge<'_>) -> Result<Merged> {
        let results = merge.results;
        let read = |result: &ShardResult| {
            let node = result.manifest.node.clone();
            Part::read(&result.folder, result.name(), node, as_usize(result.items.clone()))
        };
        let parts: Vec<Part> = results.iter().map(read).collect::<Result<_>>()?;
        subprocess::check_comparable(differences(&parts), results)?;
        let Some(joined) = join(&parts) else {
            return Err(Error::usage("the plan has no shards"));
        };
        let found: Vec<String> = joined.run.cases.iter().map(Case::name).collect();
        if found != self.cases {
            let [found, planned] = [&found, &self.cases].map(|names| names.join("; "));
            let what = format!("the parts' cases ({found}) are not the plan's ({planned})");
            return Err(Error::Check { what });
        }
        let n = joined.run.cases.len();
        let mut folder = open_results(merge.out, merge.existing, n, false)?;
        let pictures = joined.pictures.iter();
        let copies = pictures
            .map(|moved| (moved.to.clone(), results[moved.i_part].folder.join(&moved.from)));
        let tables = match &joined.state[..] {
            [] => vec![],
            rows => vec![(STATE_FILE.to_owned(), rows_text(rows)?)],
        };
        let copies = copies.collect();
        let beside = Attachments { copies, tables, ..Attachments::default() };
        let written = write_results(&mut folder, &joined.run, &joined.table, &beside);
        Ok(Merged { n, summary: summary(&joined.run.parts), written })
    }
}

/// Tells by how much the nodes differ in the first case, which every shard times.
fn summary(parts: &[PartRecord]) -> String {
    let spread = base_spread(parts);
    if spread.is_empty() {
        return String::new();
    }
    let nodes: BTreeSet<&str> = parts.iter().map(|part| part.node.as_str()).collect();
    let each: Vec<String> = spread.iter().map(|(name, by)| format!("{name} {by:.3}")).collect();
    let (n, n_nodes, s) = (parts.len(), nodes.len(), if nodes.len() == 1 { "" } else { "s" });
    format!(
        "the first case, timed in each of {n} shards on {n_nodes} node{s}: ratio of the greatest \
         median frame time to the least: {}\n",
        each.join(", ")
    )
}

fn as_usize(items: Range<u32>) -> Range<usize> {
    items.start as usize..items.end as usize
}
