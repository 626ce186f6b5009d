//! Configurations of an error study: each shard is a `nimbus error --part`, and all shards together
//! are the study that one `nimbus error` makes.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::subprocess;
use super::task::{Merge, Merged, ShardResult, Task, Work};
use crate::error::{Error, Result};
use crate::report::charts::{self, Chart};
use crate::studies::error::files::{self, CONFIGURATIONS_FILE, REFERENCE_FILE, TIMES_FILE};
use crate::studies::error::parts::{Joined, Part, differences, join};
use crate::studies::error::records;
use crate::timing::json::{self, ResultFile};
use crate::timing::machine::Device;

/// An error study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// The arguments of `nimbus error`.
    pub arguments: Vec<String>,
    /// The names of all configurations.
    pub configurations: Vec<String>,
}

impl Work for Study {
    fn kind(&self) -> String {
        "error study".to_owned()
    }

    fn noun(&self) -> &'static str {
        "configurations"
    }

    fn items(&self) -> Range<u64> {
        0..self.configurations.len() as u64
    }

    fn identity(&self) -> Value {
        json!({"kind": "error", "work": self})
    }

    /// Every shard has pictures besides these.
    fn outputs(&self, _: Range<u32>) -> Vec<String> {
        [CONFIGURATIONS_FILE, records::Study::FILE, TIMES_FILE].map(str::to_owned).to_vec()
    }

    fn is_exact(&self) -> bool {
        false
    }

    fn run(&self, task: &mut Task<'_>) -> Result<Device> {
        let read = json::read::<records::Study>;
        Ok(subprocess::run("error", &self.arguments, task, read)?.made.device)
    }

    fn merge(&self, merge: &Merge<'_>) -> Result<Merged> {
        let results = merge.results;
        let read = |result: &ShardResult| {
            let (study, results) = files::read_earlier(&result.folder)?;
            Ok(Part { name: result.name(), study, results })
        };
        let parts: Vec<Part> = results.iter().map(read).collect::<Result<_>>()?;
        subprocess::check_comparable(differences(&parts), results)?;
        let Some(Joined { study, results: joined, pictures }) = join(&parts) else {
            return Err(Error::usage("the plan has no shards"));
        };
        let n = study.configurations.len();
        let mut folder = files::open(merge.out, merge.existing, n)?;
        let from = |i_part: usize, name: &str| results[i_part].folder.join(name);
        let mut copies: Vec<_> =
            pictures.iter().map(|p| (p.to.clone(), from(p.i_part, &p.from))).collect();
        copies.push((REFERENCE_FILE.to_owned(), from(0, REFERENCE_FILE)));
        let chart = charts::error::chart(&study);
        let svg = chart.svg(chart.size())?;
        let written = files::write_last(&mut folder, &study, &joined, &svg, &copies);
        Ok(Merged { n, summary: String::new(), written })
    }
}
