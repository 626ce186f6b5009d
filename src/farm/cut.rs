//! Division of work into shards, by a number of items or by a cost model.

use super::calibration::FileModel;
use super::cost::{Amounts, Workload, split};
use super::manifest::Class;
use super::work::AnyWork;
use crate::error::{Error, Result};

/// Most shards of a plan: `plan.json` has at least 300 bytes for each.
const MOST_SHARDS: usize = 50_000;
/// Most frames, configurations or cases of a plan. The amounts of each are counted.
pub const MOST_ITEMS: u32 = 1_000_000;

/// The conditions by which a cost model divides work.
#[derive(Debug, Clone)]
pub struct CutOptions {
    /// The cost model.
    pub model: Option<FileModel>,
    /// The least and the greatest duration of a shard, s.
    pub shard_seconds: (f64, f64),
    /// The number of nodes that share the work.
    pub n_nodes: usize,
}

/// The number of items of a shard.
#[derive(Debug, Clone, Copy)]
pub struct ShardSize {
    /// The number that was asked for.
    pub asked: Option<u32>,
    /// The number where none was asked for and there is no model.
    pub usual: u32,
}

/// Work and its shards, in the order of their items.
#[derive(Debug, Clone)]
pub struct Cut {
    /// The work.
    pub work: AnyWork,
    /// The shards.
    pub parts: Vec<Part>,
    /// The hardware that the durations are predicted for.
    pub predicted_for: Option<Class>,
}

/// A shard of some work.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    /// The number of its items.
    pub n: u32,
    /// Its amounts, where they were counted.
    pub counted: Option<Amounts>,
    /// Its predicted duration, where there is a model, s.
    pub predicted_s: Option<f64>,
}

impl Cut {
    /// Makes all of the work one shard.
    pub fn single(work: AnyWork) -> Cut {
        let items = work.items();
        let n = (items.end - items.start) as u32;
        let whole = Part { n, counted: None, predicted_s: None };
        Cut { work, parts: vec![whole], predicted_for: None }
    }

    /// Divides work by the number of items asked for, else by the model, else by the usual number.
    ///
    /// # Errors
    /// When the model is of another kind of work, or does not know one of its amounts.
    pub fn new(
        work: AnyWork,
        workload: &Workload,
        size: ShardSize,
        options: &CutOptions,
    ) -> Result<Cut> {
        let Workload { items, per_shard } = workload;
        let model = options.model.as_ref();
        model.map_or(Ok(()), |model| model.check(&*work))?;
        let sizes: Vec<u32> = match (model, size.asked) {
            (Some(model), None) => {
                let seconds = items.iter().map(|item| model.seconds(0.0, item));
                let item_s = seconds.collect::<Result<Vec<f64>>>()?;
                let setup_s = model.seconds(1.0, per_shard)?;
                let (least_s, most_s) = options.shard_seconds;
                let shards = split(&item_s, setup_s, least_s, most_s, options.n_nodes);
                shards.iter().map(|items| items.len() as u32).collect()
            }
            (_, asked) => {
                let chunks = items.chunks(asked.unwrap_or(size.usual) as usize);
                chunks.map(|items| items.len() as u32).collect()
            }
        };
        if sizes.len() > MOST_SHARDS {
            return Err(Error::limit(format!(
                "{} shards, expected at most {MOST_SHARDS}, for which plan.json has room; give \
                 each shard more items",
                sizes.len()
            )));
        }
        let mut rest = &items[..];
        let part = |n: u32| {
            let (own, after) = rest.split_at(n as usize);
            rest = after;
            let amounts = own.iter().copied().sum::<Amounts>() + *per_shard;
            let predicted_s = model.map(|model| model.seconds(1.0, &amounts)).transpose()?;
            Ok(Part { n, counted: Some(amounts), predicted_s })
        };
        let parts = sizes.into_iter().map(part).collect::<Result<_>>()?;
        Ok(Cut { work, parts, predicted_for: model.map(FileModel::class) })
    }
}
