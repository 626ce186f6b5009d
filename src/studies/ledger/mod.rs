//! The ledger of approximations: the error of each against the next better picture (model.md §10).
//!
//! [`study`] makes the chain of pictures and compares neighbours; [`records`] are the types of
//! `ledger.json`.

mod approximations;
pub mod records;
pub mod study;
