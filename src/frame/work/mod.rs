//! The least work that each pass of a frame has to do: the floor that its time is compared with.

mod amounts;
mod floor;
mod layers;
mod marches;

pub use amounts::{Amounts, Blobs};
pub use floor::{Work, floor};
