//! Studies of run time against error: error studies over knobs, and the ledger of approximations.

pub mod error;
pub mod ledger;
pub mod provenance;
pub mod reference_cache;
