//! The ways in which passes are timed.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// The way in which the times of passes are taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum PassTimes {
    /// The device finishes each pass before it begins the next one: a time is that of its pass
    /// alone, and the frame takes longer by the waits between passes
    #[default]
    Drained,
    /// Passes overlap where they can, as without timers, and so do their times
    Overlapping,
    /// No pass is timed
    Off,
}

impl PassTimes {
    /// Returns the name, as an argument and results have it.
    pub fn name(self) -> &'static str {
        match self {
            PassTimes::Drained => "drained",
            PassTimes::Overlapping => "overlapping",
            PassTimes::Off => "off",
        }
    }
}
