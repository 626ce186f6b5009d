//! The decision to run a pass or to skip it, with the reason.

use std::fmt;

/// Whether a pass runs, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decision {
    /// Whether the pass runs.
    pub run: bool,
    /// The reason.
    pub reason: Reason,
}

impl Decision {
    pub(super) const RUN: Decision = Decision { run: true, reason: Reason::Of("needed") };

    /// Returns the decision to skip a pass.
    pub(in crate::frame) fn skip(reason: &'static str) -> Decision {
        Decision { run: false, reason: Reason::Of(reason) }
    }
}

/// Why a pass runs or is skipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// A reason without numbers.
    Of(&'static str),
    /// The tensor T2 does not fit the device.
    TooLarge {
        /// Bytes of T2.
        bytes: u64,
        /// Bytes that the device has for it.
        most: u64,
    },
    /// An impostor layer is drawn, for this reason.
    Made(&'static str),
    /// An impostor layer is shown again.
    Reused {
        /// Bound of its error, in thousandths of a pixel.
        milli_px: u32,
    },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Of(text) => f.write_str(text),
            Reason::Made(why) => write!(f, "made anew: {why}"),
            Reason::Reused { milli_px } => {
                write!(f, "used again: off by {:.3} pixels at most", f64::from(*milli_px) * 1e-3)
            }
            Reason::TooLarge { bytes, most } => write!(
                f,
                "T2 would take {bytes} bytes and this device has {most} for it: light is gathered \
                 at once, anew at every edit"
            ),
        }
    }
}
