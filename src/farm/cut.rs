//! Division of work into shards, by a number of items or by a cost model.

use super::calibration::FileModel;
use super::cost::{Amounts, Workload, split};
use super::manifest::Class;
use super::work::AnyWork;
use crate::error::Result;

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
    /// The number of items of each shard.
    pub sizes: Vec<u32>,
    /// The amounts of each shard; empty where they were not counted.
    pub counted: Vec<Amounts>,
    /// The predicted duration of each shard, where there is a model, s.
    pub predicted_s: Option<Vec<f64>>,
    /// The hardware that the durations are predicted for.
    pub predicted_for: Option<Class>,
}

impl Cut {
    /// Makes all of the work one shard.
    pub fn single(work: AnyWork) -> Cut {
        let items = work.items();
        let sizes = vec![(items.end - items.start) as u32];
        Cut { work, sizes, counted: Vec::new(), predicted_s: None, predicted_for: None }
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
        let mut rest = &items[..];
        let counted: Vec<Amounts> = sizes
            .iter()
            .map(|n| {
                let (part, after) = rest.split_at(*n as usize);
                rest = after;
                part.iter().copied().sum::<Amounts>() + *per_shard
            })
            .collect();
        let predict = |model: &FileModel| {
            counted.iter().map(|work| model.seconds(1.0, work)).collect::<Result<Vec<f64>>>()
        };
        let predicted_s = model.map(predict).transpose()?;
        let predicted_for = model.map(FileModel::class);
        Ok(Cut { work, sizes, counted, predicted_s, predicted_for })
    }
}
