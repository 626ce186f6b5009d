//! Spreads work over machines that share a folder. An engine (Slurm, another one, or the pool of
//! one machine) starts runs; what makes it safe to start them twice, to kill them or to cut them
//! off is here.
//!
//! A [`plan`] says what there is to do, in shards; a [`store`] holds what is done, each result
//! [`verified`](store::Store::standing) by its content; [`run`] does one shard, [`merge`] puts all
//! together, [`status`] and [`gc`] say and clear away. [`frames`], [`study`], [`bench`] and
//! [`reference`] are the work itself; [`emit`] and [`slurm`] hand it to engines, which need not
//! answer ([`ask`]).
//!
//! What that takes is predicted by [`cost`], fitted with [`nnls`]; [`split`] cuts items into shards
//! of such a length, and [`pack`] says who does which of them, when all is done, and at what price.

pub mod amounts;
pub mod ask;
pub mod attempts;
pub mod bench;
pub mod calibrate;
mod cells;
pub mod child;
pub mod cost;
pub mod emit;
pub mod failing;
pub mod frames;
pub mod gc;
mod layers;
pub mod merge;
pub mod nnls;
pub mod pack;
pub mod plan;
pub mod pool;
pub mod reference;
pub mod run;
pub mod slurm;
pub mod split;
pub mod status;
pub mod store;
pub mod study;
pub mod synced;
