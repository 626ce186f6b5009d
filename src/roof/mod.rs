//! Measures the roofs of a device: bandwidth by the size of the data, arithmetic of each kind of
//! number, and atomics.
//!
//! [`measure`] runs small kernels whose results are known. It repeats each until its times agree,
//! within a limit of time. The rest of nimbus reads the kept results ([`Roofs::kept`]) and never
//! measures.
//!
//! [`Roofs::kept`]: crate::timing::roofs::Roofs::kept

mod arithmetic;
mod load;
mod measure;
mod memory;

pub use measure::{Budget, measure};
