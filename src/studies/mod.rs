//! Studies of run time against error.
//!
//! An [`error`] study draws and times every setting of a scene's knobs. A [`ledger`] lists the
//! error of every approximation, each against the next better picture. Both measure pictures by
//! [`picture_error`] against references in f64, and by [`cloud_error`] against random paths. They
//! begin their records with [`provenance`].
//! References are kept between runs by the [`reference_hash`] of what they depend on:
//! [`reference_cache`] reads them back, and [`kept_paths`] goes on from random paths. A [`check`]
//! compares the pictures that a bench timed.

pub mod check;
pub mod cloud_error;
pub mod error;
pub mod kept_paths;
pub mod ledger;
pub mod picture_error;
pub mod provenance;
pub mod reference_cache;
pub mod reference_hash;
