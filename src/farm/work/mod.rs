//! The kinds of work that a farm does. Each is a file with an implementation of [`Work`]; the
//! other files of the farm know that trait alone.

mod frames;
mod reference;
mod study;
mod subprocess;
mod sweep;
mod task;

use std::ops::Deref;

use serde::{Deserialize, Serialize};

pub use frames::Frames;
pub use reference::ReferenceWork;
pub use study::Study;
pub use sweep::Sweep;
pub use task::{Merge, Merged, ShardResult, Task, Work};

/// Work of any kind, as `plan.json` describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum AnyWork {
    /// Pictures of an animation's frames.
    Frames(Frames),
    /// The configurations of an error study.
    Error(Study),
    /// The cases of a bench.
    Bench(Sweep),
    /// A picture in f64, in tiles and ranges of samples.
    Reference(ReferenceWork),
}

impl Deref for AnyWork {
    type Target = dyn Work;

    fn deref(&self) -> &Self::Target {
        match self {
            AnyWork::Frames(work) => work,
            AnyWork::Error(work) => work,
            AnyWork::Bench(work) => work,
            AnyWork::Reference(work) => work,
        }
    }
}
