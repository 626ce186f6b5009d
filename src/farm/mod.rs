//! Spreads work over machines that share a folder. An engine (Slurm, another one, or the pool of one machine) starts runs;
//! what makes it safe to start them twice, to kill them or to cut them off is here.
//!
//! A [`plan`] says what there is to do, in shards; a [`store`] holds what is done, each result [`verified`](store::Store::standing)
//! by its content; [`run`] does one shard, [`merge`] puts all together, [`status`] and [`gc`] say and clear away. [`frames`]
//! is the work itself; [`emit`] and [`slurm`] hand it to engines.

pub mod attempts;
pub mod emit;
pub mod failing;
pub mod frames;
pub mod gc;
pub mod merge;
pub mod plan;
pub mod pool;
pub mod run;
pub mod slurm;
pub mod status;
pub mod store;
pub mod synced;
