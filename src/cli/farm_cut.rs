//! How work is cut into shards: by number, or by what a cost model says that it takes.

use std::path::Path;

use super::args::PlanArgs;
use crate::error::{Error, Result};
use crate::farm::calibrate::Calibration;
use crate::farm::cost::Work as Counted;
use crate::farm::pack::split;
use crate::farm::plan::{Class, Work};

/// Work, and its shards in order: their items, what takes time in each, and how long that is.
pub(super) struct Cut {
    pub work: Work,
    pub sizes: Vec<u32>,
    pub counted: Vec<Counted>,
    pub predicted_s: Option<Vec<f64>>,
    pub predicted_for: Option<Class>,
}

/// What takes time in work, item by item, and in every shard besides.
pub(super) struct Amounts {
    pub items: Vec<Counted>,
    pub of_shard: Counted,
}

/// A calibration, and where it was read.
pub(super) struct Model<'a> {
    file: &'a Path,
    of: Calibration,
}

impl<'a> Model<'a> {
    pub fn read(file: &'a Path) -> Result<Model<'a>> {
        Ok(Model { file, of: Calibration::read(file)? })
    }

    /// Refuses work of another kind than was timed.
    pub fn check(&self, work: &Work) -> Result<()> {
        let (of, kind) = (&self.of.of, work.kind());
        if *of == kind {
            return Ok(());
        }
        Err(Error::io(self.file, format!("it was calibrated by {of}; expected one of {kind}")))
    }

    /// What that takes with so many set-ups.
    pub fn seconds(&self, setups: f64, counted: &Counted) -> Result<f64> {
        self.of.fit.model.seconds(setups, counted).map_err(|what| Error::io(self.file, what))
    }
}

/// `work` in shards of `each` items; where nobody said how many, by the model, or else `usual`.
pub(super) fn cut(
    args: &PlanArgs,
    work: Work,
    amounts: &Amounts,
    (each, usual): (Option<u32>, u32),
) -> Result<Cut> {
    let model = args.model.as_deref().map(Model::read).transpose()?;
    let n = amounts.items.len() as u32;
    let sizes = match (&model, each) {
        (Some(model), None) => {
            model.check(&work)?;
            let item_s = amounts
                .items
                .iter()
                .map(|item| model.seconds(0.0, item))
                .collect::<Result<Vec<f64>>>()?;
            let setup_s = model.seconds(1.0, &amounts.of_shard)?;
            let (least, most) = args.lengths();
            split(&item_s, setup_s, least, most, args.n_nodes())
                .iter()
                .map(|r| r.len() as u32)
                .collect()
        }
        (_, each) => even(n, each.unwrap_or(usual)),
    };
    let mut rest = &amounts.items[..];
    let of_shard = |n: &u32| {
        let (part, after) = rest.split_at(*n as usize);
        rest = after;
        part.iter().fold(amounts.of_shard, |sum, item| sum + *item)
    };
    let counted: Vec<Counted> = sizes.iter().map(of_shard).collect();
    let predicted_s = match &model {
        Some(model) => {
            model.check(&work)?;
            Some(
                counted
                    .iter()
                    .map(|shard| model.seconds(1.0, shard))
                    .collect::<Result<Vec<f64>>>()?,
            )
        }
        None => None,
    };
    let predicted_for = model.map(|model| model.of.class());
    Ok(Cut { work, sizes, counted, predicted_s, predicted_for })
}

fn even(n: u32, each: u32) -> Vec<u32> {
    let rest = n % each;
    (0..n / each).map(|_| each).chain((rest > 0).then_some(rest)).collect()
}
